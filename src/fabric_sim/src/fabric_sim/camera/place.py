# SPDX-License-Identifier: BSD-3-Clause
"""Poses as (4, 4) matrices, turns about axes, and a pinhole camera's place."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike


def turn(axis: str, angle: float) -> np.ndarray:
    """Rotation (3, 3) about x, y or z by rad."""
    c, s = math.cos(angle), math.sin(angle)
    i = "xyz".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    R = np.eye(3)
    R[j, j], R[j, k], R[k, j], R[k, k] = c, -s, s, c
    return R


def rotation_of(quaternion: Sequence[float]) -> np.ndarray:
    """Rotation (3, 3) of a quaternion x, y, z, w of any length but 0."""
    x, y, z, w = np.asarray(quaternion, dtype=float) / np.linalg.norm(quaternion)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def quaternion_of(R: np.ndarray) -> np.ndarray:
    """Quaternion w, x, y, z as MuJoCo wants it, (4,), of a rotation (3, 3)."""
    products = np.array([  # four times every product of two components
        [R[0, 0] + R[1, 1] + R[2, 2], R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]],
        [R[2, 1] - R[1, 2], R[0, 0] - R[1, 1] - R[2, 2], R[1, 0] + R[0, 1], R[0, 2] + R[2, 0]],
        [R[0, 2] - R[2, 0], R[1, 0] + R[0, 1], R[1, 1] - R[0, 0] - R[2, 2], R[2, 1] + R[1, 2]],
        [R[1, 0] - R[0, 1], R[0, 2] + R[2, 0], R[2, 1] + R[1, 2], R[2, 2] - R[0, 0] - R[1, 1]],
    ]) + np.eye(4)  # fmt: skip
    row = products[int(np.argmax(np.diag(products)))]  # of the largest, safe to divide by
    return row / np.linalg.norm(row)


def pointing(along: ArrayLike, up: ArrayLike) -> np.ndarray:
    """Rotation (3, 3) whose z is `along`, with x as near to `up` as possible; neither is 0."""
    z = np.asarray(along, dtype=float) / np.linalg.norm(along)
    x = np.asarray(up, dtype=float) - np.dot(up, z) * z
    if np.linalg.norm(x) < 1e-9:
        x = np.roll(z, 1) - np.dot(np.roll(z, 1), z) * z
    x = x / np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def elbow(shoulder: np.ndarray, wrist: np.ndarray, upper: float, lower: float) -> np.ndarray:
    """Where the elbow of an arm of two lengths (m) is: hanging down between (3,) and (3,), m.

    An arm that is too short is stretched evenly.
    """
    way = wrist - shoulder
    far = max(1e-6, float(np.linalg.norm(way)))
    if far >= upper + lower:
        return shoulder + way * upper / (upper + lower)
    along = (upper**2 - lower**2 + far**2) / (2.0 * far)
    aside = math.sqrt(max(0.0, upper**2 - along**2))
    down = pointing(way, (0.0, 0.0, -1.0))[:, 0]
    return shoulder + along * way / far + aside * down
