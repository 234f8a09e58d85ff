# SPDX-License-Identifier: BSD-3-Clause
"""What cameras cost in place of labels: pairs, intervals, verdicts, files."""

import csv
import json
import math

import pytest

from fabric_sim.batch_loop import TaskResult
from fabric_sim.camera.drawing import CannotDraw
from fabric_sim.experiments import command, sensing
from fabric_study.meter import COLUMNS

PLAIN = dict.fromkeys(COLUMNS, 0) | {"stage2_accuracy": None, "human_succeeded": 8}


def row(kind, seed, **values):
    return {"sensing": kind, "root_seed": seed, **PLAIN, "task": 1, **values}


def lines(rows):
    return {line.measure.title: line for line in sensing.lines_of(rows)}


def test_differences_are_means_over_pairs_of_equal_seed():
    found = lines(
        [
            *(row("camera", seed, success=1, stage1_accuracy=0.5 + 0.1 * seed) for seed in (1, 2)),
            *(row("direct", seed, success=seed - 1, stage1_accuracy=0.6) for seed in (1, 2)),
            row("camera", 3, success=0, stage1_accuracy=0.0),  # its partner is missing
        ]
    )
    success = found["tasks that succeed, %"]
    assert (success.n, success.camera.value, success.direct.value) == (2, 100.0, 50.0)
    assert success.difference.value == 50.0 and not success.within
    stage = found["stage 1 estimated right, %"]
    assert stage.difference.value == pytest.approx(5.0)
    assert stage.difference.low == pytest.approx(5.0 - 12.706 * 5.0, abs=0.01)  # t of 1 degree


def test_a_measure_that_one_of_a_pair_lacks_is_left_out_and_never_within():
    found = lines([row("camera", 1, stage2_accuracy=1.0), row("direct", 1)])
    stage = found["stage 2 estimated right, %"]
    assert stage.n == 0 and math.isnan(stage.difference.value) and not stage.within


def test_warnings_are_counted_of_the_cubes_that_were_dealt_with():
    camera = row("camera", 1, warnings=2, human_failed=1, robot_succeeded=1)
    found = lines([camera, row("direct", 1, warnings=1, human_succeeded=4)])
    warnings = found["warnings, of 100 cubes"]
    assert (warnings.camera.value, warnings.direct.value) == (20.0, 25.0)


@pytest.fixture
def played(monkeypatch):
    """Every job ends at once."""
    monkeypatch.setattr(sensing, "require_pictures", lambda jobs: None)
    done = TaskResult(PLAIN | {"task": 1, "success": 1, "stage1_accuracy": 0.5}, [], [])
    monkeypatch.setattr(
        sensing, "results_of", lambda jobs, processes: ((job, [(done, [])]) for job in jobs)
    )


@pytest.mark.usefixtures("played")
def test_the_command_writes_rows_and_summary_and_prints_the_table(tmp_path, capsys):
    folder = tmp_path / "out"
    assert command.main(["sensing", "--seed", "101", "--seeds", "2", "--out", str(folder)]) == 0
    with (folder / "results.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(r["sensing"], r["root_seed"]) for r in rows] == [
        ("camera", "101"), ("camera", "102"), ("direct", "101"), ("direct", "102")
    ]  # fmt: skip
    held = {line["measure"]: line for line in json.loads((folder / "summary.json").read_text())}
    assert held["tasks that succeed, %"]["within"] is True
    assert held["stage 2 estimated right, %"]["difference"]["value"] is None
    assert held["reward a task"]["within"] is None
    said = capsys.readouterr().out
    assert "seeds 101 to 102, 1 task(s) each" in said and "camera - direct" in said
    assert json.loads((folder / "run.json").read_text())["status"] == "finished"
    assert command.main(["sensing", "--seeds", "2", "--out", str(folder)]) == 2


def test_without_pictures_the_command_ends_with_a_sentence(tmp_path, capsys, monkeypatch):
    def refuse(jobs):
        raise CannotDraw("no EGL here")

    monkeypatch.setattr(sensing, "require_pictures", refuse)
    assert command.main(["sensing", "--seeds", "1", "--out", str(tmp_path / "out")]) == 2
    assert "fabric: no EGL here" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("words", [["--seeds", "0"], ["--scenario", "cooking"], ["--tasks", "x"]])
def test_words_that_make_no_sense_are_refused(words):
    with pytest.raises(SystemExit, match="2"):
        command.main(["sensing", *words])
