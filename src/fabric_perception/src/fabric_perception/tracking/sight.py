# SPDX-License-Identifier: BSD-3-Clause
"""Whether a place is in view: a cube that is not seen is hidden, or gone."""

from collections.abc import Sequence
from enum import Enum

import numpy as np

from fabric_perception.camera import Camera

HALF = 3  # pixels around the middle of the cube's upper side
NEARER = 0.015  # m; something that much before a cube hides it
LEAST_SHARE = 0.3  # of the pixels must have a depth


class Sight(Enum):
    """What the depth picture shows at the place of a cube."""

    HIDDEN = "something is before it"
    EMPTY = "the ground behind it is seen"
    UNCLEAR = "no depth, something of its height, or out of the picture"


def look(
    camera: Camera, depth: np.ndarray, places: Sequence[np.ndarray], edge: float
) -> list[Sight]:
    """Say what is seen where cubes of `edge` m with their middles at places (3,) should be.

    depth: (H, W) m.
    """
    if not places:
        return []
    tops = np.array(places) + (0.0, 0.0, edge / 2)
    pixels, distances = camera.project(tops), camera.to_camera(tops)[:, 2]
    return [
        _look(depth, pixel, distance, edge)
        for pixel, distance in zip(pixels, distances, strict=True)
    ]


def _look(depth: np.ndarray, pixel: np.ndarray, distance: float, edge: float) -> Sight:
    height, width = depth.shape
    inside = np.isfinite(pixel).all() and HALF <= pixel[0] < width - HALF
    if not inside or not HALF <= pixel[1] < height - HALF:
        return Sight.UNCLEAR
    u, v = (int(round(float(value))) for value in pixel)
    window = depth[v - HALF : v + HALF + 1, u - HALF : u + HALF + 1]
    with np.errstate(invalid="ignore"):
        known = window[(window > 0.0) & (window < np.inf)]
    if known.size < LEAST_SHARE * window.size:
        return Sight.UNCLEAR
    seen = float(np.median(known))
    if seen < distance - NEARER:
        return Sight.HIDDEN
    return Sight.EMPTY if seen > distance + 0.5 * edge else Sight.UNCLEAR
