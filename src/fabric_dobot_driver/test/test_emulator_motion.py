# SPDX-License-Identifier: BSD-3-Clause
"""The emulated arm moves in time as its parameters say, along the ways of the PTP modes."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from virtual_arm import VirtualArm

from fabric_dobot_driver.emulator import commands
from fabric_dobot_driver.emulator.arc import arc_through
from fabric_dobot_driver.emulator.motion import Trapezoid
from fabric_dobot_driver.emulator.planning import (
    JUMP_ANGLE,
    JUMP_MOVL_XYZ,
    JUMP_XYZ,
    MOVJ_ANGLE,
    MOVJ_INC,
    MOVJ_XYZ,
    MOVJ_XYZ_INC,
    MOVL_ANGLE,
    MOVL_INC,
    MOVL_XYZ,
)

START = (200.0, 0.0, 30.0, 0.0)
positive = st.floats(0.01, 100.0)


@pytest.fixture
def arm() -> VirtualArm:
    """Stands at START, with 100 % of 200 mm/s and 200 deg/s."""
    arm = VirtualArm()
    arm.put(commands.PTP_RATIO, 100.0, 100.0)
    arm.ptp(MOVJ_XYZ, *START)
    arm.run(10.0)
    assert arm.is_at(*START)
    return arm


def track(arm: VirtualArm, step: float = 0.01) -> np.ndarray:
    """(n, 8) x, y, z, r, j1..j4 of the motion under way until it ends, at equal steps of time."""
    rows = []
    while arm.controller.arm.moving:
        rows.append((*arm.pose, *arm.joints))
        arm.run(step)
    rows.append((*arm.pose, *arm.joints))
    return np.array(rows)


@given(positive, positive)
def test_trapezoids_begin_and_end_at_rest_and_keep_their_limits(speed, acceleration):
    profile = Trapezoid.over((1.0,), (speed,), (acceleration,))
    times = np.linspace(0.0, profile.duration, 501)
    places = np.array([profile.at(t) for t in times])
    step = times[1]
    speeds = np.diff(places) / step
    assert places[0] == 0.0 and places[-1] == 1.0
    assert np.all(speeds >= -1e-9) and speeds.max() <= speed * (1.0 + 1e-6)
    assert np.abs(np.diff(speeds)).max() / step <= acceleration * (1.0 + 1e-6)
    for s in (0.1, 0.5, 0.8):
        assert profile.at(profile.time_at(s)) == pytest.approx(s)


def test_a_trapezoid_takes_as_long_as_worked_out_by_hand():
    """300 mm at 200 mm/s and 200 mm/s^2: 1 s up over 100 mm, 0.5 s level, 1 s down."""
    assert Trapezoid.over((300.0,), (200.0,), (200.0,)).duration == pytest.approx(2.5)
    assert Trapezoid.over((50.0,), (200.0,), (200.0,)).duration == pytest.approx(1.0)
    assert Trapezoid.over((0.0,), (200.0,), (200.0,)).duration == 0.0


@pytest.mark.parametrize(
    ("mode", "values", "goal"),
    [
        (JUMP_XYZ, (220.0, 80.0, 10.0, 20.0), (220.0, 80.0, 10.0, 20.0)),
        (MOVJ_XYZ, (220.0, 80.0, 10.0, 20.0), (220.0, 80.0, 10.0, 20.0)),
        (MOVL_XYZ, (220.0, 80.0, 10.0, 20.0), (220.0, 80.0, 10.0, 20.0)),
        (MOVL_INC, (20.0, 80.0, -20.0, 20.0), (220.0, 80.0, 10.0, 20.0)),
        (MOVJ_XYZ_INC, (20.0, 80.0, -20.0, 20.0), (220.0, 80.0, 10.0, 20.0)),
        (JUMP_MOVL_XYZ, (220.0, 80.0, 10.0, 20.0), (220.0, 80.0, 10.0, 20.0)),
    ],
)
def test_every_cartesian_mode_ends_at_its_goal(arm, mode, values, goal):
    index = arm.ptp(mode, *values)
    arm.run(10.0)
    assert arm.is_at(*goal)
    assert arm.index == index


@pytest.mark.parametrize("mode", [JUMP_ANGLE, MOVJ_ANGLE, MOVL_ANGLE])
def test_every_angle_mode_ends_at_its_angles(arm, mode):
    arm.ptp(mode, 20.0, 30.0, 40.0, -10.0)
    arm.run(10.0)
    assert arm.joints == pytest.approx((20.0, 30.0, 40.0, -10.0), abs=1e-4)


def test_joint_increments_add_up(arm):
    before = arm.joints
    for _ in range(3):
        arm.ptp(MOVJ_INC, 5.0, 2.0, -3.0, 4.0)
    arm.run(10.0)
    wanted = tuple(a + 3.0 * b for a, b in zip(before, (5.0, 2.0, -3.0, 4.0), strict=True))
    assert arm.joints == pytest.approx(wanted, abs=1e-4)


def test_lines_are_straight_and_as_fast_as_set(arm):
    arm.put(commands.PTP_COORDINATE, 100.0, 100.0, 400.0, 400.0)
    arm.ptp(MOVL_XYZ, 200.0, 150.0, 60.0, 0.0)
    rows = track(arm)[:, :3]
    start, end = rows[0], np.array([200.0, 150.0, 60.0])
    along = (end - start) / np.linalg.norm(end - start)
    off = (rows - start) - np.outer((rows - start) @ along, along)
    speeds = np.linalg.norm(np.diff(rows, axis=0), axis=1) / 0.01
    assert np.abs(off).max() < 1e-3
    assert speeds.max() == pytest.approx(100.0, rel=1e-3)


def test_joint_moves_start_and_arrive_together_and_keep_each_axis_limit(arm):
    arm.put(commands.PTP_JOINT, 50.0, 10.0, 80.0, 200.0, *[300.0] * 4)
    start = np.array(arm.joints)
    arm.ptp(MOVJ_ANGLE, 40.0, 35.0, 50.0, -40.0)
    rows = track(arm)[:, 4:]
    shares = (rows - start) / (np.array([40.0, 35.0, 50.0, -40.0]) - start)
    assert np.ptp(shares, axis=1).max() < 1e-4
    speeds = np.abs(np.diff(rows, axis=0)).max(axis=0) / 0.01
    assert np.all(speeds <= np.array([50.0, 10.0, 80.0, 200.0]) + 0.1)
    assert speeds[1] == pytest.approx(10.0, rel=1e-2)


def test_a_jump_rises_by_its_height_travels_level_and_comes_down(arm):
    arm.put(commands.PTP_JUMP, 25.0, 150.0)
    arm.ptp(JUMP_MOVL_XYZ, 220.0, 80.0, 10.0, 0.0)
    rows = track(arm)[:, :3]
    assert rows[:, 2].max() == pytest.approx(55.0, abs=1e-3)
    sideways = np.hypot(rows[:, 0] - 200.0, rows[:, 1])
    travelling = (sideways > 0.01) & (sideways < math.hypot(20.0, 80.0) - 0.01)
    assert rows[travelling, 2] == pytest.approx(55.0, abs=1e-3)


def test_a_jump_rises_no_higher_than_its_limit(arm):
    arm.put(commands.PTP_JUMP, 50.0, 60.0)
    arm.ptp(JUMP_MOVL_XYZ, 220.0, 40.0, 20.0, 0.0)
    assert track(arm)[:, 2].max() == pytest.approx(60.0, abs=1e-3)


def test_half_the_ratio_takes_longer_by_the_worked_out_time(arm):
    """100 mm: at 200 mm/s and mm/s^2 peak 141 mm/s, 1.414 s; at half both 2 s."""
    durations = []
    for ratio, goal in ((100.0, 100.0), (50.0, 0.0)):
        arm.put(commands.PTP_RATIO, ratio, ratio)
        arm.ptp(MOVL_XYZ, 200.0, goal, 30.0, 0.0)
        durations.append(next(m["duration"] for e, m in reversed(arm.events) if e == "moves"))
        arm.run(5.0)
    assert durations == pytest.approx([math.sqrt(2.0), 2.0], rel=1e-3)


def test_an_arc_passes_its_middle_point(arm):
    arm.put(commands.ARC, 225.0, 25.0, 30.0, 0.0, 250.0, 0.0, 30.0, 0.0)
    rows = track(arm)[:, :3]
    assert np.hypot(rows[:, 0] - 225.0, rows[:, 1]) == pytest.approx(25.0, abs=1e-2)
    assert np.linalg.norm(rows - [225.0, 25.0, 30.0], axis=1).min() < 1.0
    assert arm.is_at(250.0, 0.0, 30.0)


@given(st.integers(0, 2**32 - 1))
def test_arcs_through_any_points_are_circles_over_the_middle_one(seed):
    points = np.random.default_rng(seed).uniform(-100.0, 100.0, (3, 3))
    pose, length, turn = arc_through((*points[0], 10.0), (*points[1], 0.0), (*points[2], 40.0))
    rows = np.array([pose(s) for s in np.linspace(0.0, 1.0, 2001)])
    assert rows[0] == pytest.approx([*points[0], 10.0])
    assert rows[-1] == pytest.approx([*points[2], 40.0], abs=1e-6 * length)
    steps = np.linalg.norm(np.diff(rows[:, :3], axis=0), axis=1)
    assert steps == pytest.approx(length / 2000, rel=1e-3)
    assert np.linalg.norm(rows[:, :3] - points[1], axis=1).min() <= length / 2000
    assert turn == 30.0


def test_three_points_on_a_line_make_no_arc():
    assert arc_through((0.0, 0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), (2.0, 0.0, 0.0, 0.0)) is None
    assert arc_through((0.0, 0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)) is None


def test_continuous_segments_are_absolute_or_relative(arm):
    arm.put(commands.CP, 1, 210.0, 20.0, 40.0, 80.0)
    arm.put(commands.CP, 0, 5.0, -10.0, 0.0, 80.0)
    arm.run(10.0)
    assert arm.is_at(215.0, 10.0, 40.0)


def test_the_rail_and_the_arm_arrive_before_the_command_is_done(arm):
    index = arm.put(commands.PTP_RAIL, MOVL_XYZ, 210.0, 0.0, 30.0, 0.0, 600.0)
    arm.run(9.0)
    assert arm.is_at(210.0, 0.0, 30.0)
    assert arm.index == index - 1
    arm.run(3.0)
    assert arm.index == index
    assert arm.ask(commands.RAIL_POSE, 0) == np.float32(600.0).tobytes()


def test_a_tool_offset_shifts_the_pose_and_not_the_joints(arm):
    joints = arm.joints
    arm.put(commands.TOOL, 69.7, 0.0, 5.0, control=1)
    assert arm.is_at(210.0, 0.0, 25.0)
    assert arm.joints == joints


def test_a_turn_faster_than_the_servo_is_cut_short_by_overspeed(arm):
    arm.ptp(MOVL_XYZ, 200.0, 0.0, 30.0, -120.0)
    arm.run(5.0)
    arm.put(commands.PTP_COORDINATE, 200.0, 600.0, 200.0, 2000.0)
    arm.ptp(MOVL_XYZ, 200.0, 0.0, 30.0, 120.0)
    arm.run(5.0)
    assert arm.alarms == {0x33}
    assert -120.0 < arm.pose[3] < 120.0
