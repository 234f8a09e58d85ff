# SPDX-License-Identifier: BSD-3-Clause
"""The circle through three points. Millimetres and degrees."""

import math
from collections.abc import Callable

import numpy as np

from fabric_dobot_driver.emulator.geometry import Values

STRAIGHT = 1e-6  # sine of the angle below which three points lie on a line


def arc_through(
    start: Values, via: Values, end: Values
) -> tuple[Callable[[float], Values], float, float] | None:
    """The curve from start over via to end with its length in mm and the turn of r in deg.

    Each is x, y, z, r; r turns evenly over via. None when the points lie on a line or coincide.
    """
    a, b, c = (np.array(point[:3]) for point in (start, via, end))
    normal = np.cross(b - a, c - a)
    norm = np.linalg.norm(normal)
    if norm <= STRAIGHT * np.linalg.norm(b - a) * np.linalg.norm(c - a):
        return None
    normal /= norm
    to_b, to_c = b - a, c - a
    weighted = to_b @ to_b * np.cross(to_c, normal) + to_c @ to_c * np.cross(normal, to_b)
    centre = a + weighted / (2.0 * norm)
    out = a - centre
    along = np.cross(normal, out)
    chord = c - centre
    angle = math.atan2(chord @ along, chord @ out) % (2.0 * math.pi)
    turn = end[3] - start[3]

    def pose(s: float) -> Values:
        point = centre + math.cos(s * angle) * out + math.sin(s * angle) * along
        return (*(float(value) for value in point), start[3] + s * turn)

    return pose, angle * float(np.linalg.norm(out)), turn
