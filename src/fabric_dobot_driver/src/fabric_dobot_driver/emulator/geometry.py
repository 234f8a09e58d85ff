# SPDX-License-Identifier: BSD-3-Clause
"""Kinematics and joint limits in the units of the wire: mm and degrees."""

import math
from typing import NamedTuple

from fabric_dobot_driver.emulator.alarms import Alarm
from fabric_dobot_driver.kinematics import Links, forward, inverse
from fabric_dobot_driver.limits import Limits
from fabric_dobot_driver.units import (
    joints_from_wire,
    joints_to_wire,
    pose_from_wire,
    pose_to_wire,
)

Values = tuple[float, ...]  # four joint angles in deg, or x, y, z in mm and r in deg


class Geometry(NamedTuple):
    """One arm with its tool."""

    links: Links
    low: Values  # deg: four joints and the parallelogram, 90 + j2 - j3
    high: Values

    @classmethod
    def of(cls, limits: Limits) -> "Geometry":
        """The arm that these limits describe."""
        spans = (*limits.joints, limits.elbow)
        low = tuple(math.degrees(span.low) for span in spans)
        return cls(limits.links, low, tuple(math.degrees(span.high) for span in spans))

    def with_tool(self, x: float, y: float, z: float) -> "Geometry":
        """The same arm with its tool centre point at this offset in mm."""
        return self._replace(
            links=self.links._replace(tool_x=1e-3 * x, tool_y=1e-3 * y, tool_z=1e-3 * z)
        )

    def pose(self, joints: Values) -> Values:
        """x, y, z, r at these joint angles."""
        return pose_to_wire(forward(joints_from_wire(*joints), self.links))

    def joints(self, pose: Values) -> Values | None:
        """Joint angles for x, y, z, r; None beyond reach."""
        joints = inverse(pose_from_wire(*pose), self.links)
        return None if joints is None else joints_to_wire(joints)

    def exceeded(self, joints: Values) -> Alarm | int | None:
        """The limit that these joint angles are beyond, as the alarm of the axis."""
        angles = (*joints, 90.0 + joints[1] - joints[2])
        for axis, (low, angle, high) in enumerate(zip(self.low, angles, self.high, strict=True)):
            if angle > high + 1e-6:
                return Alarm.JOINT_LIMIT + 2 * axis
            if angle < low - 1e-6:
                return Alarm.JOINT_LIMIT + 2 * axis + 1
        return None

    def fault(self, joints: Values | None) -> Alarm | None:
        """Alarm of a plan that would end at these joint angles."""
        if joints is None:
            return Alarm.INVERSE_KINEMATICS
        return None if self.exceeded(joints) is None else Alarm.OUT_OF_LIMIT
