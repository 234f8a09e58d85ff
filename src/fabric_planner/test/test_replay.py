# SPDX-License-Identifier: BSD-3-Clause
"""A recorded trial becomes the observations our own agent would have sent."""

from pathlib import Path

import genpy
import pytest

from fabric_msgs.msg import Decision, Observation
from fabric_planner.replay import COLUMNS, Recording, ReplayError, from_messages, read_csv

HEADER = ",".join(COLUMNS)
# Two subtasks of a task of our own invention: the person places a cube (the report is written 1.3 s
# after the observation that it triggered), then stands idle, the robot takes over and is warned,
# the person tries and fails, the robot places the second cube, the task is over.
TRIAL = """\
0.000,manager,,,,,,,,,,,
1.000,observation,0,1,0,0,1,0,0,9,,,
1.100,robot,,,,,,,,,idle,,
2.000,observation,0,1,1,0,0,0,0,4,,,
3.000,observation,0,1,1,0,0,0,0,12,,,
4.300,sensor,,,,,,,,,,success,human
4.400,robot,,,,,,,,,planning for grasping,,
6.000,observation,1,1,0,0,1,0,0,8,,,
6.100,robot,,,,,,,,,grasp,,
7.000,observation,0,1,0,1,0,0,0,6,,,
7.100,robot,,,,,,,,,cancel all actions,,
8.000,observation,0,1,1,0,0,0,0,4,,,
9.000,observation,0,1,0,0,1,0,0,9,,,
9.100,robot,,,,,,,,,point to remind human,,
12.000,observation,0,1,0,0,1,0,0,9,,,
13.000,observation,0,1,0,0,1,0,0,9,,,
13.100,robot,,,,,,,,,,,
20.000,sensor,,,,,,,,,,robot succeeded,robot
21.000,observation,0,1,0,0,1,1,0,10,,,
21.500,sensor,,,,,,,,,,robot succeeded,robot
21.500,manager-task-done,,,,,,,,,,,
"""


def write(folder: Path, rows: str = TRIAL, name: str = "p_task1_proactive.csv") -> Path:
    path = folder / name
    path.write_text(f"{HEADER}\n{rows}")
    return path


@pytest.fixture
def trial(tmp_path) -> Recording:
    return read_csv(write(tmp_path))


def test_every_observation_and_every_placement_that_was_not_announced_is_a_step(trial) -> None:
    times = [step.time for step in trial.steps]
    assert times == [1.0, 2.0, 3.0, 6.0, 7.0, 8.0, 9.0, 12.0, 13.0, 20.0, 21.0]
    assert [step.observation.sequence for step in trial.steps] == list(range(1, 12))
    assert (trial.robot, trial.scenario, trial.name) == (
        "proactive",
        "sorting",
        "p_task1_proactive",
    )


def test_triggers_are_those_of_figure_6_5(trial) -> None:
    O = Observation  # noqa: E741
    assert [step.observation.trigger for step in trial.steps] == [
        O.TRIGGER_START, O.TRIGGER_ACTION_CHANGE, O.TRIGGER_SUBTASK, O.TRIGGER_ACTION_CHANGE,
        O.TRIGGER_WARNING, O.TRIGGER_ACTION_CHANGE, O.TRIGGER_ACTION_CHANGE, O.TRIGGER_TIMEOUT,
        O.TRIGGER_TIMEOUT, O.TRIGGER_SUBTASK, O.TRIGGER_SUBTASK,
    ]  # fmt: skip


def test_a_placement_of_the_person_joins_the_observation_that_announced_it(trial) -> None:
    observation = trial.steps[2].observation
    assert observation.subtask_success and observation.grasp_attempt
    assert [step.time for step in trial.steps if step.observation.subtask_success] == [3.0]


def test_a_placement_of_the_robot_stands_alone_with_the_person_as_last_seen(trial) -> None:
    observation = trial.steps[9].observation
    assert observation.robot_success and observation.detected and observation.idle
    assert not observation.subtask_success


def test_a_placement_after_the_end_joins_the_final_observation(trial) -> None:
    assert trial.steps[-1].final
    assert trial.steps[-1].observation.robot_success


def test_looking_around_is_taken_as_it_is_named(trial) -> None:
    looking = [step.time for step in trial.steps if step.observation.looking_around]
    assert looking == [6.0]


def test_decisions_belong_to_the_newest_observation_and_stay_in_force(trial) -> None:
    assert [step.recorded for step in trial.steps] == [
        "idle", None, "planning", "grasp", "cancel", None, "point", None, None, None, None,
    ]  # fmt: skip
    assert [step.in_force for step in trial.steps][-3:] == ["point"] * 3


def test_clocks_start_with_the_last_placement_and_waiting_with_the_end_of_a_warning(trial) -> None:
    elapsed = {step.time: step.observation.subtask_elapsed for step in trial.steps}
    assert elapsed[2.0] == pytest.approx(2.0)
    assert elapsed[6.0] == pytest.approx(1.7)
    waiting = {step.time: step.observation.waiting_time for step in trial.steps}
    assert waiting[6.0] == pytest.approx(1.7)
    assert waiting[7.0] == waiting[8.0] == 0.0
    assert waiting[13.0] == pytest.approx(5.0)


def test_an_attempt_has_failed_when_no_tray_has_reported_for_four_seconds(trial) -> None:
    failed = {step.time: step.observation.failed_attempts for step in trial.steps}
    assert (failed[9.0], failed[12.0], failed[13.0], failed[21.0]) == (0, 0, 1, 0)


def test_subtasks_are_counted_by_placements(trial) -> None:
    assert [step.subtask for step in trial.steps] == [1, 1, 1, 2, 2, 2, 2, 2, 2, 2, 3]
    assert trial.steps[2].decides_for == 2


def test_a_reactive_robots_symbols_announce_nothing(tmp_path) -> None:
    rows = TRIAL.replace("4.300,sensor", "5.300,sensor").replace("4.400,robot", "5.400,robot")
    proactive = read_csv(write(tmp_path, rows))
    reactive = read_csv(write(tmp_path, rows, "p_task1_reactive.csv"))
    assert [step.time for step in proactive.steps if step.observation.subtask_success] == [3.0]
    assert [step.time for step in reactive.steps if step.observation.subtask_success] == [5.3]


def test_a_wrong_placement_is_o9(tmp_path) -> None:
    trial = read_csv(write(tmp_path, TRIAL.replace("success,human", "fail,human"), "x.csv"))
    assert trial.steps[2].observation.subtask_failure
    assert trial.robot == "unknown"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("2.000,obs", "x,obs", "line 5: column 'time_s': 'x'"),
        ("2.000,obs", "nan,obs", "line 5: column 'time_s': 'nan'"),
        ("2.000,obs", "inf,obs", "line 5: column 'time_s': 'inf'"),
        ("2.000,obs", "-1,obs", "line 5: column 'time_s': '-1'"),
        ("2.000,obs", "0.5,obs", "line 5: column 'time_s': 0.5 s comes after 1.1 s"),
        ("2.000,observation", "2.000,camera", "line 5: column 'source': 'camera'"),
        ("observation,1,1", "observation,2,1", "line 9: column 'looking_around': '2'"),
        ("observation,1,1", "observation,1,", "line 9: column 'detected': ''"),
        ("0,12,,,", "0,14,,,", "line 6: column 'mapped_obs': '14'"),
        ("grasp,,\n7", "dance,,\n7", "line 10: column 'robot_action': 'dance'"),
        ("success,human", "success,dog", "line 7: column 'who': 'dog'"),
        ("success,human", "maybe,human", "line 7: column 'subtask_status': 'maybe'"),
        ("success,human", "success,human,1", "line 7: has 14 fields, not 13"),
        ("0.000,manager,,,,,,,,,,,", '"', "line"),
        (TRIAL, "", "holds no observation"),
    ],
)
def test_a_bad_row_is_refused_by_file_line_column_and_value(tmp_path, old, new, message) -> None:
    assert old in TRIAL
    path = write(tmp_path, TRIAL.replace(old, new, 1))
    with pytest.raises(ReplayError, match=f"{path.name}: .*{message}|{path.name}: {message}"):
        read_csv(path)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b"time,source\n", "line 1: column 1 is 'time', not 'time_s'"),
        (b"time_s,source\n", "line 1: column 3 is nothing"),
        (HEADER.encode() + b",more\n", "column 'more' is unknown"),
        (b"\xff\xfe\x00", "not a text file"),
    ],
)
def test_a_file_that_is_no_recording_is_refused(tmp_path, content, message) -> None:
    path = tmp_path / "x.csv"
    path.write_bytes(content)
    with pytest.raises(ReplayError, match=f"x.csv: .*{message}"):
        read_csv(path)
    with pytest.raises(ReplayError, match="gone.csv: cannot be read"):
        read_csv(tmp_path / "gone.csv")


def test_a_recording_of_our_own_keeps_its_messages_and_the_decisions_on_them() -> None:
    observations = [Observation(sequence=number, task_id=3, detected=True) for number in (4, 5, 7)]
    for number, observation in enumerate(observations):
        observation.header.stamp = genpy.Time(100 + 2 * number)
    observations[1].robot_failure = True
    decisions = [
        Decision(observation_sequence=5, action=Decision.GRASP),
        Decision(observation_sequence=4, action=Decision.PLANNING),
    ]
    recording = from_messages("bag", observations, decisions, "inspection", "reactive")
    assert [step.time for step in recording.steps] == [0.0, 2.0, 4.0]
    assert [step.recorded for step in recording.steps] == ["planning", "grasp", None]
    assert [step.observation.sequence for step in recording.steps] == [1, 2, 3]
    assert [step.subtask for step in recording.steps] == [1, 1, 2]
    assert recording.scenario == "inspection"


def test_a_bag_without_observations_or_with_a_falling_sequence_is_refused() -> None:
    with pytest.raises(ReplayError, match="bag: holds no message on a topic 'observation'"):
        from_messages("bag", [], [])
    twice = [Observation(sequence=2), Observation(sequence=2)]
    with pytest.raises(ReplayError, match="observation 2 comes after observation 2"):
        from_messages("bag", twice, [])
