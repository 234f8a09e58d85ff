# SPDX-License-Identifier: BSD-3-Clause
"""The wire speaks millimetres and degrees; everything above this module speaks SI and radians."""

import math

from fabric_dobot_driver.kinematics import Joints, ToolPose


def pose_to_wire(pose: ToolPose) -> tuple[float, float, float, float]:
    """(x, y, z, r) in mm and degrees."""
    return 1e3 * pose.x, 1e3 * pose.y, 1e3 * pose.z, math.degrees(pose.yaw)


def pose_from_wire(x: float, y: float, z: float, r: float) -> ToolPose:
    """Pose from millimetres and degrees."""
    return ToolPose(1e-3 * x, 1e-3 * y, 1e-3 * z, math.radians(r))


def joints_to_wire(joints: Joints) -> tuple[float, float, float, float]:
    """(j1, j2, j3, j4) in degrees."""
    return tuple(math.degrees(angle) for angle in joints)


def joints_from_wire(j1: float, j2: float, j3: float, j4: float) -> Joints:
    """Joint angles from degrees."""
    return Joints(*(math.radians(angle) for angle in (j1, j2, j3, j4)))


def belt_to_wire(speed: float, pulses_per_mm: float) -> int:
    """Pulses a second of the extension stepper for a belt speed in m/s; the wire wants an integer.

    Raises ValueError when speed or calibration is not finite or the calibration not positive.
    """
    if not math.isfinite(speed):
        raise ValueError(f"belt speed is {speed}, want a finite number of m/s")
    if not math.isfinite(pulses_per_mm) or pulses_per_mm <= 0.0:
        raise ValueError(f"pulses_per_mm is {pulses_per_mm}, want a positive number")
    return round(1e3 * speed * pulses_per_mm)


def belt_from_wire(pulses: int, pulses_per_mm: float) -> float:
    """Belt speed in m/s from pulses a second."""
    return pulses / pulses_per_mm / 1e3
