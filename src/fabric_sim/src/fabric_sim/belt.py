# SPDX-License-Identifier: BSD-3-Clause
"""The conveyor belt with its feeder and the infrared sensor at the pick point."""

import math

from fabric_sim.geometry import BeltShape

MAX_SPEED = 0.12  # m/s, of the Dobot's belt
NEAR = 1e-9  # m; two places that differ by less are the same


def check_speed(speed: float) -> None:
    """Raise ValueError when a belt speed (m/s) is not finite, negative or beyond the motor."""
    if not math.isfinite(speed) or not 0.0 <= speed <= MAX_SPEED:
        raise ValueError(f"belt speed is {speed}, want a finite number of m/s, 0 to {MAX_SPEED}")


class Belt:
    """Carries cubes (by id) along x of the frame conveyor; the pick point is x = 0.

    The light barrier is placed so that a cube interrupts it when the cube's middle reaches the
    pick point. An interrupted barrier stops the belt unless `ignore_sensor` is set.
    """

    def __init__(self, shape: BeltShape) -> None:
        self._shape = shape
        self._waiting: list[int] = []
        self._places: dict[int, float] = {}
        self._commanded = 0.0
        self._ignore_sensor = False

    def load(self, cubes: list[int]) -> None:
        """Clear the belt, stop it and fill the feeder."""
        self._waiting = list(cubes)
        self._places = {}
        self._commanded = 0.0
        self._ignore_sensor = False

    def command(self, speed: float, ignore_sensor: bool) -> None:
        """Run at `speed` m/s, forwards; 0 stops. Raises ValueError as check_speed."""
        check_speed(speed)
        self._commanded = speed
        self._ignore_sensor = ignore_sensor

    @property
    def places(self) -> dict[int, float]:
        """x in m of every cube on the belt."""
        return dict(self._places)

    @property
    def waiting(self) -> list[int]:
        """Cubes still in the feeder, the next one first."""
        return list(self._waiting)

    @property
    def at_pick_point(self) -> int | None:
        """The cube that interrupts the light barrier, the foremost if several do."""
        blocking = [(x, cube) for cube, x in self._places.items() if self._in_beam(x)]
        return max(blocking)[1] if blocking else None

    @property
    def speed(self) -> float:
        """Speed at which the belt runs now, m/s."""
        held = self.at_pick_point is not None and not self._ignore_sensor
        return 0.0 if held else self._commanded

    def step(self, dt: float) -> list[int]:
        """Run for dt seconds; return the cubes that fell off the end."""
        speed = self.speed
        if speed == 0.0:
            return []
        advance = self._advance(speed * dt)
        self._places = {cube: x + advance for cube, x in self._places.items()}
        self._feed()
        fallen = [cube for cube, x in self._places.items() if x > self._shape.end]
        for cube in fallen:
            del self._places[cube]
        return fallen

    def take(self, cube: int) -> None:
        """Take a cube off. Raises KeyError when it is not on the belt."""
        del self._places[cube]

    def put(self, cube: int, x: float) -> bool:
        """Put a cube down at x m, or at the nearest place where it fits; False when none does."""
        free = self._free()
        if free:
            self._places[cube] = min(free, key=lambda place: (abs(place - x), place))
        return bool(free)

    def _advance(self, advance: float) -> float:
        """The way the belt goes: it stops exactly when a cube reaches the light barrier."""
        if self._ignore_sensor:
            return advance
        ahead = [-x for x in self._places.values() if x < -NEAR]
        return min([advance, *ahead])

    def _feed(self) -> None:
        last = min(self._places.values(), default=math.inf)
        if self._waiting and last - self._shape.feeder >= self._shape.spacing - NEAR:
            self._places[self._waiting.pop(0)] = self._shape.feeder

    def _free(self) -> list[float]:
        """Places on a 1 mm grid that keep clear of every cube."""
        clear = self._shape.edge + self._shape.gap
        first, last = round(1e3 * self._shape.feeder), round(1e3 * self._shape.end)
        grid = (1e-3 * i for i in range(first, last + 1))
        others = self._places.values()
        return [x for x in grid if all(abs(x - other) >= clear - NEAR for other in others)]

    def _in_beam(self, x: float) -> bool:
        return -NEAR <= x <= self._shape.edge
