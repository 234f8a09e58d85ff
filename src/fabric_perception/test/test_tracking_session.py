# SPDX-License-Identifier: BSD-3-Clause
"""The tracker among its devices: what is told when, and what is refused."""

import genpy
import numpy as np
import pytest
from drawn import Painter, camera, palette, workspace
from std_msgs.msg import Header

from fabric_msgs.msg import ConveyorState, Cube, LoadCellReadings, TaskState
from fabric_perception.tracking.session import TrackingSession
from fabric_perception.tracking.weighing import Scales, scale_parameters

AT_PICK_POINT = np.array([0.281, 0.035, 0.1345])
HAND = (0.6, 0.2, 0.06)
SCALES = {"counts_per_gram": 420.0, "cube": 18.0}


def task(number, scenario="sorting", status=TaskState.RUNNING):
    return TaskState(task_id=number, scenario=scenario, status=status)


@pytest.fixture(scope="module")
def pictures():
    painter = Painter(camera(), workspace(), seed=103)
    painter.cube(Cube.COLOUR_GREEN, AT_PICK_POINT).glove(HAND)
    return painter.picture(noise=2.0, blur=0.6, depth_noise=0.001)


@pytest.fixture
def session():
    made = TrackingSession(workspace(), palette(), scales=Scales(scale_parameters(SCALES)))
    made.use_camera(camera())
    return made


def look(session, pictures, first=1, count=6):
    """The answers to so many pictures, ten a second."""
    return [
        session.on_pictures(Header(stamp=genpy.Time.from_sec(0.1 * k)), *pictures)
        for k in range(first, first + count)
    ]


def test_pictures_are_answered_with_cubes_and_hand_of_their_stamp(session, pictures):
    session.on_task(task(1))
    session.on_conveyor(ConveyorState(speed=0.0, cube_at_pick_point=True))
    last = look(session, pictures)[-1]
    assert last.cubes.header.stamp == last.hand.header.stamp == genpy.Time.from_sec(0.6)
    (cube,) = last.cubes.cubes
    assert (cube.id, cube.colour, cube.where) == (1, Cube.COLOUR_GREEN, Cube.WHERE_PICK_POINT)
    at = cube.pose.position
    assert np.linalg.norm((at.x, at.y, at.z) - AT_PICK_POINT) < 0.006
    at = last.hand.position
    assert last.hand.visible and np.linalg.norm(np.subtract((at.x, at.y, at.z), HAND)) < 0.03


def test_containers_are_told_when_they_change_and_numbered_over_the_tasks(session, pictures):
    first = session.on_task(task(1))
    assert first.sequence == 1 and all(not row.cube_ids for row in first.containers)
    assert session.on_task(task(1)) is None
    assert all(answer.containers is None for answer in look(session, pictures))
    assert session.on_task(task(2, status=TaskState.SUCCEEDED)) is None
    assert session.on_task(task(2, "inspection")).sequence == 2
    assert session.tracking.workspace.scenario == "inspection"


def test_a_new_task_begins_with_new_numbers(session, pictures):
    session.on_task(task(1))
    look(session, pictures)
    session.on_task(task(2))
    assert [c.id for c in look(session, pictures, first=7)[-1].cubes.cubes] == [1]


def test_the_cup_is_taken_to_be_where_it_was_at_the_time_of_the_picture(session):
    for k in range(3):
        session.on_cup(0.1 * k, (0.2 + 0.1 * k, 0.0, 0.1))
    there = workspace().arm.to_cell(np.array([0.25, 0.0, 0.1]))
    assert np.allclose(session._signals(0.05).cup, there)


def test_without_a_camera_pictures_are_refused_and_containers_unknown(pictures):
    session = TrackingSession(workspace(), palette())
    assert session.on_task(task(1)) is None
    with pytest.raises(ValueError, match="no camera is known"):
        look(session, pictures)
    session.use_camera(camera())
    session.forget_camera()
    with pytest.raises(ValueError, match="no camera is known"):
        look(session, pictures)


def test_a_task_without_containers_is_refused_and_the_scenario_stays(session):
    session.on_task(task(1))
    with pytest.raises(ValueError, match="scenario 'cooking' has no containers"):
        session.on_task(task(2, "cooking"))
    assert session.tracking.workspace.scenario == "sorting"


def test_readings_that_make_no_sense_are_refused(session):
    readings = LoadCellReadings(Header(stamp=genpy.Time(1)), 0.1, bytes([1, 2]), [5, 6, 7])
    with pytest.raises(ValueError, match="3 counts are not whole readings of 2 trays"):
        session.on_load_cells(readings)
