# SPDX-License-Identifier: BSD-3-Clause
"""What hangs on the arm's ports: belt, cubes on it, sensors, inputs, and the rail."""

import math
from dataclasses import dataclass

from fabric_dobot_driver.emulator.alarms import Alarm
from fabric_dobot_driver.emulator.motion import Trapezoid, mix
from fabric_dobot_driver.emulator.planning import PlanError
from fabric_dobot_driver.emulator.settings import Settings

COLOURS = {"red": (200, 30, 25), "green": (35, 170, 40), "blue": (20, 45, 180)}
NO_COLOUR = (12, 12, 12)
PORTS = range(4)  # GP1, GP2, GP4, GP5


class Stepper:
    """One extension stepper; it starts and stops at once."""

    def __init__(self) -> None:
        self.pulses = 0.0  # since power-up, backwards negative
        self.speed = 0.0  # pulses/s
        self._left = math.inf
        self._time = 0.0

    def drive(self, speed: float, now: float, distance: float = math.inf) -> None:
        """Runs from now on with this many pulses/s, for this many pulses."""
        self.advance(now)
        self.speed, self._left = (speed, distance) if speed and distance else (0.0, math.inf)

    def advance(self, now: float) -> None:
        """Turns on to this time."""
        turned = min(abs(self.speed) * (now - self._time), self._left)
        self._time = now
        self.pulses += math.copysign(turned, self.speed)
        self._left -= turned
        if self._left <= 0.0:
            self.speed, self._left = 0.0, math.inf


class Rail:
    """The sliding rail under the arm, in mm."""

    def __init__(self) -> None:
        self._start, self._end = 0.0, 0.0
        self._began = 0.0
        self._profile = Trapezoid.over((0.0,), (0.0,), (0.0,))

    def drive(self, end: float, speed: float, acceleration: float, now: float) -> float:
        """Goes there; when it arrives.

        Raises PlanError when speed or acceleration is not positive.
        """
        if not (speed > 0.0 and acceleration > 0.0):
            raise PlanError(Alarm.SPEED_PARAMETERS)
        self._start, self._end, self._began = self.at(now), end, now
        length = self._end - self._start
        self._profile = Trapezoid.over((length,), (speed,), (acceleration,))
        return now + self._profile.duration

    def at(self, now: float) -> float:
        """Where it is."""
        return mix((self._start,), (self._end,), self._profile.at(now - self._began))[0]

    def halt(self, now: float) -> None:
        """Stands where it is."""
        self._start = self._end = self.at(now)


@dataclass
class Cube:
    """On the belt: `place` mm of belt way at which it is in the middle of the sensors."""

    place: float
    colour: str


class Extension:
    """Belt on stepper 1, sensors across it, and what was written to the ports."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self.steppers = (Stepper(), Stepper())
        self.rail = Rail()
        self.cubes: list[Cube] = []
        self.forced: bool | None = None  # what the infrared sensor sees, whatever is there
        self.infrared_on: set[int] = set()
        self.colour_on: set[int] = set()
        self.levels: dict[int, int] = {}  # digital inputs by address
        self.voltages: dict[int, int] = {}  # analogue inputs by address, 0 to 4095

    def switched_on(self, now: float) -> "Extension":
        """As after power-up: counters at 0, sensors off; the world around is still there."""
        fresh = Extension(self._settings)
        fresh.advance(now)
        fresh.cubes = [Cube(cube.place - self.belt, cube.colour) for cube in self.cubes]
        fresh.forced = self.forced
        fresh.levels, fresh.voltages = self.levels, self.voltages
        return fresh

    @property
    def belt(self) -> float:
        """Way of the belt in mm since power-up."""
        return self.steppers[0].pulses / self._settings.pulses_per_mm

    def advance(self, now: float) -> None:
        """Turns the steppers on to this time."""
        for stepper in self.steppers:
            stepper.advance(now)

    def put(self, distance: float = 0.0, colour: str = "red") -> None:
        """Lays a cube on the belt, this many mm before the sensor.

        Raises ValueError for a distance that is not finite or a colour that no cube has.
        """
        if not math.isfinite(distance):
            raise ValueError(f"a cube {distance} mm before the sensor, want a finite number")
        if colour not in COLOURS:
            raise ValueError(f"a {colour!r} cube, want one of {', '.join(COLOURS)}")
        self.cubes.append(Cube(self.belt + distance, colour))

    def take(self) -> None:
        """Takes the cube at the sensor away; without one nothing happens."""
        cube = self.cube_at_sensor()
        if cube is not None:
            self.cubes.remove(cube)

    def cube_at_sensor(self) -> Cube | None:
        """The cube that interrupts the beam."""
        half = 0.5 * self._settings.cube_width
        return next((cube for cube in self.cubes if abs(cube.place - self.belt) <= half), None)

    def seen(self) -> bool:
        """True when something interrupts the beam."""
        return self.cube_at_sensor() is not None if self.forced is None else self.forced

    def infrared(self, port: int) -> int:
        """What the port reads: 0 unless the sensor hangs there and is switched on."""
        on = port == self._settings.infrared_port and port in self.infrared_on
        return int(on and self.seen())

    def colour(self) -> tuple[int, int, int]:
        """What the colour sensor reads: 0 each unless it is switched on."""
        if self._settings.colour_port not in self.colour_on:
            return 0, 0, 0
        cube = self.cube_at_sensor()
        return NO_COLOUR if cube is None else COLOURS[cube.colour]
