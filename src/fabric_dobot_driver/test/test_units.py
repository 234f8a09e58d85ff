# SPDX-License-Identifier: BSD-3-Clause
"""Units at the wire."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabric_dobot_driver import Joints, ToolPose, units

METRES = st.floats(-1.0, 1.0)
ANGLES = st.floats(-math.pi, math.pi)


def test_the_wire_has_millimetres_and_degrees():
    wire = units.pose_to_wire(ToolPose(0.2591, 0.0, -0.00849, math.pi / 2))
    assert wire == pytest.approx((259.1, 0.0, -8.49, 90.0))


@given(METRES, METRES, METRES, ANGLES)
def test_poses_survive_the_wire(x, y, z, yaw):
    pose = ToolPose(x, y, z, yaw)
    assert units.pose_from_wire(*units.pose_to_wire(pose)) == pytest.approx(pose)


@given(ANGLES, ANGLES, ANGLES, ANGLES)
def test_joints_survive_the_wire(j1, j2, j3, j4):
    joints = Joints(j1, j2, j3, j4)
    assert units.joints_from_wire(*units.joints_to_wire(joints)) == pytest.approx(joints)


def test_the_belt_counts_whole_pulses():
    pulses_per_mm = 32_000 / (36 * math.pi)
    assert units.belt_to_wire(0.05, pulses_per_mm) == 14_147
    assert units.belt_from_wire(14_147, pulses_per_mm) == pytest.approx(0.05, abs=1e-6)


@pytest.mark.parametrize(
    ("speed", "scale", "words"),
    [
        (math.nan, 280.0, "belt speed is nan"),
        (0.05, 0.0, "pulses_per_mm is 0.0"),
        (0.05, math.inf, "inf"),
    ],
)
def test_a_senseless_belt_command_is_refused(speed, scale, words):
    with pytest.raises(ValueError, match=words):
        units.belt_to_wire(speed, scale)
