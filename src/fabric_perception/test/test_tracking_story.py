# SPDX-License-Identifier: BSD-3-Clause
"""Cubes keep their identity, and every container event comes once."""

import numpy as np
import pytest
from drawn import YELLOW
from story import REST, Story

from fabric_msgs.msg import Container, Cube

RED, GREEN, BLUE = Cube.COLOUR_RED, Cube.COLOUR_GREEN, Cube.COLOUR_BLUE
GREEN_TRAY, ROBOT_RED, BOX = 2, 4, 7  # ids of containers of the sorting scenario
IN_GREEN = np.array([0.47, 0.035, 0.0225])
IN_ROBOT_RED = np.array([0.145, -0.268, 0.0785])
IN_BOX = np.array([0.281, 0.215, 0.0325])


def told(story):
    """(cube, tray, by) of every deposit."""
    return [(d.cube, d.tray, d.by) for d in story.deposits]


def test_cubes_are_numbered_in_the_order_of_the_belt_and_keep_their_numbers():
    story = Story()
    for colour, along in ((RED, -0.05), (GREEN, -0.21)):
        story.put(colour, along)
    story.wait(6).run_belt(0.05)
    story.put(RED, -0.32)
    story.wait(2).run_belt(0.08)
    assert [(c.id, c.colour) for c in story.seen.cubes] == [(1, RED), (2, GREEN), (3, RED)]
    for cube, truth in zip(story.seen.cubes, story.cubes, strict=True):
        assert np.linalg.norm(cube.position - truth[1]) < 0.006


@pytest.mark.parametrize("signals", [True, False], ids=["with infrared", "pictures only"])
def test_a_cube_in_the_hand_keeps_its_number_and_goes_with_the_hand(signals):
    story = Story(signals=signals)
    taken = story.put(GREEN, 0.0)
    story.put(GREEN, -0.16)
    story.wait(6).carry_to(taken, IN_GREEN).wait(3)
    seen = [where for where in story.wheres(1) if signals or where != Cube.WHERE_BELT]
    assert seen == [Cube.WHERE_PICK_POINT, Cube.WHERE_PERSON, Cube.WHERE_CONTAINER]
    assert np.linalg.norm(story.cube(1).position - IN_GREEN) < 0.006
    assert story.wheres(2) == [Cube.WHERE_BELT]
    assert len(story.seen.cubes) == 2


def test_a_cube_in_a_closed_hand_is_where_the_hand_is():
    story = Story()
    taken = story.put(BLUE, 0.0)
    story.wait(6).reach(story.grip_of(story.cubes[taken][1]))
    story.cubes[taken][1] = np.array([0.9, 0.9, -0.5])  # nowhere to be seen
    story.reach((0.55, 0.1, 0.20)).wait(2)
    cube = story.cube(1)
    assert cube.where == Cube.WHERE_PERSON
    assert np.linalg.norm(cube.position - story.hand) < 0.08
    assert cube.age > 0.5
    assert cube.confidence < story.history[5].cubes[0].confidence


def test_a_hand_over_a_cube_does_not_take_it():
    story = Story()
    story.put(RED, 0.0)
    story.wait(6).reach((0.30, 0.035, 0.19)).wait(8).reach(REST).wait(2)
    assert set(story.wheres(1)) == {Cube.WHERE_PICK_POINT}
    assert [cube.id for cube in story.seen.cubes] == [1]


def test_a_cube_put_back_on_the_belt_is_the_same_cube():
    story = Story()
    taken = story.put(RED, 0.0)
    back = story.cubes[taken][1].copy()
    story.wait(6).reach(story.grip_of(back)).reach((0.55, 0.10, 0.20), taken)
    story.cubes[taken][1] = np.array([0.9, 0.9, -0.5])  # the fingers close around it
    story.wait(3).reach(story.grip_of(back))
    story.cubes[taken][1] = back
    story.wait(1).reach(REST).wait(4)
    assert [(cube.id, cube.where) for cube in story.seen.cubes] == [(1, Cube.WHERE_PICK_POINT)]
    assert story.deposits == []


def test_a_load_cell_and_a_track_make_one_deposit_of_the_person():
    story = Story()
    taken = story.put(GREEN, 0.0)
    story.wait(6).carry_to(taken, IN_GREEN).wait(3)
    assert story.deposits == []
    story.step(GREEN_TRAY)
    story.wait(60)
    assert told(story) == [(1, GREEN_TRAY, Container.OWNER_PERSON)]
    assert story.deposits[0].weighed
    assert story.tracking.containers.contents[GREEN_TRAY] == [1]


def test_a_load_cell_tells_of_a_cube_that_the_hand_still_hides():
    story = Story()
    taken = story.put(GREEN, 0.0)
    start = story.cubes[taken][1].copy()
    story.wait(6).reach(story.grip_of(start)).reach(story.grip_of(IN_GREEN), taken)
    story.cubes[taken][1] = IN_GREEN
    story.wait(6)
    story.step(GREEN_TRAY)
    assert told(story) == [(1, GREEN_TRAY, Container.OWNER_PERSON)]
    story.reach(REST).wait(50)
    assert len(story.deposits) == 1
    assert story.cube(1).where == Cube.WHERE_CONTAINER


def test_a_silent_load_cell_costs_time_and_no_cube():
    story = Story(parameters={"unweighed_after": 2.0})
    taken = story.put(GREEN, 0.0)
    story.wait(6).carry_to(taken, IN_GREEN).wait(25)
    assert told(story) == [(1, GREEN_TRAY, Container.OWNER_PERSON)]
    assert not story.deposits[0].weighed
    story.step(GREEN_TRAY)  # at last
    story.wait(60)
    assert len(story.deposits) == 1
    assert story.tracking.containers.unexplained == 0


def test_a_hand_on_the_tray_makes_no_deposit():
    story = Story(parameters={"step_patience": 1.0})
    story.put(RED, 0.0)
    story.wait(6).reach((0.50, 0.035, 0.06))
    story.step(GREEN_TRAY)
    story.wait(15)
    assert story.deposits == []
    assert story.tracking.containers.unexplained == 1


@pytest.mark.parametrize("signals", [True, False], ids=["with infrared", "pictures only"])
def test_the_robot_carries_a_cube_to_its_tray(signals):
    story = Story(signals=signals)
    taken = story.put(RED, 0.0)
    story.wait(6).lift_to(taken, IN_ROBOT_RED).wait(6)
    seen = story.wheres(1)
    if not signals:  # the cup that hides a part of the cube seems to move it
        seen = [w for i, w in enumerate(seen) if w != Cube.WHERE_BELT and w not in seen[:i]]
    assert seen == [Cube.WHERE_PICK_POINT, Cube.WHERE_ROBOT, Cube.WHERE_CONTAINER]
    assert told(story) == [(1, ROBOT_RED, Container.OWNER_ROBOT)]
    assert np.linalg.norm(story.cube(1).position - IN_ROBOT_RED) < 0.006


def test_a_second_cube_beside_the_first_in_a_tray_is_another_event():
    story = Story()
    places = [IN_ROBOT_RED, IN_ROBOT_RED + (0.0, 0.02875, 0.0)]
    for number, place in enumerate(places, start=1):
        taken = story.put(RED, 0.0)
        story.wait(6).lift_to(taken, place).wait(6)
        assert told(story)[-1] == (number, ROBOT_RED, Container.OWNER_ROBOT)
    assert len(story.deposits) == 2
    assert story.tracking.containers.contents[ROBOT_RED] == [1, 2]


def test_what_falls_off_the_belt_is_in_the_box_by_nobody():
    story = Story()
    fallen = story.put(BLUE, 0.04)
    story.wait(6).run_belt(0.08)
    story.cubes[fallen][1] = IN_BOX
    story.wait(15)
    assert told(story) == [(1, BOX, Container.OWNER_BELT)]


def test_a_cube_that_the_box_hides_counts_too():
    story = Story()
    fallen = story.put(BLUE, 0.04)
    story.wait(6).run_belt(0.08)
    story.cubes[fallen][1] = np.array([0.9, 0.9, -0.5])
    story.wait(25)
    assert told(story) == [(1, BOX, Container.OWNER_BELT)]


def test_a_new_task_begins_with_number_one():
    story = Story()
    story.put(RED, 0.0)
    story.wait(6)
    sequence = story.tracking.containers.sequence
    story.tracking.start_task()
    story.cubes.clear()
    story.put(BLUE, -0.2)
    story.wait(6)
    assert [(c.id, c.colour) for c in story.seen.cubes] == [(1, BLUE)]
    assert story.tracking.containers.sequence > sequence


def test_a_yellow_box_is_no_glove_and_does_not_draw_the_hand_away():
    story = Story()
    story.extras.append(((0.60, -0.34, 0.012), (0.06, 0.09, 0.024), YELLOW))  # flat, glove-sized
    story.extras.append(((0.45, 0.36, 0.02), (0.04, 0.04, 0.04), YELLOW))  # small
    story.hidden = True
    story.wait(5)
    assert story.seen.hand is None
    assert len(story.seen.refusals) == 2
    story.hidden = False
    story.wait(5)
    assert np.linalg.norm(story.seen.hand.position - REST) < 0.03
