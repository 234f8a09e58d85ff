# SPDX-License-Identifier: BSD-3-Clause
"""replay.launch, as `./fabric replay` starts it: recordings go through the real decision node."""

from __future__ import annotations

import json
import os
import re
import signal
from pathlib import Path

import pytest
import rosbag
from whole_runs import running

from fabric_msgs.msg import Decision, Observation, TaskState

DEADLINE = 120  # s, wall time for a whole replay
# A trial of our own invention: a cube by the person, then one that the robot takes over, warned.
TRIAL = """\
time_s,source,looking_around,detected,grasp_attempt,warning,idle,task_success,task_failure,mapped_obs,robot_action,subtask_status,who
0.000,manager,,,,,,,,,,,
1.000,observation,0,1,1,0,0,0,0,4,,,
1.100,robot,,,,,,,,,idle,,
3.000,observation,0,1,1,0,0,0,0,12,,,
4.300,sensor,,,,,,,,,,success,human
7.000,observation,0,1,0,0,1,0,0,9,,,
7.100,robot,,,,,,,,,grasp,,
9.000,observation,0,1,0,1,0,0,0,6,,,
9.100,robot,,,,,,,,,cancel all actions,,
12.000,observation,0,1,1,0,0,1,0,10,,,
13.000,sensor,,,,,,,,,,success,human
"""


def replay(folder: Path, recording: Path, *words: str) -> str:
    """A replay to its end; returns what it said."""
    with running(folder, f"file:={recording}", *words, launch="replay") as process:
        told, _ = process.communicate(timeout=DEADLINE)
    return told


@pytest.fixture
def trial(tmp_path: Path) -> Path:
    path = tmp_path / "made_reactive.csv"
    path.write_text(TRIAL)
    return path


@pytest.mark.parametrize("policy", ["proactive", "reactive"])
def test_a_csv_file_is_decided_on_row_by_row_and_summed_up(tmp_path, trial, policy):
    told = replay(tmp_path / "out", trial, f"policy:={policy}")
    summary = json.loads((tmp_path / "out" / "replay.json").read_text())
    assert summary["model"] == f"sorting_{policy}"
    assert summary["observations"] == 5
    assert summary["warnings"] == 1
    assert [t["warned"] for t in summary["recorded_take_overs"]] == [True]
    assert summary["agreement"]["ours_by_recorded"]["cancel"]["cancel"] == 1
    assert "Agreement with the recorded robot" in told
    assert (tmp_path / "out" / "replay.png").is_file()


def test_a_bag_of_ours_is_replayed_with_the_model_of_its_scenario(tmp_path):
    path = tmp_path / "task.bag"
    with rosbag.Bag(str(path), "w") as bag:
        bag.write("/task/state", TaskState(scenario="inspection"))
        for number in (1, 2, 3):
            observation = Observation(sequence=number, task_id=7, detected=True, idle=True)
            observation.header.stamp.secs = 3 * number
            bag.write("/observation", observation)
            bag.write("/decision", Decision(observation_sequence=number, action=Decision.PLANNING))
    told = replay(tmp_path / "out", path)
    summary = json.loads((tmp_path / "out" / "replay.json").read_text())
    assert summary["model"] == "inspection_proactive", told
    assert summary["recorded_decisions"]["planning"] == 3


def test_a_bad_row_ends_the_replay_with_its_place_and_without_a_summary(tmp_path, trial):
    trial.write_text(TRIAL.replace("idle,,\n3.000", "dance,,\n3.000"))
    told = replay(tmp_path / "out", trial)
    assert "made_reactive.csv: line 4: column 'robot_action': 'dance' is none of" in told
    assert not (tmp_path / "out" / "replay.json").exists()


def test_a_model_that_cannot_run_ends_the_replay_with_the_reason(tmp_path, trial):
    model = tmp_path / "broken.pomdpx"
    model.write_text("<pomdpx>")
    told = replay(tmp_path / "out", trial, f"policy:={model}")
    assert f"the decision node refuses {model}" in told
    assert not (tmp_path / "out" / "replay.json").exists()


def test_the_death_of_the_decision_node_ends_the_replay_with_a_sentence(tmp_path, trial):
    words = (f"file:={trial}", "speed:=1")
    with running(tmp_path / "out", *words, launch="replay") as process:
        told, pid = "", None
        while pid is None or " task_assigned_to_human " not in told:  # they come in either order
            told += process.stdout.readline() or pytest.fail(told)
            pid = re.search(r"process\[decision-\d+\]: started with pid \[(\d+)\]", told)
        os.kill(int(pid.group(1)), signal.SIGKILL)
        rest, _ = process.communicate(timeout=DEADLINE)
    assert "the decision node died" in rest
    assert not (tmp_path / "out" / "replay.json").exists()
