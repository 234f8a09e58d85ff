# SPDX-License-Identifier: BSD-3-Clause
"""What a client of `arm/move` asks for: a pose of the tool, or the joint angles of one."""

import math
from collections.abc import Sequence
from typing import Any

from fabric_dobot_driver.kinematics import Joints, ToolPose, forward
from fabric_dobot_driver.limits import Fault, Goal, Limits, Refusal, exceeded_joint


def asked(message: Any, limits: Limits) -> Goal | Refusal:
    """The goal of a MoveArmGoal, still to be checked, or why its joint angles are none.

    Angles stand for the pose of the tool at them; the way there is a straight line all the same.
    """
    pose = pose_at(message.joints, limits) if message.joints else _pose_of(message.pose)
    if isinstance(pose, Refusal):
        return pose
    return Goal(pose, message.speed, message.settle)


def pose_at(joints: Sequence[float], limits: Limits) -> ToolPose | Refusal:
    """Where the tool is at j1..j4 (rad), or what is wrong with them."""
    if len(joints) != len(Joints._fields):
        return Refusal(Fault.INVALID, f"{len(joints)} joint angles, want {len(Joints._fields)}")
    for name, angle in zip(Joints._fields, joints, strict=True):
        if not math.isfinite(angle):
            return Refusal(Fault.INVALID, f"{name} is {angle}, want a finite number")
    angles = Joints(*joints)
    exceeded = exceeded_joint(angles, limits)
    return Refusal(Fault.UNREACHABLE, exceeded) if exceeded else forward(angles, limits.links)


def _pose_of(pose: Any) -> ToolPose:
    p, q = pose.position, pose.orientation
    yaw = math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))
    return ToolPose(p.x, p.y, p.z, yaw)
