# SPDX-License-Identifier: BSD-3-Clause
"""The Dobot Magician without ROS: kinematics, limits and the units of its wire."""

from fabric_dobot_driver.kinematics import Joints, Links, ToolPose, forward, inverse
from fabric_dobot_driver.limits import Goal, Limits, Refusal, check_goal, load_limits

__all__ = [
    "Goal",
    "Joints",
    "Limits",
    "Links",
    "Refusal",
    "ToolPose",
    "check_goal",
    "forward",
    "inverse",
    "load_limits",
]
