# SPDX-License-Identifier: BSD-3-Clause
"""Kinematics: hand-worked poses and the round trip over the whole joint range."""

import math
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabric_dobot_driver import Joints, Links, ToolPose, forward, inverse

HOME = Joints(0.0, math.radians(45), math.radians(45), 0.0)


def angles(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(math.radians(low), math.radians(high))


def test_home_is_where_real_arms_report_it():
    pose = forward(HOME)
    assert pose.x == pytest.approx(0.25910, abs=1e-5)
    assert pose.y == 0.0
    assert pose.z == pytest.approx(-0.00849, abs=1e-5)


def test_arm_stretched_forwards_and_turned_left():
    pose = forward(Joints(math.pi / 2, math.pi / 2, 0.0, -math.pi / 2))
    assert pose == pytest.approx((0.0, 0.135 + 0.147 + 0.0597, 0.0, 0.0), abs=1e-12)


@given(angles(-125, 125), angles(-5, 85), angles(-15, 90), angles(-145, 145))
def test_position_round_trip_is_exact(j1, j2, j3, j4):
    pose = forward(Joints(j1, j2, j3, j4))
    joints = inverse(pose)
    assert joints is not None
    back = forward(joints)
    assert math.dist(back[:3], pose[:3]) < 1e-9
    assert math.remainder(back.yaw - pose.yaw, math.tau) == pytest.approx(0.0, abs=1e-9)


def test_hundred_thousand_poses_come_back_within_a_hundredth_of_a_millimetre():
    dice = random.Random(7)
    worst = 0.0
    for _ in range(100_000):
        j1 = dice.uniform(-2.18, 2.18)
        j2 = dice.uniform(0.0, 1.48)
        j3 = dice.uniform(-0.26, 1.57)
        if not 0.63 < math.pi / 2 + j2 - j3 < 2.70:
            continue
        want = Joints(j1, j2, j3, dice.uniform(-2.5, 2.5))
        pose = forward(want)
        joints = inverse(pose)
        assert joints is not None
        worst = max(worst, math.dist(forward(joints)[:3], pose[:3]))
    assert worst < 1e-5


@given(angles(-120, 120), angles(0, 85), angles(-15, 90))
def test_joints_come_back_where_the_elbow_is_up_and_the_wrist_in_front(j1, j2, j3):
    elbow = math.pi / 2 + j2 - j3
    wrist = 0.135 * math.sin(j2) + 0.147 * math.cos(j3)
    if not 0.1 < elbow < math.pi - 0.1 or wrist < 0.01:
        return
    joints = inverse(forward(Joints(j1, j2, j3, 0.0)))
    assert joints == pytest.approx((j1, j2, j3, 0.0), abs=1e-6)


@given(angles(-80, 80), angles(10, 80), angles(0, 60))
def test_an_offset_tool_round_trips_too(j1, j2, j3):
    links = Links(tool_x=0.061, tool_y=0.012, tool_z=0.02)
    pose = forward(Joints(j1, j2, j3, 0.3), links)
    joints = inverse(pose, links)
    assert joints is not None
    assert math.dist(forward(joints, links)[:3], pose[:3]) < 1e-9


@pytest.mark.parametrize(
    "pose",
    [
        ToolPose(0.40, 0.0, 0.0, 0.0),
        ToolPose(0.20, 0.0, 0.40, 0.0),
        ToolPose(0.0597, 0.0, 0.0, 0.0),
        ToolPose(0.062, 0.0, 0.001, 0.0),
    ],
)
def test_no_solution_beyond_reach_or_folded_too_far(pose):
    assert inverse(pose) is None


def test_a_tool_offset_wider_than_the_radius_has_no_solution():
    assert inverse(ToolPose(0.01, 0.0, 0.0, 0.0), Links(tool_y=0.05)) is None
