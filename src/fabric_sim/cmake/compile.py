# SPDX-License-Identifier: BSD-3-Clause
"""Translates the modules of compiled.txt to machine code with mypyc, for the devel space.

python3 compile.py SOURCES WORK PACKAGES
    SOURCES   the folder that holds the packages' folders
    WORK      a folder of its own for what is made on the way
    PACKAGES  the devel space's folder of Python packages; they go to fabric_compiled in it
"""

from __future__ import annotations

import json
import os
import shutil
import sys
import sysconfig
from pathlib import Path

HERE = Path(__file__).resolve().parent
SETTINGS = """[mypy]
ignore_missing_imports = True
follow_imports = silent
[mypy-numpy.*]
follow_imports = skip
follow_imports_for_stubs = True
"""
GROUP = "fabric"


def source_of(sources: Path, module: str) -> Path:
    """The file of a module named as package/module."""
    package = module.split("/")[0]
    return sources / package / "src" / f"{module}.py"


def translate(sources: Path, modules: list[str], work: Path) -> Path:
    """Compile; return the folder of what was made. Leaves the process when it cannot be."""
    from mypyc.build import mypycify  # noqa: PLC0415  # is missing where nothing is compiled
    from setuptools import setup  # noqa: PLC0415

    (work / "mypy.ini").write_text(SETTINGS, encoding="utf-8")
    os.environ["MYPYPATH"] = ":".join(str(p) for p in sorted(sources.glob("fabric_*/src")))
    os.chdir(work)
    files = [str(source_of(sources, module)) for module in modules]
    options = ["--config-file=mypy.ini", "--explicit-package-bases"]
    extensions = mypycify(
        [*options, *files], opt_level="3", debug_level="0", strip_asserts=False, group_name=GROUP
    )
    made = work / "made"
    arguments = ["--quiet", "build_ext", "--build-lib", str(made), "--build-temp", str(work)]
    setup(name=GROUP, packages=[], ext_modules=extensions, script_args=arguments)
    return made


def put(made: Path, folder: Path) -> None:
    """Move what was made into place, file by file, so that no running process loses its own.

    The library that all share goes beside the packages, where an import finds it.
    """
    for path in sorted(made.rglob("*.so")):
        inside = path.relative_to(made)
        target = (folder if len(inside.parts) > 1 else folder.parent) / inside
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(path, target.with_suffix(".new"))
        os.replace(target.with_suffix(".new"), target)


def main(sources: Path, work: Path, packages: Path) -> int:
    """Compile the modules of the list; return the exit code."""
    sys.path.insert(0, str(sources / "fabric_msgs" / "src" / "fabric_msgs"))
    from compiled import FOLDER, MANIFEST, fingerprint  # noqa: PLC0415

    lines = (HERE / "compiled.txt").read_text(encoding="utf-8").splitlines()
    modules = [line for line in lines if not line.startswith("#")]
    files = [source_of(sources, module) for module in modules]
    manifest = {
        "made_for": {"suffix": sysconfig.get_config_var("EXT_SUFFIX")},
        "packages": {m.split("/")[0]: str(f.parent) for m, f in zip(modules, files, strict=True)},
        "sources": {str(file): fingerprint(file) for file in files},
    }
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    folder = packages / FOLDER
    made = translate(sources, modules, work)
    (folder / MANIFEST).unlink(missing_ok=True)
    put(made, folder)
    (folder / MANIFEST).write_text(json.dumps(manifest, indent=1), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(*(Path(argument).resolve() for argument in sys.argv[1:4])))
