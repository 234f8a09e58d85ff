# SPDX-License-Identifier: BSD-3-Clause
"""The conveyor belt with its feeder and the infrared sensor at the pick point."""

import math
from dataclasses import dataclass

from fabric_sim.geometry import BeltShape

MAX_SPEED = 0.12  # m/s, of the Dobot's belt
NEAR = 1e-9  # m; two places that differ by less are the same
STEP_SLACK = 1e-6  # steps; forgives rounding when a way is counted in steps


def check_speed(speed: float) -> None:
    """Raise ValueError when a belt speed (m/s) is not finite, negative or beyond the motor."""
    if not math.isfinite(speed) or not 0.0 <= speed <= MAX_SPEED:
        raise ValueError(f"belt speed is {speed}, want a finite number of m/s, 0 to {MAX_SPEED}")


@dataclass
class Changes:
    """Grows whenever a cube may be said to be elsewhere than before."""

    count: int = 0


class Belt:
    """Carries cubes (by id) along x of the frame conveyor; the pick point is x = 0.

    The light barrier is placed so that a cube interrupts it when the cube's middle reaches the
    pick point. An interrupted barrier stops the belt unless `ignore_sensor` is set.

    at_pick_point: the cube that interrupts the light barrier, the foremost if several do.
    speed: at which the belt runs now, m/s.
    carried: x in m of every cube on the belt; to be read only.
    """

    def __init__(self, shape: BeltShape, changes: Changes | None = None) -> None:
        """changes: counts what the light barrier sees and commands."""
        self._shape = shape
        self._waiting: list[int] = []
        self.carried: dict[int, float] = {}
        self._commanded = 0.0
        self._ignore_sensor = False
        self.at_pick_point: int | None = None
        self.speed = 0.0
        self._changes = changes or Changes()

    def load(self, cubes: list[int]) -> None:
        """Clear the belt, stop it and fill the feeder."""
        self._waiting = list(cubes)
        self.carried = {}
        self._commanded = 0.0
        self._ignore_sensor = False
        self._set(None)

    def command(self, speed: float, ignore_sensor: bool) -> None:
        """Run at `speed` m/s, forwards; 0 stops. Raises ValueError as check_speed."""
        check_speed(speed)
        self._commanded = speed
        self._ignore_sensor = ignore_sensor
        self._set(self.at_pick_point)

    @property
    def places(self) -> dict[int, float]:
        """x in m of every cube on the belt."""
        return dict(self.carried)

    @property
    def following(self) -> int | None:
        """The next cube in the feeder."""
        return self._waiting[0] if self._waiting else None

    @property
    def waiting(self) -> list[int]:
        """Cubes still in the feeder, the next one first."""
        return list(self._waiting)

    def step(self, dt: float) -> list[int]:
        """Run for dt seconds; return the cubes that fell off the end."""
        speed = self.speed
        if speed == 0.0:
            return []
        advance = self._advance(speed * dt)
        self.carried = {cube: x + advance for cube, x in self.carried.items()}
        self._feed()
        fallen = [cube for cube, x in self.carried.items() if x > self._shape.end]
        for cube in fallen:
            del self.carried[cube]
        self._look()
        return fallen

    def quiet_steps(self, dt: float) -> float:
        """Steps of dt seconds that only carry cubes along: nothing is fed, seen, lost or falls.

        Infinite while the belt stands; rather one too few than one too many.
        """
        advance = self.speed * dt
        if advance == 0.0:
            return math.inf
        way = math.inf
        for x in self.carried.values():
            way = min(way, self._to_next_mark(x))
        if self._waiting:
            last = min(self.carried.values(), default=self._shape.feeder + self._shape.spacing)
            way = min(way, self._shape.feeder + self._shape.spacing - last)
        if way == math.inf:
            return way
        return max(0, math.ceil(way / advance - STEP_SLACK) - 1)

    def skip(self, steps: int, dt: float) -> None:
        """Do as many steps as `quiet_steps` allows at once, adding up as `step` does."""
        advance = self.speed * dt
        if advance == 0.0:
            return
        for cube, x in self.carried.items():
            for _ in range(steps):
                x += advance
            self.carried[cube] = x

    def take(self, cube: int) -> None:
        """Take a cube off. Raises KeyError when it is not on the belt."""
        del self.carried[cube]
        self._look()

    def put(self, cube: int, x: float) -> bool:
        """Put a cube down at x m, or at the nearest place where it fits; False when none does."""
        free = self._free()
        if free:
            self.carried[cube] = min(free, key=lambda place: (abs(place - x), place))
            self._look()
        return bool(free)

    def _advance(self, advance: float) -> float:
        """The way the belt goes: it stops exactly when a cube reaches the light barrier."""
        if self._ignore_sensor:
            return advance
        for x in self.carried.values():
            if x < -NEAR:
                advance = min(advance, -x)
        return advance

    def _feed(self) -> None:
        last = min(self.carried.values(), default=math.inf)
        if self._waiting and last - self._shape.feeder >= self._shape.spacing - NEAR:
            self.carried[self._waiting.pop(0)] = self._shape.feeder

    def _free(self) -> list[float]:
        """Places on a 1 mm grid that keep clear of every cube."""
        clear = self._shape.edge + self._shape.gap
        first, last = round(1e3 * self._shape.feeder), round(1e3 * self._shape.end)
        grid = (1e-3 * i for i in range(first, last + 1))
        others = self.carried.values()
        return [x for x in grid if all(abs(x - other) >= clear - NEAR for other in others)]

    def _look(self) -> None:
        """What the light barrier sees."""
        blocking = [(x, cube) for cube, x in self.carried.items() if self._in_beam(x)]
        foremost = max(blocking)[1] if blocking else None
        if foremost != self.at_pick_point:
            self._set(foremost)

    def _set(self, at_pick_point: int | None) -> None:
        held = at_pick_point is not None and not self._ignore_sensor
        self.at_pick_point, self.speed = at_pick_point, 0.0 if held else self._commanded
        self._changes.count += 1

    def _to_next_mark(self, x: float) -> float:
        """Way from x m to where a cube comes into the beam, leaves it or falls off the end."""
        if x < -NEAR:
            return -x
        return (self._shape.edge if x <= self._shape.edge else self._shape.end) - x

    def _in_beam(self, x: float) -> bool:
        return -NEAR <= x <= self._shape.edge
