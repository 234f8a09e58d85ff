# SPDX-License-Identifier: BSD-3-Clause
"""Under policy on_call a raised hand, or the button, asks for help, and is no warning."""

import pytest
from desk import GREEN, PERSON, RED, ROBOT, Desk, definition

from fabric_msgs.msg import TaskEvent, TaskState
from fabric_study.meter import TaskMeter

CALL, WARNING = TaskEvent.CALL, TaskEvent.WARNING
ENDED = [TaskEvent.SUBTASK_SUCCEEDED]


def working(policy="on_call") -> Desk:
    """A task whose first cube stands at the pick point."""
    desk = Desk(definition(colours=(RED, GREEN), warning_gap=1.0), policy=policy)
    desk.run()
    desk.belt(cube=True)
    return desk


def raised_again(desk: Desk) -> list[int]:
    """The hand, raised once more after the gap."""
    desk.belt(cube=True, seconds=2.0)
    return desk.warn()


def test_hands_call_and_send_away_by_turns():
    desk = working()
    assert desk.warn() == [CALL]
    assert [raised_again(desk) for _ in range(3)] == [[WARNING], [CALL], [WARNING]]
    assert desk.manager.state.warnings == 2


def test_a_hand_that_stays_up_is_one_call():
    desk = working()
    kinds = desk.warn()
    for _ in range(20):
        desk.belt(cube=True)
        kinds += desk.warn()
    assert kinds == [CALL]
    assert desk.manager.state.warnings == 0


@pytest.mark.parametrize("owner", [PERSON, ROBOT])
def test_a_call_lasts_until_the_cube_lies_somewhere(owner):
    desk = working()
    desk.warn()
    assert desk.place(1, owner, "red") == ENDED
    assert raised_again(desk) == [CALL]


def test_under_any_other_policy_a_raised_hand_is_a_warning():
    for policy in ("", "proactive", "none", "on_call.pomdpx"):
        assert working(policy).warn() == [WARNING]


def test_the_button_calls_once_and_says_why_not_twice():
    desk = working()
    assert desk.manager.objection_to_call == ""
    assert desk.note(desk.manager.on_call(desk.t)) == [CALL]
    assert desk.manager.objection_to_call == "the robot has been called already"
    assert desk.note(desk.manager.on_call(desk.t)) == []
    assert raised_again(desk) == [WARNING]
    assert desk.note(desk.manager.on_call(desk.t)) == [CALL]


def test_the_button_is_refused_where_nobody_listens():
    other = working("proactive")
    assert other.manager.objection_to_call == "nobody waits for a call under policy proactive"
    assert other.note(other.manager.on_call(other.t)) == []
    early = Desk(definition(), policy="on_call")
    assert early.manager.objection_to_call == "no task is running"
    assert early.note(early.manager.on_call(early.t)) == []


def test_a_call_costs_nothing_and_counts_as_no_warning():
    desk = working()
    meter = TaskMeter(desk.manager.state, "manual", "on_call")
    desk.warn()
    for number, label in ((1, "red"), (2, "green")):
        desk.belt(cube=True, seconds=2.0)
        desk.place(number, ROBOT, label)
    for event in desk.events:
        meter.on_event(event)
    meter.on_state(desk.manager.state)
    row = meter.row()
    assert desk.manager.state.status == TaskState.SUCCEEDED
    assert (row["warnings"], row["robot_succeeded"], row["discounted_reward"]) == (0, 2, 12.0)
    assert ("event", "call") in [(line[4], line[6]) for line in meter.log()]
