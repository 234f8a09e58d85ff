# SPDX-License-Identifier: BSD-3-Clause
"""Where the person's parts are, from where hand, shoulder and head are."""

from __future__ import annotations

import numpy as np

from fabric_sim.camera.person_shape import FOREARM, UPPER_ARM, WRIST
from fabric_sim.camera.place import elbow, pointing, quaternion_of, turn
from fabric_sim.camera.scene import Scene
from fabric_sim.geometry import CellGeometry

DOWN, UP = np.array([0.0, 0.0, -1.0]), np.array([0.0, 0.0, 1.0])
RAISED = 0.5  # of `stop`, from which on the hand is open
Posture = dict[str, tuple[np.ndarray | None, np.ndarray]]


def posture_of(scene: Scene, geometry: CellGeometry) -> Posture:
    """Place (3,) m, or None for a part that is not shown, and quaternion w x y z by part."""
    hand, shoulder = np.array(scene.hand), np.array(scene.shoulder)
    R = _hand_turn(hand, shoulder, scene.stop)
    wrist = hand - WRIST * R[:, 2]
    bend = elbow(shoulder, wrist, UPPER_ARM, FOREARM)
    is_open = scene.stop >= RAISED
    own = quaternion_of(R)
    return {
        "trunk": _trunk(scene, geometry),
        "head": _head(scene, geometry),
        "upper_arm": _between(shoulder, bend),
        "forearm": _between(bend, wrist),
        "hand": (None if is_open else hand, own),
        "open_hand": (hand if is_open else None, own),
    }


def _hand_turn(hand: np.ndarray, shoulder: np.ndarray, stop: float) -> np.ndarray:
    """Rotation (3, 3) of the glove: along the arm and down on the work, or up against the robot."""
    along = hand - shoulder
    along = along / max(1e-9, float(np.linalg.norm(along)))
    level = np.array([along[0], along[1], 0.0])
    level = level / max(1e-9, float(np.linalg.norm(level)))
    at_work = 0.65 * level + 0.45 * along + 0.20 * DOWN
    fingers = (1.0 - stop) * at_work + stop * (UP + 0.15 * level)
    palm = (1.0 - stop) * DOWN + stop * level
    return pointing(fingers, palm)


def _between(start: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return (start + end) / 2.0, quaternion_of(pointing(end - start, UP + (0.01, 0.0, 0.0)))


def _trunk(scene: Scene, geometry: CellGeometry) -> tuple[np.ndarray, np.ndarray]:
    """The trunk goes with the shoulder."""
    frame = geometry.person
    usual = np.array(frame.to_cell(geometry.body.shoulder))
    middle = np.array(frame[:3]) + np.array(scene.shoulder) - usual
    return middle, quaternion_of(turn("z", frame.yaw))


def _head(scene: Scene, geometry: CellGeometry) -> tuple[np.ndarray, np.ndarray]:
    R = turn("z", geometry.person.yaw + scene.yaw) @ turn("y", scene.pitch)
    return np.array(scene.head), quaternion_of(R)
