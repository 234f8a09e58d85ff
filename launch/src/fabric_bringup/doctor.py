#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What is missing or wrong on this machine, each with its cure. Standard library only."""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

if __package__:
    from fabric_bringup import ports
else:
    import ports

SETUP = "./fabric setup"
NUMPY = "1.24.2"
SOURCES = ("src", "launch", "tests", "CMakeLists.txt")
Finding = tuple[str, str]  # what is wrong, how it is cured


def wanted_packages(root: Path) -> list[str]:
    """Names in apt-packages.txt, comments removed."""
    lines = (root / "apt-packages.txt").read_text().splitlines()
    return [name for line in lines for name in line.partition("#")[0].split()]


def _run(command: list[str]) -> str:
    """Standard output of a command, empty when it cannot be run."""
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=60).stdout
    except (OSError, subprocess.TimeoutExpired):
        return ""


def check_system(root: Path) -> Iterator[Finding]:
    """Debian 12, whose ROS packages everything rests on."""
    try:
        release = platform.freedesktop_os_release()
    except OSError:
        release = {}
    if (release.get("ID"), release.get("VERSION_ID")) != ("debian", "12"):
        name = release.get("PRETTY_NAME", "an unknown system")
        yield f"this is {name}, not Debian 12", "use Debian 12 or a container of it"


def check_packages(root: Path) -> Iterator[Finding]:
    """Every Debian package of the list."""
    wanted = wanted_packages(root)
    told = _run(["dpkg-query", "-W", "-f=${db:Status-Status} ${Package}\n", *wanted])
    installed = {line.split()[1] for line in told.splitlines() if line.startswith("installed ")}
    missing = sorted(set(wanted) - installed)
    if missing:
        yield f"Debian packages are missing: {' '.join(missing)}", SETUP


def check_path(root: Path) -> Iterator[Finding]:
    """The first python3 must be one that sees ROS, or hand-started scripts fail."""
    first = shutil.which("python3") or "none"
    if not _run([first, "-c", "import rospy; print('yes')"]).strip():
        cure = "work in ./fabric shell, or put /usr/bin first"
        yield f"the first python3 on the PATH ({first}) cannot import rospy", cure


def check_environment(root: Path) -> Iterator[Finding]:
    """The venv, its NumPy, and no OpenCV that hides Debian's."""
    python = root / ".venv/bin/python3"
    if not python.exists():
        yield "there is no Python environment", SETUP
        return
    numpy = _run([str(python), "-c", "import numpy; print(numpy.__version__)"]).strip()
    if numpy != NUMPY:
        wrong = f"NumPy is {numpy or 'missing'}, but Debian's cv2 and SciPy need {NUMPY}"
        yield wrong, f"rm -rf .venv, then {SETUP}"
    for folder in (root / ".venv").glob("lib/python3*/site-packages/cv2"):
        yield f"{folder} hides Debian's OpenCV", ".venv/bin/pip uninstall opencv-python"
    if not _run([str(python), "-c", "import rospy; print('yes')"]).strip():
        yield "the Python environment does not see ROS", f"rm -rf .venv, then {SETUP}"


def check_build(root: Path) -> Iterator[Finding]:
    """A build that is there and not older than its sources."""
    stamp = root / "build/.fabric_built_all"
    if not stamp.exists() or not (root / "devel/setup.bash").exists():
        yield "the workspace is not built", SETUP
        return
    built = stamp.stat().st_mtime
    for top in SOURCES:
        files = [root / top] if (root / top).is_file() else (root / top).rglob("*")
        for path in files:
            if path.is_file() and "__pycache__" not in path.parts and path.stat().st_mtime > built:
                yield f"the build is older than {path.relative_to(root)}", SETUP
                return


def check_master(root: Path) -> Iterator[Finding]:
    """A master that somebody else runs, or an environment that points nowhere."""
    if not ports.is_free(ports.USUAL):
        cure = "none needed: ./fabric sim takes a free port"
        yield f"port {ports.USUAL} is busy, perhaps with another ROS master", cure
    uri = os.environ.get("ROS_MASTER_URI", "")
    if uri and "localhost" not in uri and "127.0.0.1" not in uri:
        cure = "unset ROS_MASTER_URI unless that is meant"
        yield f"ROS_MASTER_URI points to another machine: {uri}", cure


def check_screen(root: Path) -> Iterator[Finding]:
    """rviz needs a screen."""
    if not os.environ.get("DISPLAY"):
        cure = "run under Xvfb, see docs/screenshot.md"
        yield "there is no screen (DISPLAY is not set), so rviz:=true cannot work", cure


CHECKS: tuple[Callable[[Path], Iterator[Finding]], ...] = (
    check_system,
    check_packages,
    check_path,
    check_environment,
    check_build,
    check_master,
    check_screen,
)
HARMLESS = (check_path, check_master, check_screen)


def main(root: Path) -> int:
    """Prints every finding; exit 1 if one of them keeps `./fabric` from working."""
    code = 0
    for check in CHECKS:
        findings = list(check(root))
        verdict = "ok   " if not findings else "note " if check in HARMLESS else "WRONG"
        print(f"{verdict} {check.__doc__}")
        for wrong, cure in findings:
            print(f"        {wrong}\n        cure: {cure}")
        if findings and check not in HARMLESS:
            code = 1
    return code


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
