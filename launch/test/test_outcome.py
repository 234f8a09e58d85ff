# SPDX-License-Identifier: BSD-3-Clause
"""The exit code of a run is what its own record says."""

from __future__ import annotations

import json

import pytest

from fabric_bringup import outcome


@pytest.mark.parametrize(
    ("status", "launch_code", "code"),
    [
        ("finished", 0, 0),
        ("finished", 130, 0),
        ("interrupted", 130, 130),
        ("interrupted", 0, 130),
        ("running", 143, 143),
        ("running", 0, 1),
        ("failed", 0, 1),
    ],
)
def test_the_record_decides(tmp_path, status, launch_code, code):
    (tmp_path / "run.json").write_text(json.dumps({"status": status}))
    assert outcome.main(tmp_path, launch_code) == code


def test_a_run_without_a_record_failed(tmp_path, capsys):
    assert outcome.main(tmp_path, 0) == 1
    assert "not started" in capsys.readouterr().err


def test_a_broken_record_is_told(tmp_path, capsys):
    (tmp_path / "run.json").write_text("{")
    assert outcome.main(tmp_path, 0) == 1
    assert "run.json" in capsys.readouterr().err


def test_the_folder_and_unclosed_bags_are_named(tmp_path, capsys):
    (tmp_path / "task_001.bag").touch()
    (tmp_path / "task_002.bag.active").touch()
    outcome.main(tmp_path, 0)
    told = capsys.readouterr().out
    assert f"record   {tmp_path}\n" in told
    assert "unclosed" in told
    assert "task_002.bag.active" in told
    assert "task_001" not in told
