# SPDX-License-Identifier: BSD-3-Clause
"""Closed-form kinematics of the Magician, both ways.

The parallelogram keeps the tool level and makes j2 and j3 absolute angles: j2 tilts the rear arm
from the vertical (forwards positive), j3 the forearm from the horizontal (downwards positive).
Metres and radians in arm_base_link, whose origin is where the motor axes cross.
"""

import math
from typing import NamedTuple


class Links(NamedTuple):
    """Link lengths in m."""

    rear_arm: float = 0.135  # L1
    forearm: float = 0.147  # L2
    tool_x: float = 0.0597
    tool_y: float = 0.0
    tool_z: float = 0.0


class Joints(NamedTuple):
    """Joint angles in rad, as the arm reports them."""

    j1: float
    j2: float
    j3: float
    j4: float


class ToolPose(NamedTuple):
    """Tool centre point in arm_base_link: m, and the tool's yaw in rad."""

    x: float
    y: float
    z: float
    yaw: float


MAGICIAN = Links()
ROUNDING = 1e-12  # an arm stretched or folded right up to the end is still within reach


def forward(joints: Joints, links: Links = MAGICIAN) -> ToolPose:
    """Pose of the tool at these joint angles."""
    j1, j2, j3, j4 = joints
    out = links.rear_arm * math.sin(j2) + links.forearm * math.cos(j3) + links.tool_x
    up = links.rear_arm * math.cos(j2) - links.forearm * math.sin(j3) - links.tool_z
    x = out * math.cos(j1) - links.tool_y * math.sin(j1)
    y = out * math.sin(j1) + links.tool_y * math.cos(j1)
    return ToolPose(x, y, up, wrap(j1 + j4))


def inverse(pose: ToolPose, links: Links = MAGICIAN) -> Joints | None:
    """Joint angles that bring the tool to the pose, elbow up; None beyond the arm's reach.

    Limits are not looked at here: see fabric_dobot_driver.limits.
    """
    radius2 = pose.x**2 + pose.y**2 - links.tool_y**2
    if radius2 < 0.0:
        return None
    out = math.sqrt(radius2)
    j1 = math.atan2(pose.y, pose.x) - math.atan2(links.tool_y, out)
    h = out - links.tool_x
    v = pose.z + links.tool_z
    d2 = h * h + v * v
    if d2 == 0.0:
        return None
    cosine = (links.rear_arm**2 + d2 - links.forearm**2) / (2.0 * links.rear_arm * math.sqrt(d2))
    if abs(cosine) > 1.0 + ROUNDING:
        return None
    inner = math.acos(max(-1.0, min(1.0, cosine)))
    j2 = math.pi / 2 - (math.atan2(v, h) + inner)
    j3 = math.atan2(links.rear_arm * math.cos(j2) - v, h - links.rear_arm * math.sin(j2))
    return Joints(wrap(j1), wrap(j2), j3, wrap(pose.yaw - j1))


def wrap(angle: float) -> float:
    """The same angle in [-pi, pi]."""
    return math.remainder(angle, 2.0 * math.pi)
