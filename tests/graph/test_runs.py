# SPDX-License-Identifier: BSD-3-Clause
"""Whole runs of sim.launch: same seed, same results, with ROS or without; Ctrl-C ends cleanly."""

from __future__ import annotations

import csv
import signal
from pathlib import Path

import pytest
import rospkg
import yaml
from whole_runs import DEADLINE, event_log, headless, run, running, status

from fabric_study.event_journal import JOURNAL_FILE, read_journal


def test_the_same_seed_gives_the_same_results_file(tmp_path):
    logs = [
        event_log(run(tmp_path / name, "tasks:=3", "seed:=3", "record:=false", "human:=mixed"))
        for name in ("first", "second")
    ]
    first, second = ((tmp_path / name / "results.csv").read_text() for name in ("first", "second"))
    assert first == second
    assert len(first.splitlines()) == 4
    assert logs[0] == logs[1]


@pytest.mark.parametrize(("scenario", "tasks"), [("inspection", 4), ("sorting", 1)])
def test_the_graph_and_the_headless_runner_give_the_same_files(tmp_path, scenario, tasks):
    words = (f"scenario:={scenario}", f"tasks:={tasks}", "seed:=5", "human:=mixed")
    told = run(tmp_path / "graph", *words, "record:=false")
    results = (tmp_path / "graph/results.csv").read_text()
    assert (results, event_log(told)) == headless(tmp_path / "headless", *words)


def test_a_sequence_to_memorise_runs_in_the_graph_as_without_it(tmp_path):
    words = ("task:=type_4_memory", "tasks:=1", "seed:=106", "policy:=reactive")
    words += ("human:=beginner_tired_distracted_collaborative",)
    told = run(tmp_path / "graph", *words, "scenario:=sorting")
    results = (tmp_path / "graph/results.csv").read_text()
    assert (results, event_log(told)) == headless(tmp_path / "headless", *words)
    scored = [row for row in rows(tmp_path / "graph/events.csv") if row["what"] == "event"]
    journal = read_journal(tmp_path / "graph" / JOURNAL_FILE)
    assert [entry["sequence"] for entry in journal.entries] == [int(r["number"]) for r in scored]
    assert [entry["what"] for entry in journal.entries] == [
        row["details"].split()[0] for row in scored
    ]
    assert any(e["what"] == "subtask_succeeded" and e["by"] == "robot" for e in journal.entries)


def test_a_robot_on_call_comes_in_the_graph_as_without_it(tmp_path):
    words = ("scenario:=sorting", "tasks:=1", "seed:=107", "policy:=on_call")
    words += ("human:=beginner_rested_attentive_collaborative",)
    told = run(tmp_path / "graph", *words)
    results = (tmp_path / "graph/results.csv").read_text()
    assert (results, event_log(told)) == headless(tmp_path / "headless", *words)
    said = [entry["what"] for entry in read_journal(tmp_path / "graph" / JOURNAL_FILE).entries]
    assert "call" in said


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_switching_inside_a_task_does_not_depend_on_the_network(tmp_path):
    shipped = rospkg.RosPack().get_path("fabric_abps") + "/config/selector.yaml"
    values = yaml.safe_load(Path(shipped).read_text()) | {"switch_inside": True}
    settings = tmp_path / "selector.yaml"
    settings.write_text(yaml.safe_dump(values | {"switch_margin": 0.0}))
    words = ("policy:=abps", "human:=mixed", "tasks:=5", "seed:=105", f"selector:={settings}")
    told = run(tmp_path / "graph", *words, "record:=false")
    results = (tmp_path / "graph/results.csv").read_text()
    assert (results, event_log(told)) == headless(tmp_path / "headless", *words)
    values["switch_inside"] = False
    settings.write_text(yaml.safe_dump(values))
    assert headless(tmp_path / "stays", *words)[1] != event_log(told)


def test_a_run_ends_by_itself_with_a_table_and_closed_bags(tmp_path):
    told = run(tmp_path, "tasks:=2", "seed:=1")
    assert "results.csv" in told
    assert len(list(tmp_path.glob("*.bag"))) == 2
    assert not list(tmp_path.glob("*.active"))


def test_ctrl_c_in_the_middle_closes_the_bags(tmp_path):
    with running(tmp_path, "tasks:=1000") as process:
        for line in process.stdout:
            if "1000" in line and list(tmp_path.glob("*.bag")):
                break
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=DEADLINE)
    assert status(tmp_path) == "interrupted"
    assert list(tmp_path.glob("*.bag"))
    assert not list(tmp_path.glob("*.active"))
