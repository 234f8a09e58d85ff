# SPDX-License-Identifier: BSD-3-Clause
"""Markers from plain numbers: metres, frame `world`, colours as (r, g, b, a) in [0, 1]."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from geometry_msgs.msg import Point, Quaternion
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

FRAME = "world"
Colour = tuple[float, float, float, float]
Vector = tuple[float, float, float]

TABLE: Colour = (0.90, 0.88, 0.84, 1.0)
WHITE: Colour = (1.0, 1.0, 1.0, 1.0)
INK: Colour = (0.13, 0.15, 0.19, 1.0)
FAINT: Colour = (0.45, 0.48, 0.53, 1.0)
TRACK: Colour = (0.80, 0.82, 0.85, 1.0)
SKIN: Colour = (0.89, 0.70, 0.55, 1.0)
PERSON: Colour = (0.90, 0.60, 0.10, 1.0)
ROBOT: Colour = (0.10, 0.42, 0.72, 1.0)
GOOD: Colour = (0.12, 0.60, 0.42, 1.0)
ALARM: Colour = (0.85, 0.15, 0.12, 1.0)
BELT: Colour = (0.18, 0.19, 0.21, 1.0)
STRIPE: Colour = (0.42, 0.44, 0.48, 1.0)


def faded(colour: Colour, alpha: float) -> Colour:
    """The same colour with another opacity."""
    return (*colour[:3], alpha)


def pitched(pitch: float) -> Quaternion:
    """Rotation about x that leans the z axis by `pitch` rad towards +y."""
    return Quaternion(-math.sin(pitch / 2), 0.0, 0.0, math.cos(pitch / 2))


def yaw_quaternion(yaw: float) -> Quaternion:
    """Rotation about z by `yaw` rad."""
    return Quaternion(0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))


def _marker(key: tuple[str, int], kind: int, colour: Colour) -> Marker:
    marker = Marker(ns=key[0], id=key[1], type=kind, action=Marker.ADD)
    marker.header.frame_id = FRAME
    marker.pose.orientation.w = 1.0
    marker.color = ColorRGBA(*colour)
    return marker


def solid(
    key: tuple[str, int], kind: int, at: Vector, size: Vector, colour: Colour, yaw: float = 0.0
) -> Marker:
    """A cube, sphere or cylinder (Marker.CUBE ...) of full extents `size` around `at`."""
    marker = _marker(key, kind, colour)
    marker.pose.position = Point(*at)
    marker.pose.orientation = yaw_quaternion(yaw)
    marker.scale.x, marker.scale.y, marker.scale.z = size
    return marker


def box(key: tuple[str, int], at: Vector, size: Vector, colour: Colour, yaw: float = 0.0) -> Marker:
    """A box of full extents `size` around `at`."""
    return solid(key, Marker.CUBE, at, size, colour, yaw)


def ball(key: tuple[str, int], at: Vector, diameter: float, colour: Colour) -> Marker:
    """A sphere around `at`."""
    return solid(key, Marker.SPHERE, at, (diameter,) * 3, colour)


def line(key: tuple[str, int], points: Iterable[Vector], width: float, colour: Colour) -> Marker:
    """A line through the points, `width` m wide."""
    marker = _marker(key, Marker.LINE_STRIP, colour)
    marker.scale.x = width
    marker.points = [Point(*point) for point in points]
    return marker


def arrow(key: tuple[str, int], start: Vector, tip: Vector, width: float, colour: Colour) -> Marker:
    """An arrow from start to tip with a shaft of diameter `width`."""
    marker = _marker(key, Marker.ARROW, colour)
    marker.scale.x, marker.scale.y, marker.scale.z = width, 2.5 * width, 3.0 * width
    marker.points = [Point(*start), Point(*tip)]
    return marker


def flat(key: tuple[str, int], corners: Sequence[Vector], colour: Colour) -> Marker:
    """A quadrilateral that no light falls on; rviz shades what has no colours of its own."""
    marker = _marker(key, Marker.TRIANGLE_LIST, colour)
    marker.scale.x = marker.scale.y = marker.scale.z = 1.0
    marker.points = [Point(*corners[number]) for number in (0, 1, 2, 0, 2, 3)]
    marker.colors = [ColorRGBA(*colour)] * 6
    return marker


def text(key: tuple[str, int], at: Vector, height: float, words: str, colour: Colour) -> Marker:
    """Text that faces the viewer, centred on `at`; `height` of a capital letter in m."""
    marker = _marker(key, Marker.TEXT_VIEW_FACING, colour)
    marker.pose.position = Point(*at)
    marker.scale.z = height
    marker.text = words
    return marker


def deletion(key: tuple[str, int]) -> Marker:
    """Takes one marker away."""
    marker = Marker(ns=key[0], id=key[1], action=Marker.DELETE)
    marker.header.frame_id = FRAME
    return marker


def towards(start: Vector, goal: Sequence[float], step: float) -> Vector:
    """The point `step` m from start on the way to goal, or goal if that is nearer."""
    distance = math.dist(start, goal)
    if distance <= step:
        return (goal[0], goal[1], goal[2])
    x, y, z = (a + (b - a) * step / distance for a, b in zip(start, goal, strict=True))
    return (x, y, z)
