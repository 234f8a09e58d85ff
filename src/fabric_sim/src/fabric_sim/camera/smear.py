# SPDX-License-Identifier: BSD-3-Clause
"""How far hand and head move in a picture while the shutter is open."""

from __future__ import annotations

import numpy as np

from fabric_sim.camera.lens import Smear
from fabric_sim.camera.parameters import Lens
from fabric_sim.camera.scene import Scene

LONGEST_GAP = 0.25  # s between two scenes from which on nothing is known of speeds
GLOVE, HELMET = 0.14, 0.30  # m, half the size of what is smeared
BRIM = 0.13  # m from the middle of the head to the markers


def hand_smear(lens: Lens, before: Scene | None, now: Scene, shutter: float) -> list[Smear]:
    """What the hand's movement does to a picture taken with this shutter (s)."""
    gap = _gap(before, now)
    if gap is None:
        return []
    velocity = (np.array(now.hand) - np.array(before.hand)) / gap
    return _smear(lens, np.array(now.hand), shutter * velocity, GLOVE)


def head_smear(lens: Lens, before: Scene | None, now: Scene, shutter: float) -> list[Smear]:
    """What turning and moving the head does to a picture taken with this shutter (s)."""
    gap = _gap(before, now)
    if gap is None:
        return []
    velocity = (np.array(now.head) - np.array(before.head)) / gap
    turning = np.array([0.0, -BRIM * (now.yaw - before.yaw) / gap, 0.0])  # of what faces the robot
    nodding = np.array([0.0, 0.0, -BRIM * (now.pitch - before.pitch) / gap])
    return _smear(lens, np.array(now.head), shutter * (velocity + turning + nodding), HELMET)


def _gap(before: Scene | None, now: Scene) -> float | None:
    """Time between two scenes, s, when it is short enough to tell speeds."""
    gap = now.t - before.t if before is not None else 0.0
    return gap if 0.0 < gap <= LONGEST_GAP else None


def _smear(lens: Lens, place: np.ndarray, way: np.ndarray, size: float) -> list[Smear]:
    R = lens.pose[:3, :3]
    at, moved = (place - lens.pose[:3, 3]) @ R, way @ R
    if at[2] < size:
        return []
    scale = lens.focal / at[2]
    middle = lens.K[:2, 2] + scale * at[:2]
    half = (scale * size, scale * size)
    return [Smear(tuple(middle), half, tuple(scale * moved[:2]))]
