# SPDX-License-Identifier: BSD-3-Clause
"""The tools that check how the code reads, and the rules no tool knows."""

from __future__ import annotations

import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import tree

COMMENTED = (".py", ".cpp", ".hpp", ".h", ".launch", ".test", ".yaml", ".urdf", ".in", ".txt")
LARGEST_FILE = 400  # lines; tests 600
LARGEST_TEST = 600


def run(*command: str | Path) -> None:
    """Runs a tool at the root; its words are the failure."""
    told = subprocess.run(command, cwd=tree.ROOT, capture_output=True, text=True, check=False)
    assert told.returncode == 0, told.stdout + told.stderr


def lines_with(pattern: str, paths: list[Path]) -> list[str]:
    """file:line of every match."""
    return [
        f"{tree.shown(path)}:{number}: {line.strip()}"
        for path in paths
        for number, line in enumerate(path.read_text().splitlines(), 1)
        if re.search(pattern, line)
    ]


def test_ruff_finds_nothing():
    run(sys.executable, "-m", "ruff", "check", "--no-cache", "src", "launch", "tests")


def test_clang_format_changes_nothing():
    sources = tree.files(".cpp", ".hpp", ".h")
    run("clang-format", "--dry-run", "-Werror", *sources)


def test_catkin_lint_finds_nothing():
    run("catkin_lint", "--quiet", "--strict", "-W1", "src", "launch", "tests")


def test_shellcheck_finds_nothing():
    run("shellcheck", "fabric", ".ci/run", *tree.files(".sh"))


def test_every_source_file_names_its_licence():
    sources = [*tree.files(*COMMENTED), tree.ROOT / "fabric", tree.ROOT / "CMakeLists.txt"]
    bare = [
        tree.shown(path)
        for path in sources
        if "SPDX-License-Identifier: BSD-3-Clause" not in path.read_text()[:400]
    ]
    assert not bare


def test_no_path_of_one_machine():
    text = tree.files(*COMMENTED, ".md", ".rviz", ".xml", ".msg", ".srv", ".action")
    paths = [path for path in text if not is_test(path)]
    assert not lines_with(r"(?<![\w$}.])/(work|root|home|Users)/", paths)


def test_every_launch_argument_is_explained():
    bare = [
        f"{tree.shown(path)}: {argument.get('name')}"
        for path in tree.files(".launch")
        for argument in ElementTree.parse(path).getroot().findall("arg")
        if not argument.get("doc")
    ]
    assert not bare


def test_no_test_waits_by_the_clock():
    tests = [path for path in tree.files(".py", ".cpp", ".test") if is_test(path)]
    assert not lines_with(r"\b(sleep|sleep_for|usleep)\(", [p for p in tests if p != THIS])


def test_no_test_is_left_out():
    tests = [path for path in tree.files(".py", ".cpp") if is_test(path) and path != THIS]
    assert not lines_with(r"pytest\.mark\.skip|pytest\.skip|xfail|GTEST_SKIP|DISABLED_", tests)


def test_nothing_is_left_for_later():
    assert not lines_with(r"\b(TODO|FIXME|XXX)\b", [p for p in tree.files(*COMMENTED) if p != THIS])


def test_files_stay_readable():
    code = tree.files(".py", ".cpp", ".hpp", ".h")
    long = {tree.shown(path): len(path.read_text().splitlines()) for path in code}
    limits = {tree.shown(path): LARGEST_TEST if is_test(path) else LARGEST_FILE for path in code}
    assert not {name: count for name, count in long.items() if count > limits[name]}


THIS = Path(__file__).resolve()


def is_test(path: Path) -> bool:
    """Lies in a package's test/ or in tests/."""
    return bool({"test", "tests"}.intersection(path.relative_to(tree.ROOT).parts))
