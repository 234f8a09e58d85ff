# SPDX-License-Identifier: BSD-3-Clause
"""Counts the test cases in JUnit files: `count_results.py FOLDER CTEST_EXIT_CODE`.

Prints one closing line `N passed, M failed`; exit 1 unless something ran and nothing failed.
"""

from __future__ import annotations

import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

WRAPPER = "rostest-"  # rostest's own report: one case a script; the script's cases are in rosunit-*


def count_file(path: Path) -> tuple[int, list[str]]:
    """(cases that passed, names of those that failed, erred or were skipped) in one JUnit file."""
    try:
        cases = list(ElementTree.parse(path).iter("testcase"))
    except ElementTree.ParseError as error:
        return 0, [f"{path.name}: {error}"]
    bad = [
        f"{case.get('classname', path.stem)}.{case.get('name')}"
        for case in cases
        if any(case.find(kind) is not None for kind in ("failure", "error", "skipped"))
        or case.get("status") == "notrun"
    ]
    return len(cases) - len(bad), bad


def count(folder: Path) -> tuple[int, list[str]]:
    """(passed, names of the failed) over all files; a rostest wrapper counts only if it failed."""
    passed, failed = 0, []
    for path in sorted(folder.rglob("*.xml")):
        good, bad = count_file(path)
        passed += 0 if path.name.startswith(WRAPPER) else good
        failed += bad
    return passed, failed


def main(folder: Path, ctest_code: int) -> int:
    """Prints the names of what failed and the closing line."""
    passed, failed = count(folder)
    if not failed and ctest_code:
        failed = ["ctest failed though every reported case passed"]
    if not failed and not passed:
        failed = ["no test ran"]
    for name in failed:
        print(f"failed: {name}")
    print(f"{passed} passed, {len(failed)} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), int(sys.argv[2])))
