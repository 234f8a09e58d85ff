# SPDX-License-Identifier: BSD-3-Clause
"""The URDF says what cell.yaml and magician.yaml say, and moves as the arm's kinematics do."""

from __future__ import annotations

import functools
import math
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
import yaml

from fabric_bringup import description
from fabric_dobot_driver import kinematics

LAUNCH = Path(__file__).resolve().parents[1]
URDF = LAUNCH / "urdf/cell.urdf"
SOURCES = (LAUNCH / "config/cell.yaml", LAUNCH / "../src/fabric_dobot_driver/config/magician.yaml")


def rotation(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rodrigues' formula, (3, 3)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


def tcp(angles: dict[str, float]) -> np.ndarray:
    """Position of arm_tcp in arm_base_link, following the URDF's joints, (3,) m."""
    joints = {joint.find("child").get("link"): joint for joint in tree().findall("joint")}
    at, name = np.zeros(3), "arm_tcp"
    while name != "arm_base_link":
        joint = joints[name]
        origin = np.array(joint.find("origin").get("xyz").split(), dtype=float)
        if joint.find("axis") is not None:
            axis = np.array(joint.find("axis").get("xyz").split(), dtype=float)
            mimic = joint.find("mimic")
            angle = angles[joint.get("name")] if mimic is None else -angles[mimic.get("joint")]
            at = rotation(axis, angle) @ at
        at = at + origin
        name = joint.find("parent").get("link")
    return at


@functools.cache
def tree() -> ElementTree.Element:
    return ElementTree.parse(URDF).getroot()


def test_the_urdf_is_the_one_that_its_sources_give():
    cell, magician = (yaml.safe_load(path.read_text()) for path in SOURCES)
    assert URDF.read_text() == description.urdf(cell, magician)


def test_the_urdf_is_one_tree_rooted_in_world():
    children = [joint.find("child").get("link") for joint in tree().findall("joint")]
    links = [link.get("name") for link in tree().findall("link")]
    assert sorted(children) == sorted(set(links) - {"world"})


@pytest.mark.parametrize(
    "joints", [(0, 0.785, 0.785, 0), (1.1, 0.3, 0.2, -0.4), (-1.2, 1.0, -0.1, 0.7)]
)
def test_the_urdf_moves_as_the_kinematics_do(joints):
    pose = kinematics.forward(kinematics.Joints(*joints))
    at = tcp(dict(zip(("j1", "j2", "j3", "j4"), joints, strict=True)))
    assert at == pytest.approx((pose.x, pose.y, pose.z), abs=1e-5)


def test_a_thousand_random_poses_of_urdf_and_kinematics_agree():
    """Within 0.01 mm: the URDF has six decimals."""
    limits = yaml.safe_load(SOURCES[1].read_text())["joints"]
    low, high = np.radians([limits[name] for name in kinematics.Joints._fields]).T
    for row in np.random.default_rng(101).uniform(low, high, (1000, 4)):
        joints = kinematics.Joints(*row)
        assert tcp(joints._asdict()) == pytest.approx(kinematics.forward(joints)[:3], abs=1e-5)


def test_the_arm_names_its_joints_as_the_urdf_does():
    moved = [j for j in tree().findall("joint") if j.get("type") == "revolute"]
    own = [joint.get("name") for joint in moved if joint.find("mimic") is None]
    assert tuple(own) == kinematics.Joints._fields
