# SPDX-License-Identifier: BSD-3-Clause
"""The closing line of ./fabric test is true."""

from __future__ import annotations

import sys

import pytest
import tree

sys.path.insert(0, str(tree.ROOT / "tests"))
import count_results  # noqa: E402

CASES = {
    "good": '<testcase classname="a" name="b"/>',
    "bad": '<testcase classname="a" name="c"><failure message="x"/></testcase>',
    "broken": '<testcase classname="a" name="d"><error message="x"/></testcase>',
    "left_out": '<testcase classname="a" name="e"><skipped/></testcase>',
}


def closing_line(folder, capsys, code: int) -> tuple[int, str]:
    exit_code = count_results.main(folder, code)
    return exit_code, capsys.readouterr().out.splitlines()[-1]


def write(folder, name: str, *cases: str) -> None:
    body = "".join(CASES[case] for case in cases)
    (folder / name).write_text(f"<testsuites><testsuite>{body}</testsuite></testsuites>")


def test_cases_are_counted_over_all_files(tmp_path, capsys):
    write(tmp_path, "gtest-a.xml", "good", "good")
    (tmp_path / "package").mkdir()
    write(tmp_path / "package", "pytest-b.xml", "good")
    assert closing_line(tmp_path, capsys, 0) == (0, "3 passed, 0 failed")


@pytest.mark.parametrize("kind", ["bad", "broken", "left_out"])
def test_what_did_not_pass_failed(tmp_path, capsys, kind):
    write(tmp_path, "gtest-a.xml", "good", kind)
    assert closing_line(tmp_path, capsys, 8) == (1, "1 passed, 1 failed")


def test_the_wrapper_of_a_rostest_counts_only_when_it_fails(tmp_path, capsys):
    write(tmp_path, "rostest-loop.xml", "good")
    write(tmp_path, "rosunit-loop.xml", "good", "good")
    assert closing_line(tmp_path, capsys, 0) == (0, "2 passed, 0 failed")
    write(tmp_path, "rostest-loop.xml", "bad")
    assert closing_line(tmp_path, capsys, 8) == (1, "2 passed, 1 failed")


def test_nothing_run_and_a_failing_ctest_fail(tmp_path, capsys):
    assert closing_line(tmp_path, capsys, 0) == (1, "0 passed, 1 failed")
    write(tmp_path, "gtest-a.xml", "good")
    assert closing_line(tmp_path, capsys, 8) == (1, "1 passed, 1 failed")


def test_a_file_that_is_no_xml_failed(tmp_path, capsys):
    (tmp_path / "gtest-a.xml").write_text("<testsuite>")
    assert closing_line(tmp_path, capsys, 0) == (1, "0 passed, 1 failed")
