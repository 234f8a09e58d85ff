# SPDX-License-Identifier: BSD-3-Clause
"""The task manager scores every type of task by its own rules, as worked out by hand."""

from dataclasses import replace

import pytest
from desk import BELT, BLUE, GREEN, PERSON, RED, ROBOT, Desk

from fabric_msgs.msg import TaskEvent, TaskState
from fabric_study.task_manager import TaskManager
from fabric_study.tasks import load_definition

ORDER = (RED, GREEN, BLUE, RED, GREEN, RED, GREEN, BLUE, RED, BLUE)
NAMES = {"r": "red", "g": "green", "b": "blue"}
TABLE = [  # type, where the ten cubes of ORDER belong, score when a person puts all into red
    ("type_1_colours", "rgbrgrgbrb", 4 * 10 - 6 * 6),
    ("type_2_sequence", "rbbgrrbbgr", 4 * 10 - 6 * 6),
    ("type_3_mixed", "grbbrgrrbb", 4 * 10 - 6 * 6),
    ("type_4_memory", "brggrbgbrg", 3 * 10 - 7 * 6),
    ("type_5_stroop", "brgrgbbbrg", 3 * 10 - 7 * 6),
]


def desk_of(name: str) -> Desk:
    desk = Desk(replace(load_definition(name), order=ORDER, rules_display_time=1.0))
    desk.run()
    return desk


def play(name: str, trays: str, owners=(PERSON,)) -> TaskState:
    """Put cube after cube into trays, by turns of the owners; return the last state."""
    desk = desk_of(name)
    for number, tray in enumerate(trays):
        desk.belt(cube=True)
        desk.place(number + 1, owners[number % len(owners)], NAMES[tray])
    return desk.manager.state


@pytest.mark.parametrize(("name", "right", "_"), TABLE)
def test_who_puts_every_cube_where_it_belongs_gets_all_points(name, right, _):
    state = play(name, right, owners=(PERSON, ROBOT))
    assert (state.succeeded_by_person, state.succeeded_by_robot) == (5, 5)
    assert state.status == TaskState.SUCCEEDED
    assert state.score == 5 * 10 + 5 * 4


@pytest.mark.parametrize(("name", "right", "score"), TABLE)
def test_who_puts_every_cube_into_one_tray_gets_what_the_table_says(name, right, score):
    state = play(name, "r" * 10)
    assert (state.succeeded_by_person, state.failed_by_person) == (
        right.count("r"),
        10 - right.count("r"),
    )
    assert state.status == TaskState.FAILED
    assert state.score == score


@pytest.mark.parametrize(("name", "right", "_"), TABLE)
def test_a_cube_that_the_belt_carries_away_takes_its_turn_with_it(name, right, _):
    desk = desk_of(name)
    desk.belt(cube=True)
    desk.place(1, BELT, "uninspected")
    desk.belt(cube=True)
    desk.place(2, PERSON, NAMES[right[1]])
    kinds = [event.kind for event in desk.events if event.cube_id and event.container]
    assert kinds == [TaskEvent.SUBTASK_FAILED, TaskEvent.SUBTASK_SUCCEEDED]


@pytest.mark.parametrize(("name", "right", "_"), TABLE)
def test_the_state_tells_everybody_where_every_cube_belongs(name, right, _):
    definition = replace(load_definition(name), order=ORDER)
    state = TaskManager(definition, 1, seed=3, policy="proactive").state
    assert "".join(state.rules[i].label[0] for i in state.cube_rules) == right
    assert (state.policy, state.load) == ("proactive", definition.load)
    state._check_types()


def test_nobody_changes_the_rules_of_cubes_from_outside():
    manager = desk_of("type_4_memory").manager
    manager.state.cube_rules.clear()
    assert len(manager.state.cube_rules) == 10
