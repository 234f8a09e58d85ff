# SPDX-License-Identifier: BSD-3-Clause
"""The folder of a trained library: replaced in one step, and never in place of something else."""

from __future__ import annotations

import ctypes
import os
import shutil
from pathlib import Path

from fabric_abps import Library, LibraryError
from fabric_abps.library import INDEX

MODELS = "models.npz"  # of a library's folder
AT_FDCWD, RENAME_EXCHANGE = -100, 2  # of renameat2(2)


def check_replaceable(target: Path, scenario: str) -> None:
    """Raises LibraryError when something lies there that is no library of the scenario."""
    if not target.exists():
        return
    if not (target / INDEX).is_file() and target.is_dir() and not any(target.iterdir()):
        return
    try:
        Library.load(target, scenario)
    except LibraryError as error:
        raise LibraryError(
            f"{target} is not replaced, for it is no sound library; repair it or move it away: "
            f"{error}"
        ) from error


def replace_folder(fresh: Path, target: Path) -> None:
    """Put a folder in the place of another; a reader sees the one or the other."""
    if not target.exists():
        os.rename(fresh, target)
        return
    try:
        _exchange(fresh, target)
    except OSError:  # a file system that cannot
        old = target.with_name(f".{target.name}.old")
        shutil.rmtree(old, ignore_errors=True)
        os.rename(target, old)
        os.rename(fresh, target)
        fresh = old
    shutil.rmtree(fresh)


def _exchange(one: Path, other: Path) -> None:
    libc = ctypes.CDLL(None, use_errno=True)
    paths = os.fsencode(one), os.fsencode(other)
    if libc.renameat2(AT_FDCWD, paths[0], AT_FDCWD, paths[1], RENAME_EXCHANGE) != 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number), str(one), None, str(other))
