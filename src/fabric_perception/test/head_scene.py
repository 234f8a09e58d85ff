# SPDX-License-Identifier: BSD-3-Clause
"""A head before a camera, as the tests of the head tracker know it."""

import math
from pathlib import Path

import numpy as np

from fabric_perception.camera import Camera
from fabric_perception.head.helmet import load_helmet, rotation

CONFIG = Path(__file__).resolve().parents[1] / "config"
HELMET = load_helmet(CONFIG / "helmet.yaml")
HEAD = np.array((0.75, 0.035, 0.52))  # m in cell
FOCAL = 900.0  # pixels: the markers of HELMET are about 85 pixels wide


def camera(focal: float = FOCAL, position=(0.05, 0.035, 0.75)) -> Camera:
    """Looks from behind the belt at the head, level, x of the picture to the cell's left."""
    ahead = HEAD - np.array(position)
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([right, np.cross(ahead, right), ahead])
    pose[:3, 3] = position
    K = np.array([[focal, 0.0, 319.5], [0.0, focal, 239.5], [0.0, 0.0, 1.0]])
    return Camera(K, 640, 480, pose)


def head(turned: float, down: float = 0.3, roll: float = 0.0, at=HEAD) -> np.ndarray:
    """(4, 4) of a helmet that looks `turned` to its left and `down` from the level, rad."""
    pose = np.eye(4)
    pose[:3, :3] = rotation(math.pi + turned, down, roll)
    pose[:3, 3] = at
    return pose


def degrees_apart(a: float, b: float) -> float:
    """Between two angles in rad, the short way round."""
    return abs(math.degrees((a - b + math.pi) % (2.0 * math.pi) - math.pi))
