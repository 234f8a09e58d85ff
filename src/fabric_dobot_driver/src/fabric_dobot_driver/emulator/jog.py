# SPDX-License-Identifier: BSD-3-Clause
"""Jog: one axis moves, with a ramp of speed, until it is told to stop or is at a limit."""

import math

from fabric_dobot_driver.emulator.geometry import Geometry, Values

STEP = 0.005  # s between the places that are checked against the limits


class Jog:
    """A jog under way. Joint angles in deg, time in s."""

    def __init__(
        self, start: float, joints: Values, command: int, joint: bool, geometry: Geometry
    ) -> None:
        """Begins at the time `start`; `command` 1 to 8 says axis and direction."""
        self.joints = joints
        self._axis, backwards = divmod(command - 1, 2)
        self._direction = -1.0 if backwards else 1.0
        self._joint = joint
        self._geometry = geometry
        self._time = start
        self._speed = 0.0
        self._wanted = 0.0
        self._acceleration = 0.0

    def drive(self, speed: float, acceleration: float) -> None:
        """Goes for this speed; in deg/s or mm/s and the same per s."""
        self._wanted, self._acceleration = speed, acceleration

    def stop(self) -> None:
        """Brakes."""
        self._wanted = 0.0

    @property
    def over(self) -> bool:
        """True when it stands and means to."""
        return self._speed == 0.0 and (self._wanted == 0.0 or self._acceleration == 0.0)

    def advance(self, now: float) -> int | None:
        """Moves on to this time; the alarm of the limit it stopped at, if any."""
        while not self.over and self._time + STEP <= now:
            self._time += STEP
            alarm = self._step()
            if alarm is not None:
                return alarm
        return None

    def _step(self) -> int | None:
        change = self._wanted - self._speed
        self._speed += math.copysign(min(abs(change), self._acceleration * STEP), change)
        moved = self._moved(self._direction * self._speed * STEP)
        alarm = self._geometry.fault(moved)
        if alarm is None:
            self.joints = moved
            return None
        self._speed = self._wanted = 0.0
        return alarm if moved is None else self._geometry.exceeded(moved)

    def _moved(self, distance: float) -> Values | None:
        values = list(self.joints if self._joint else self._geometry.pose(self.joints))
        values[self._axis] += distance
        return tuple(values) if self._joint else self._geometry.joints(tuple(values))
