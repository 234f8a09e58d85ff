# SPDX-License-Identifier: BSD-3-Clause
"""Motion in time: trapezoids of speed along ways in joint space or in space. Units of the wire."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

from fabric_dobot_driver.emulator.geometry import Geometry, Values

LINE_STEP = 5.0  # mm between the points of a line that are looked at before it is driven
TURN_STEP = 5.0  # deg of r between them


class Trapezoid(NamedTuple):
    """From 0 to 1, from rest to rest, with at most this speed (1/s) and acceleration (1/s^2)."""

    speed: float
    acceleration: float

    @classmethod
    def over(cls, lengths: Values, speeds: Values, accelerations: Values) -> "Trapezoid":
        """The fastest that keeps every axis within its own limits."""
        moving = [row for row in zip(lengths, speeds, accelerations, strict=True) if row[0]]
        if not moving:
            return cls(math.inf, math.inf)
        speed = min(v / abs(length) for length, v, _ in moving)
        acceleration = min(a / abs(length) for length, _, a in moving)
        return cls(min(speed, math.sqrt(acceleration)), acceleration)

    @classmethod
    def lasting(cls, duration: float) -> "Trapezoid":
        """Half of the time speeding up, half braking."""
        return cls(2.0 / duration, 4.0 / duration**2)

    @property
    def duration(self) -> float:
        """Seconds from 0 to 1."""
        if math.isinf(self.speed):
            return 0.0
        return 1.0 / self.speed + self.speed / self.acceleration

    def at(self, t: float) -> float:
        """Where it is after t s."""
        total = self.duration
        if t >= total:
            return 1.0
        ramp = self.speed / self.acceleration
        if t < ramp:
            return 0.5 * self.acceleration * max(0.0, t) ** 2
        if t > total - ramp:
            return 1.0 - 0.5 * self.acceleration * (total - t) ** 2
        return self.speed * (t - 0.5 * ramp)

    def speed_at(self, s: float) -> float:
        """Speed at the place s."""
        return min(self.speed, math.sqrt(2.0 * self.acceleration * max(0.0, min(s, 1.0 - s))))

    def time_at(self, s: float) -> float:
        """When it gets to the place s."""
        near = min(s, 1.0 - s)
        ramp = self.speed / self.acceleration
        braking = 0.5 * self.speed * ramp
        if near < braking:
            t = math.sqrt(2.0 * near / self.acceleration)
        else:
            t = ramp + (near - braking) / self.speed
        return t if s <= 0.5 else self.duration - t


class Way(Protocol):
    """A piece of motion."""

    @property
    def duration(self) -> float: ...

    def at(self, t: float) -> Values: ...


class JointWay(NamedTuple):
    """All joints start and arrive together."""

    start: Values
    end: Values
    profile: Trapezoid

    @property
    def duration(self) -> float:
        """Seconds."""
        return self.profile.duration

    def at(self, t: float) -> Values:
        """Joint angles after t s."""
        return mix(self.start, self.end, self.profile.at(t))


class SpaceWay(NamedTuple):
    """The tool follows a curve; `pose` gives x, y, z, r from 0 to 1, every one within reach."""

    pose: Callable[[float], Values]
    geometry: Geometry
    profile: Trapezoid

    @property
    def duration(self) -> float:
        """Seconds."""
        return self.profile.duration

    def at(self, t: float) -> Values:
        """Joint angles after t s."""
        return self.geometry.joints(self.pose(self.profile.at(t)))


class Motion(NamedTuple):
    """Ways one after the other, from rest to rest; perhaps cut short by an alarm."""

    ways: Sequence[Way]
    alarm: int | None = None
    alarm_after: float = math.inf  # s

    @property
    def duration(self) -> float:
        """Seconds until it ends, or is cut short."""
        return min(self.alarm_after, sum(way.duration for way in self.ways))

    def at(self, t: float) -> Values:
        """Joint angles after t s."""
        t = min(t, self.alarm_after)
        for way in self.ways[:-1]:
            if t < way.duration:
                return way.at(t)
            t -= way.duration
        return self.ways[-1].at(t)


def mix(start: Values, end: Values, s: float) -> Values:
    """A share s of the way from start to end."""
    return tuple(a + s * (b - a) for a, b in zip(start, end, strict=True))


def overspeed(way: SpaceWay, points: Sequence[Values], fastest: Values) -> tuple[float, int] | None:
    """When and with which axis a joint first turns faster than it can.

    points: (n, 4) joint angles at equal steps of the way.
    """
    steps = len(points) - 1
    for i in range(steps):
        speed = way.profile.speed_at((i + 0.5) / steps) * steps
        for axis in range(4):
            if abs(points[i + 1][axis] - points[i][axis]) * speed > fastest[axis]:
                return way.profile.time_at(i / steps), axis
    return None
