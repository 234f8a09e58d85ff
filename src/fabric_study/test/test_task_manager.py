# SPDX-License-Identifier: BSD-3-Clause
"""The flow of Fig. 6.3: every scored thing once, numbered without gaps."""

import math

import pytest
from desk import BELT, BLUE, GREEN, PERSON, RED, ROBOT, Desk, definition
from hypothesis import given, settings
from hypothesis import strategies as st

from fabric_msgs.msg import ConveyorState, TaskEvent, TaskState
from fabric_study.task_manager import Counters
from fabric_study.tasks import load_definition

STARTED, SUB_STARTED = TaskEvent.TASK_STARTED, TaskEvent.SUBTASK_STARTED
RIGHT, WRONG = TaskEvent.SUBTASK_SUCCEEDED, TaskEvent.SUBTASK_FAILED
WARNING, WON, LOST = TaskEvent.WARNING, TaskEvent.TASK_SUCCEEDED, TaskEvent.TASK_FAILED
BELT_SPEED = 0.05


def test_the_rules_are_shown_for_their_time_before_the_task_starts():
    desk = Desk(definition())
    assert desk.manager.state.status == TaskState.SHOWING_RULES
    assert desk.belt(seconds=1.0) == []
    assert desk.belt() == [STARTED]
    assert desk.manager.state.status == TaskState.RUNNING
    assert desk.commands == [(0.0, False), (BELT_SPEED, False)]


def test_a_subtask_starts_when_its_cube_arrives_and_the_belt_may_bring_back_a_cube_put_down():
    desk = Desk(definition())
    desk.run()
    assert desk.belt(cube=True) == [SUB_STARTED]
    assert desk.belt(cube=False, seconds=2.0) == []
    assert desk.commands[-1] == (BELT_SPEED, False)
    assert desk.place(1, PERSON, "red") == [RIGHT]
    assert desk.commands[-1] == (BELT_SPEED, False)


@pytest.mark.parametrize(
    "owner, label, kind, by, score, counter",
    [
        (PERSON, "red", RIGHT, TaskEvent.BY_PERSON, 10, "succeeded_by_person"),
        (PERSON, "blue", WRONG, TaskEvent.BY_PERSON, -6, "failed_by_person"),
        (ROBOT, "red", RIGHT, TaskEvent.BY_ROBOT, 4, "succeeded_by_robot"),
        (ROBOT, "green", WRONG, TaskEvent.BY_ROBOT, -6, "failed_by_robot"),
        (BELT, "uninspected", WRONG, TaskEvent.BY_NOBODY, -6, "failed_by_robot"),
    ],
)
def test_a_placement_is_judged_by_the_rule_and_credited(owner, label, kind, by, score, counter):
    desk = Desk(definition())
    desk.run()
    desk.belt(cube=True)
    assert desk.place(1, owner, label) == [kind]
    event, state = desk.events[-1], desk.manager.state
    assert (event.by, event.score, event.cube_id, event.cube_colour) == (by, score, 1, RED)
    assert event.container == label
    assert (getattr(state, counter), state.score) == (1, score)
    (result,) = desk.manager.results
    assert (result.number, result.success, result.by) == (1, kind == RIGHT, by)


@pytest.mark.parametrize(
    "labels, end, status",
    [
        (("red", "green", "blue"), WON, TaskState.SUCCEEDED),
        (("red", "blue", "blue"), WON, TaskState.SUCCEEDED),
        (("red", "blue", "green"), LOST, TaskState.FAILED),
    ],
)
def test_the_task_ends_with_its_last_cube_and_succeeds_with_enough_right(labels, end, status):
    desk = Desk(definition())
    desk.run()
    for cube_id, label in enumerate(labels, start=1):
        desk.belt(cube=True)
        assert not desk.manager.finished
        kinds = desk.place(cube_id, PERSON, label)
    assert kinds[1:] == [end]
    assert desk.manager.finished
    assert desk.manager.state.status == status
    assert desk.commands[-1] == (0.0, False)


def test_too_many_wrong_end_the_task_at_once_where_the_definition_says_so():
    desk = Desk(definition(fails_at=1))
    desk.run()
    desk.belt(cube=True)
    assert desk.place(1, ROBOT, "blue") == [WRONG, LOST]


def test_after_t_max_the_belt_carries_the_package_into_the_box():
    desk = Desk(load_definition("inspection"))
    desk.belt(seconds=3.1)
    desk.belt(cube=True, seconds=0.1)
    assert desk.belt(cube=True, seconds=51.9) == []
    assert desk.commands[-1] == (BELT_SPEED, False)
    assert desk.belt(cube=True, seconds=0.1) == []
    assert desk.commands[-1] == (BELT_SPEED, True)
    desk.belt(seconds=2.0)
    assert desk.place(1, BELT, "uninspected") == [WRONG, LOST]
    assert desk.manager.state.duration == pytest.approx(54.1)


def test_a_cube_placed_while_the_belt_runs_on_still_counts():
    desk = Desk(definition())
    desk.run()
    desk.belt(cube=True, seconds=21.0)
    assert desk.place(1, PERSON, "red") == [RIGHT]
    assert desk.commands[-1] == (BELT_SPEED, False)


def test_a_cube_that_is_lost_fails_after_the_limit_and_does_not_count_later():
    desk = Desk(definition())
    desk.run()
    kinds = desk.belt(cube=True, seconds=0.1) + desk.belt(seconds=25.0)
    assert kinds == [SUB_STARTED, WRONG]
    assert desk.events[-1].by == TaskEvent.BY_NOBODY
    desk.belt(cube=True)
    assert desk.place(1, PERSON, "red") == []
    assert desk.place(2, PERSON, "green") == [RIGHT]


def test_a_cube_that_never_comes_fails_too():
    desk = Desk(definition())
    desk.run()
    assert desk.belt(seconds=8.0) == [SUB_STARTED, WRONG]


def test_a_cube_that_the_sensor_missed_starts_before_it_ends():
    desk = Desk(definition())
    desk.run()
    assert desk.place(1, PERSON, "red") == [SUB_STARTED, RIGHT]


def test_repeated_reports_and_unknown_cubes_score_nothing():
    desk = Desk(definition())
    desk.run()
    desk.belt(cube=True)
    desk.place(1, PERSON, "red")
    assert desk.report() == []
    assert desk.place(1, ROBOT, "blue") == []
    assert desk.place(99, PERSON, "red") == []
    assert desk.manager.state.score == 10


def test_nothing_is_scored_while_the_rules_are_shown_and_after_the_end():
    desk = Desk(definition(colours=(RED,), success_needs=1))
    assert desk.place(1, PERSON, "red") + desk.warn() == []
    desk.contents.clear()
    desk.run()
    desk.belt(cube=True)
    desk.place(1, PERSON, "red")
    assert desk.warn() + desk.belt(cube=True, seconds=60.0) + desk.report() == []


def test_signals_without_a_gap_are_one_warning():
    desk = Desk(definition(warning_gap=1.0))
    desk.run()
    kinds = desk.warn()
    for _ in range(30):
        desk.belt()
        kinds += desk.warn()
    desk.belt(seconds=1.0)
    kinds += desk.warn()
    assert kinds == [WARNING, WARNING]
    assert desk.manager.state.warnings == 2


def test_an_aborted_task_says_so_once():
    desk = Desk(definition())
    desk.run()
    assert desk.note(desk.manager.abort(desk.t)) == [TaskEvent.TASK_ABORTED]
    assert desk.note(desk.manager.abort(desk.t)) == []
    assert desk.manager.state.status == TaskState.ABORTED
    assert desk.commands[-1] == (0.0, False)


def test_numbers_go_on_across_the_tasks_of_a_run():
    counters = Counters()
    sequences, states = [], []
    for task_id in (1, 2):
        desk = Desk(definition(colours=(GREEN,), success_needs=1), task_id, counters)
        states.append(desk.manager.state.sequence)
        desk.run()
        desk.belt(cube=True)
        desk.place(1, ROBOT, "green")
        sequences += [event.sequence for event in desk.events]
        assert {event.task_id for event in desk.events} == {task_id}
    assert sequences == list(range(1, 9))
    assert states == [1, 5]


def test_a_state_is_a_copy():
    desk = Desk(definition())
    desk.manager.state.rules.clear()
    assert len(desk.manager.state.rules) == 3


def test_a_belt_command_is_handed_out_once():
    desk = Desk(definition())
    desk.manager.on_conveyor(11.0, ConveyorState())
    desk.manager.on_conveyor(12.0, ConveyorState())
    assert desk.manager.belt_command == (BELT_SPEED, False)
    assert desk.manager.belt_command is None


def test_time_must_be_finite_and_not_run_backwards():
    desk = Desk(definition())
    desk.run()
    with pytest.raises(ValueError, match="backwards"):
        desk.manager.on_warning(5.0)
    with pytest.raises(ValueError, match="time is nan"):
        desk.manager.on_warning(math.nan)


def test_a_task_begins_once():
    desk = Desk(definition())
    with pytest.raises(RuntimeError, match="task 1 has begun before"):
        desk.manager.begin(20.0)


STEPS = st.lists(
    st.one_of(
        st.tuples(st.just("belt"), st.booleans(), st.floats(0.1, 15.0)),
        st.tuples(
            st.just("place"),
            st.integers(0, 5),
            st.sampled_from([(PERSON, "red"), (PERSON, "blue"), (ROBOT, "green"), (BELT, "x")]),
        ),
        st.tuples(st.just("warn")),
    ),
    max_size=40,
)


@settings(max_examples=150, deadline=None)
@given(STEPS)
def test_whatever_happens_every_cube_is_scored_at_most_once_and_nothing_follows_the_end(steps):
    desk = Desk(definition(colours=(RED, GREEN, BLUE, RED)))
    desk.run()
    for step in steps:
        if step[0] == "belt":
            desk.belt(step[1], step[2])
        elif step[0] == "place":
            desk.place(step[1], *step[2])
        else:
            desk.warn()
    kinds = [event.kind for event in desk.events]
    ended = [event.cube_id for event in desk.events if event.kind in (RIGHT, WRONG)]
    started = [event.cube_id for event in desk.events if event.kind == SUB_STARTED]
    state = desk.manager.state
    assert [event.sequence for event in desk.events] == list(range(1, len(kinds) + 1))
    assert len(ended) == len(set(ended))
    assert len(started) - len(ended) in (0, 1)
    assert state.score == sum(event.score for event in desk.events)
    assert state.warnings == kinds.count(WARNING)
    assert desk.manager.finished == (len(ended) == 4)
    if desk.manager.finished:
        assert kinds[-1] in (WON, LOST)
        assert kinds.count(WON) + kinds.count(LOST) == 1
