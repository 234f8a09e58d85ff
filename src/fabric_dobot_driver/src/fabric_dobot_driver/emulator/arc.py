# SPDX-License-Identifier: BSD-3-Clause
"""The circle through three points. Millimetres and degrees."""

import math
from collections.abc import Callable

from fabric_dobot_driver.emulator.geometry import Values

STRAIGHT = 1e-6  # sine of the angle below which three points lie on a line


def arc_through(
    start: Values, via: Values, end: Values
) -> tuple[Callable[[float], Values], float, float] | None:
    """The curve from start over via to end with its length in mm and the turn of r in deg.

    Each is x, y, z, r; r turns evenly over the way. None when the points lie on a line or
    coincide.
    """
    to_via, to_end = _sum(via[:3], -1.0, start[:3]), _sum(end[:3], -1.0, start[:3])
    normal = _cross(to_via, to_end)
    area = math.hypot(*normal)
    if area <= STRAIGHT * math.hypot(*to_via) * math.hypot(*to_end):
        return None
    normal = tuple(value / area for value in normal)
    # From start to the centre: where the bisectors of both chords meet.
    inwards = _sum(
        tuple(_dot(to_via, to_via) / (2.0 * area) * value for value in _cross(to_end, normal)),
        _dot(to_end, to_end) / (2.0 * area),
        _cross(normal, to_via),
    )
    centre = _sum(start[:3], 1.0, inwards)
    out = tuple(-value for value in inwards)
    along = _cross(normal, out)
    chord = _sum(end[:3], -1.0, centre)
    angle = math.atan2(_dot(chord, along), _dot(chord, out)) % (2.0 * math.pi)
    turn = end[3] - start[3]

    def pose(s: float) -> Values:
        point = _sum(_sum(centre, math.cos(s * angle), out), math.sin(s * angle), along)
        return (*point, start[3] + s * turn)

    return pose, angle * math.hypot(*out), turn


def _sum(a: Values, factor: float, b: Values) -> Values:
    """a + factor b."""
    return tuple(p + factor * q for p, q in zip(a, b, strict=True))


def _dot(a: Values, b: Values) -> float:
    return sum(p * q for p, q in zip(a, b, strict=True))


def _cross(a: Values, b: Values) -> Values:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )
