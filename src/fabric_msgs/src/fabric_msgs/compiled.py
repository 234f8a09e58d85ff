# SPDX-License-Identifier: BSD-3-Clause
"""Modules that the build has also translated to machine code (fabric_sim/cmake/compiled.txt).

They are the same sources, several times faster. The build puts them into the folder
`fabric_compiled` beside the packages of the devel space, with a manifest that tells from which
sources; a package's `__init__` asks here to have them found before its sources:

    use(__name__, __path__)

They refer to each other, so it is all of them or none: none when one source is not the one they
were made from, when another copy of a package comes first on the path, or when FABRIC_COMPILED=0.
Then the sources run, with the same results.
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
import sysconfig
import warnings
from functools import cache
from importlib.util import find_spec
from pathlib import Path

FOLDER = "fabric_compiled"
MANIFEST = "manifest.json"


def use(package: str, path: list[str]) -> None:
    """Let a package find its compiled modules first; path: its `__path__`, changed in place."""
    folder = _usable(_beside_the_packages())
    if folder is not None and (folder / package).is_dir():
        path.insert(0, str(folder / package))


def fingerprint(source: Path) -> str:
    """Return what tells one version of a source file from another."""
    return hashlib.sha256(source.read_bytes()).hexdigest()


def _beside_the_packages() -> Path | None:
    """The folder of the devel space that this package was found through, if there is one."""
    package = sys.modules[__package__ or "fabric_msgs"]
    for place in package.__path__:
        folder = Path(place).parent / FOLDER
        if (folder / MANIFEST).is_file():
            return folder
    return None


@cache
def _usable(folder: Path | None) -> Path | None:
    if folder is None or os.environ.get("FABRIC_COMPILED") == "0":
        return None
    manifest = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
    reason = _objection(folder, manifest)
    if reason is None:
        return folder
    warnings.warn(f"{reason}; running slowly from the sources", RuntimeWarning, stacklevel=4)
    return None


def _objection(folder: Path, manifest: dict[str, dict[str, str]]) -> str | None:
    """Why the compiled modules cannot stand for the sources, or None."""
    if manifest["made_for"] != {"suffix": sysconfig.get_config_var("EXT_SUFFIX")}:
        return f"{folder} was made for another Python"
    for package, source in manifest["packages"].items():
        if not _comes_from(package, Path(source), folder.parent):
            return f"{folder} was made of another {package} than the first on the path"
    for source, wanted in manifest["sources"].items():
        if not Path(source).is_file() or fingerprint(Path(source)) != wanted:
            return f"{folder} is older than {source} (./fabric setup makes it anew)"
    return None


def _comes_from(package: str, source: Path, packages: Path) -> bool:
    """Whether the package that an import finds lies in the sources or in the devel space."""
    loaded = sys.modules.get(package)
    if loaded is not None:
        return str(source) in loaded.__path__
    spec = find_spec(package)
    found = None if spec is None or spec.origin is None else Path(spec.origin).parent
    return found in (source, packages / package)


__all__ = ["FOLDER", "MANIFEST", "fingerprint", "use"]
