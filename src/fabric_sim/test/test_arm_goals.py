# SPDX-License-Identifier: BSD-3-Clause
"""Which goals of arm/move the simulated arm takes."""

import math
from pathlib import Path

import pytest

from fabric_dobot_driver import Goal, Joints, forward, load_limits
from fabric_msgs.msg import MoveArmGoal, MoveArmResult
from fabric_sim.arm import ArmResult
from fabric_sim.arm_goals import taken

CONFIG = Path(__file__).resolve().parents[2] / "fabric_dobot_driver" / "config"
LIMITS = load_limits(CONFIG / "magician.yaml")
ANGLES = (0.3, 0.5, 0.6, -0.2)


def test_joint_angles_bring_the_tool_where_they_do_on_the_dobot():
    goal = taken(MoveArmGoal(number=3, speed=0.1, joints=ANGLES), LIMITS, {1, 2})
    assert isinstance(goal, Goal)
    assert math.dist(goal.pose, forward(Joints(*ANGLES), LIMITS.links)) < 1e-6


@pytest.mark.parametrize(
    ("number", "joints", "outcome", "words"),
    [
        (0, (), MoveArmResult.INVALID, "goal number 0 is not allowed"),
        (2, (), MoveArmResult.INVALID, "goal number 2 is in use"),
        (3, (0.1,), MoveArmResult.INVALID, "1 joint angles, want 4"),
        (3, (3.0, 0.5, 0.6, 0.0), MoveArmResult.UNREACHABLE, "j1 at 171.9 deg"),
    ],
)
def test_what_is_refused_ends_with_a_reason(number, joints, outcome, words):
    end = taken(MoveArmGoal(number=number, speed=0.1, joints=joints), LIMITS, {1, 2})
    assert isinstance(end, ArmResult)
    assert (end.number, end.outcome) == (number, outcome)
    assert words in end.reason
