# SPDX-License-Identifier: BSD-3-Clause
"""What a client asks for: a pose, or joint angles in its place."""

import math
from pathlib import Path

import pytest

from fabric_dobot_driver import Goal, Joints, Refusal, forward, load_limits
from fabric_dobot_driver.goals import asked
from fabric_dobot_driver.limits import Fault
from fabric_msgs.msg import MoveArmGoal

LIMITS = load_limits(Path(__file__).resolve().parents[1] / "config" / "magician.yaml")
ANGLES = (0.3, 0.5, 0.6, -0.2)


def message(**fields):
    goal = MoveArmGoal(number=1, speed=0.125, settle=0.5, **fields)
    goal.pose.position.x, goal.pose.position.y, goal.pose.position.z = 0.2, 0.05, 0.04
    goal.pose.orientation.z, goal.pose.orientation.w = math.sin(0.35), math.cos(0.35)
    return goal


def test_a_pose_is_taken_as_it_is():
    wanted = asked(message(), LIMITS)
    assert wanted.pose[:3] == (0.2, 0.05, 0.04)
    assert wanted.pose.yaw == pytest.approx(0.7)
    assert (wanted.speed, wanted.settle) == (0.125, 0.5)


def test_joint_angles_stand_for_the_pose_that_they_bring_the_tool_to():
    pose = forward(Joints(*ANGLES), LIMITS.links)
    assert asked(message(joints=ANGLES), LIMITS) == Goal(pose, 0.125, 0.5)


@pytest.mark.parametrize(
    ("joints", "fault", "words"),
    [
        ((0.1, 0.2, 0.3), Fault.INVALID, "3 joint angles, want 4"),
        ((0.1, math.nan, 0.3, 0.0), Fault.INVALID, "j2 is nan, want a finite number"),
        ((0.1, 0.2, math.inf, 0.0), Fault.INVALID, "j3 is inf, want a finite number"),
        ((3.0, 0.5, 0.6, 0.0), Fault.UNREACHABLE, "j1 at 171.9 deg"),
        ((0.0, 0.0, 1.4, 0.0), Fault.UNREACHABLE, "elbow at 9.8 deg"),
    ],
)
def test_angles_that_are_none_are_refused_by_name(joints, fault, words):
    refusal = asked(message(joints=joints), LIMITS)
    assert isinstance(refusal, Refusal)
    assert refusal.fault == fault
    assert words in refusal.reason
