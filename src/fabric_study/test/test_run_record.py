# SPDX-License-Identifier: BSD-3-Clause
"""run.json is whole at every moment and says how the run ended."""

import json

import pytest

from fabric_study.run_record import RunRecord, read_run


def test_a_run_is_running_until_it_says_otherwise(tmp_path):
    record = RunRecord(tmp_path / "new", {"seed": 1})
    folder = tmp_path / "new"
    assert read_run(folder)["status"] == "running"
    record.model("proactive", "abc")
    record.task_done()
    record.end("finished")
    run = read_run(folder)
    assert (run["status"], run["tasks_done"], run["models"]) == (
        "finished",
        1,
        {"proactive": "abc"},
    )
    assert run["parameters"] == {"seed": 1}
    assert run["versions"]["python"].startswith("3.")
    assert [path.name for path in folder.iterdir()] == ["run.json"]


def test_the_folder_of_another_run_is_refused(tmp_path):
    RunRecord(tmp_path, {})
    with pytest.raises(FileExistsError, match="run.json belongs to another run"):
        RunRecord(tmp_path, {})


def test_an_unknown_status_is_refused(tmp_path):
    with pytest.raises(ValueError, match="status 'fine'"):
        RunRecord(tmp_path, {}).end("fine")


@pytest.mark.parametrize("text", ["{", "[1]", "\x00"])
def test_a_damaged_file_is_refused_by_name(tmp_path, text):
    (tmp_path / "run.json").write_text(text)
    with pytest.raises(ValueError, match="run.json"):
        read_run(tmp_path)


def test_no_file_is_no_run(tmp_path):
    assert read_run(tmp_path) == {}


def test_the_file_is_json_for_other_programs(tmp_path):
    RunRecord(tmp_path, {"human": "expert"})
    assert json.loads((tmp_path / "run.json").read_text())["parameters"]["human"] == "expert"
