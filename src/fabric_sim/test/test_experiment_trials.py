# SPDX-License-Identifier: BSD-3-Clause
"""Recordings: what is read, what is refused, and that simulated people are recorded alike."""

from pathlib import Path

import numpy as np
import pytest
from recording_helpers import robot, seen, tray

from fabric_sim.batch_loop import RunSetup
from fabric_sim.experiments.recorder import record, simulated_trials
from fabric_sim.experiments.trials import (
    ABSENT,
    COLUMNS,
    FLAGS,
    GRASP,
    IDLE,
    LOOK,
    NOTHING,
    PERSON_FAILED,
    PERSON_SUCCEEDED,
    ROBOT_GRASP,
    ROBOT_IDLE,
    ROBOT_SUCCEEDED,
    TICK,
    UNSEEN,
    WALK,
    WARN,
    TrialError,
    by_person,
    read_folder,
    read_trial,
    symbol_of,
    write_rows,
)

SHIPPED = Path(__file__).parents[1] / "recorded"
NAME = "person04_task2_proactive.csv"

GOOD = [
    {"time_s": "0.000", "source": "manager"},
    seen("1.000", idle=1),
    robot("1.900", "grasp"),
    seen("2.500", grasp_attempt=1),
    robot("3.100", "cancel all actions"),
    tray("4.000", "success", "human"),
    tray("4.000", "fail", "human"),
    tray("6.000", "robot succeeded", "robot"),
]


def written(folder, rows, name=NAME):
    write_rows(folder / name, rows)
    return folder / name


def test_a_recording_is_read_on_an_even_grid(tmp_path):
    trial = read_trial(written(tmp_path, GOOD))
    assert (trial.person, trial.task, trial.robot_name) == ("person04", 2, "proactive")
    assert len(trial) == 6.0 / TICK + 1
    assert trial.symbols.tolist() == [UNSEEN] * 2 + [IDLE] * 3 + [GRASP] * 8
    assert trial.robot.tolist() == [ROBOT_IDLE] * 4 + [ROBOT_GRASP] * 3 + [ROBOT_IDLE] * 6
    assert trial.observations == 2


def test_two_reports_at_once_go_to_ticks_of_their_own(tmp_path):
    events = read_trial(written(tmp_path, GOOD)).events
    assert events[8:].tolist() == [
        PERSON_SUCCEEDED,
        PERSON_FAILED,
        NOTHING,
        NOTHING,
        ROBOT_SUCCEEDED,
    ]


@pytest.mark.parametrize(
    ("flags", "symbol"),
    [
        ((), ABSENT),
        (("detected", "warning", "grasp_attempt"), WARN),
        (("detected", "grasp_attempt", "looking_around"), GRASP),
        (("detected", "looking_around", "idle"), LOOK),
        (("detected", "idle"), IDLE),
        (("detected",), WALK),
        (("warning",), ABSENT),
    ],
)
def test_what_a_person_is_seen_to_do(flags, symbol):
    assert symbol_of({name: name in flags for name in FLAGS}) == symbol


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"time_s": "nan"}, "row 4: column time_s: 'nan' is not within a day"),
        ({"time_s": "inf"}, "row 4: column time_s: 'inf' is not within a day"),
        ({"time_s": "-1"}, "row 4: column time_s: '-1' is not within a day"),
        ({"time_s": "soon"}, "row 4: column time_s: 'soon' is not a number"),
        ({"time_s": "0.5"}, "row 4: column time_s: 0.5 is before the row above"),
        ({"source": "ghost"}, "row 4: column source: 'ghost' is not one of 'manager'"),
        ({"robot_action": "dance"}, "row 4: column robot_action: 'dance' is not one of ''"),
    ],
)
def test_a_bad_cell_is_refused_by_file_row_column_and_value(tmp_path, change, complaint):
    rows = [dict(row) for row in GOOD]
    rows[2].update(change)
    path = written(tmp_path, rows)
    with pytest.raises(TrialError, match=complaint) as error:
        read_trial(path)
    assert str(path) in str(error.value)


def test_a_flag_that_is_neither_0_nor_1_is_refused(tmp_path):
    rows = [dict(row) for row in GOOD]
    rows[1]["detected"] = "yes"
    with pytest.raises(TrialError, match="row 3: column detected: 'yes'"):
        read_trial(written(tmp_path, rows))


def test_an_unknown_outcome_is_refused(tmp_path):
    with pytest.raises(TrialError, match="column subtask_status: 'maybe'"):
        read_trial(written(tmp_path, [*GOOD, tray("9", "maybe", "human")]))


def test_files_that_are_no_recordings_are_refused(tmp_path):
    with pytest.raises(TrialError, match="no such folder"):
        read_folder(tmp_path / "nowhere")
    with pytest.raises(TrialError, match="holds no .csv file"):
        read_folder(tmp_path)
    with pytest.raises(TrialError, match="the name should be like"):
        read_trial(written(tmp_path, GOOD, "notes.csv"))
    with pytest.raises(TrialError, match="there is no observation"):
        read_trial(written(tmp_path, GOOD[:1]))
    (tmp_path / NAME).write_text("time_s,source\n0,manager\n", encoding="utf-8")
    with pytest.raises(TrialError, match="row 1: column looking_around is missing"):
        read_trial(tmp_path / NAME)
    (tmp_path / NAME).write_text(",".join(COLUMNS) + "\n0,manager\n", encoding="utf-8")
    with pytest.raises(TrialError, match="row 2: has not 13 cells"):
        read_trial(tmp_path / NAME)
    (tmp_path / NAME).write_bytes(b"\xff\xfe\x00")
    with pytest.raises(TrialError, match=NAME):
        read_trial(tmp_path / NAME)


def test_the_shipped_recordings_hold_four_people_in_the_order_of_their_tasks():
    people = by_person(read_folder(SHIPPED))
    assert [len(own) for own in people.values()] == [4] * 4
    for own in people.values():
        assert [trial.task for trial in own] == [1, 2, 3, 4]
        assert all((trial.events != NOTHING).sum() == 10 for trial in own)


def test_a_simulated_task_is_recorded_like_a_real_one(tmp_path):
    (rows,) = record(RunSetup("sorting", "0.5,0.6,0.7,0.4", "curious", 103), 1)
    trial = read_trial(written(tmp_path, rows, "p_task1_curious.csv"))
    assert (trial.events != NOTHING).sum() == 10
    assert {IDLE, GRASP} <= set(trial.symbols.tolist())
    assert ROBOT_GRASP in trial.robot
    assert float(rows[0]["time_s"]) == 0.0


def test_the_same_seed_records_the_same_and_fresh_people_have_no_past():
    setup = RunSetup("inspection", "beginner_tired_attentive_collaborative", "reactive", 104)
    first, second = (simulated_trials(setup, 2, "p", fresh=True) for _ in range(2))
    for a, b in zip(first, second, strict=True):
        assert np.array_equal(a.symbols, b.symbols)
        assert np.array_equal(a.robot, b.robot)
