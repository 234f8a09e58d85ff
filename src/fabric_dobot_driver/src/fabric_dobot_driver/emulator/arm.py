# SPDX-License-Identifier: BSD-3-Clause
"""The moving part: joint angles in time, from a planned motion, a jog, or at rest."""

import math

from fabric_dobot_driver.emulator.geometry import Values
from fabric_dobot_driver.emulator.jog import Jog
from fabric_dobot_driver.emulator.motion import Motion


class Arm:
    """At most one thing moves it."""

    def __init__(self, joints: Values) -> None:
        self._rest = joints
        self._motion: Motion | None = None
        self._start = 0.0
        self.jog: Jog | None = None

    @property
    def moving(self) -> bool:
        """True while a motion or a jog is under way."""
        return self._motion is not None or self.jog is not None

    @property
    def end(self) -> float:
        """When the planned motion ends; infinity without one."""
        return math.inf if self._motion is None else self._start + self._motion.duration

    def joints(self, now: float) -> Values:
        """Joint angles in deg."""
        if self._motion is not None:
            return self._motion.at(now - self._start)
        return self._rest if self.jog is None else self.jog.joints

    def start(self, motion: Motion, now: float) -> None:
        """Begins a motion; whatever moved before is abandoned."""
        self.halt(now)
        self._motion, self._start = motion, now

    def start_jog(self, jog: Jog, now: float) -> None:
        """Begins a jog; whatever moved before is abandoned."""
        self.halt(now)
        self.jog = jog

    def advance(self, now: float) -> int | None:
        """Moves on; the alarm that this ended in, if any."""
        if self.jog is not None:
            alarm = self.jog.advance(now)
            if alarm is not None or self.jog.over:
                self.halt(now)
            return alarm
        if self._motion is not None and now >= self.end:
            alarm = self._motion.alarm
            self.halt(self.end)
            return alarm
        return None

    def halt(self, now: float) -> None:
        """Stands where it is."""
        self._rest = self.joints(now)
        self._motion = self.jog = None

    def set_joints(self, joints: Values) -> None:
        """Takes these angles for its own, without moving."""
        self._rest, self._motion, self.jog = joints, None, None
