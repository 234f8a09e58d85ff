# SPDX-License-Identifier: BSD-3-Clause
"""The folder of a library: replaced in one step, with what was there kept beside it, and never in
place of something else."""

from __future__ import annotations

import ctypes
import os
import shutil
from pathlib import Path

from fabric_abps import Library, LibraryError

AT_FDCWD, RENAME_EXCHANGE = -100, 2  # of renameat2(2)


def check_replaceable(target: Path, scenario: str) -> None:
    """Raises LibraryError when something lies there that is no library of the scenario."""
    if not target.exists():
        return
    if _is_empty(target):
        return
    try:
        Library.load(target, scenario)
    except LibraryError as error:
        raise LibraryError(
            f"{target} is not replaced, for it is no sound library; repair it or move it away: "
            f"{error}"
        ) from error


def before(target: Path) -> Path:
    """Where `replace_folder` keeps what was in the place of a folder."""
    return target.with_name(f".{target.name}.before")


def replace_folder(fresh: Path, target: Path) -> bool:
    """Put a folder in the place of another; a reader sees the one or the other.

    Returns whether anything was there; it is kept as `before` says, in place of what was kept
    there earlier.
    """
    if not target.exists() or _is_empty(target):
        os.rename(fresh, target)
        return False
    kept = before(target)
    _remove(kept)
    os.rename(fresh, kept)
    try:
        _exchange(kept, target)
    except OSError:  # a file system that cannot
        old = target.with_name(f".{target.name}.old")
        _remove(old)
        os.rename(target, old)
        os.rename(kept, target)
        os.rename(old, kept)
    return True


def _is_empty(folder: Path) -> bool:
    return folder.is_dir() and not any(folder.iterdir())


def _remove(folder: Path) -> None:
    if folder.is_symlink():
        folder.unlink()
    elif folder.exists():
        shutil.rmtree(folder)


def _exchange(one: Path, other: Path) -> None:
    libc = ctypes.CDLL(None, use_errno=True)
    paths = os.fsencode(one), os.fsencode(other)
    if libc.renameat2(AT_FDCWD, paths[0], AT_FDCWD, paths[1], RENAME_EXCHANGE) != 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number), str(one), None, str(other))
