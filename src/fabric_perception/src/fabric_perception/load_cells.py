# SPDX-License-Identifier: BSD-3-Clause
"""Load cells under trays: raw counts of an HX711 become "a cube was put in", once each.

    scale = TrayScale(ScaleParameters(counts_per_gram=420.0, cube=18.0))
    for count in readings:
        change = scale.step(t, count)       # None, or Change(t, cubes=+1, grams=18.3)

A median of five takes out spikes. A level counts when it stood still for `still` s; it is a new
number of cubes when it differs from the last one by about a whole number of cubes and stays for
`hold_off` s. A large step must last longer, because more likely it is a hand: hardly ever still for
so long, and gone again. Only an empty tray is tared anew, slowly.
"""

import math
from collections import deque
from dataclasses import dataclass, fields
from statistics import median
from typing import NamedTuple

MIDDLE = 5  # readings of which the median is taken
SATURATED = (0x7FFFFF, -0x800000)  # what an HX711 says instead of a reading


@dataclass(frozen=True)
class ScaleParameters:
    """Of one load cell and of what is put on it. Raises ValueError naming a bad number."""

    counts_per_gram: float
    cube: float  # g
    tolerance: float = 0.35  # of a cube's weight that a step may be off
    still: float = 0.15  # s
    still_range: float = 0.06  # of a cube's weight within which a level is still
    hold_off: float = 0.10  # s that a step of one cube must last; n cubes n^2 times as long
    tare_time: float = 3.0  # s, time constant of taring while empty
    gap: float = 1.0  # s without readings after which everything is looked at anew

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            signed = field.name == "counts_per_gram"
            if not math.isfinite(value) or value == 0.0 or (value < 0.0 and not signed):
                raise ValueError(f"{field.name} is {value}, want a number above 0")
        if self.tolerance >= 0.5:
            raise ValueError(f"tolerance is {self.tolerance}, want less than 0.5 of a cube")


class Change(NamedTuple):
    """Cubes were put in (positive) or taken out. t: s, when the level began to stand still.

    grams: of the step.
    """

    t: float
    cubes: int
    grams: float


class TrayScale:
    """One tray. cubes: in it now. settled: whether the level is one that can be read."""

    def __init__(self, parameters: ScaleParameters, cubes: int = 0) -> None:
        """cubes: in the tray at the start. Raises ValueError when negative."""
        if cubes < 0:
            raise ValueError(f"{cubes} cubes cannot lie in a tray")
        self._p = parameters
        self.cubes = cubes
        self.settled = False
        self._last = -math.inf
        self._raw: deque[float] = deque(maxlen=MIDDLE)
        self._recent: deque[tuple[float, float]] = deque()  # s, g
        self._tare: float | None = None  # g, of the empty tray
        self._level = 0.0  # g above the tare at the last change
        self._new: tuple[float, int] | None = None  # since when which change shows

    def step(self, t: float, count: int) -> Change | None:
        """Take the reading of time t (s), later than the one before; return what changed.

        Saturated readings are passed over. Raises ValueError when t is not finite or not later.
        """
        if not math.isfinite(t) or t <= self._last:
            raise ValueError(f"a reading of {t} s does not follow one of {self._last} s")
        if t - self._last > self._p.gap:
            self._forget()
        passed = 0.0 if self._last == -math.inf else t - self._last
        self._last = t
        if count in SATURATED:
            return None
        level = self._still_level(t, count / self._p.counts_per_gram)
        self.settled = level is not None
        if level is None:
            self._new = None
            return None
        if self._tare is None:
            self._tare = level - self.cubes * self._p.cube
            self._level = level - self._tare
            return None
        return self._judge(level - self._tare, passed)

    def _forget(self) -> None:
        self._raw.clear()
        self._recent.clear()
        self._new = None

    def _still_level(self, t: float, grams: float) -> float | None:
        """Mean of the last readings when they stand still, g."""
        self._raw.append(grams)
        if len(self._raw) < MIDDLE:
            return None
        self._recent.append((t, median(self._raw)))
        while self._recent[0][0] < t - self._p.still:
            self._recent.popleft()
        values = [value for _, value in self._recent]
        if t - self._recent[0][0] < 0.8 * self._p.still:
            return None
        if max(values) - min(values) > self._p.still_range * self._p.cube:
            return None
        return sum(values) / len(values)

    def _judge(self, level: float, passed: float) -> Change | None:
        """Compare a still level, g above the tare, with the last one."""
        step = level - self._level
        cubes = round(step / self._p.cube)
        fits = abs(step - cubes * self._p.cube) <= self._p.tolerance * self._p.cube * max(
            1.0, math.sqrt(abs(cubes))
        )
        if cubes == 0 or not fits or self.cubes + cubes < 0:
            self._new = None
            if cubes == 0 and self.cubes == 0:
                self._retare(step, passed)
            return None
        if self._new is None or self._new[1] != cubes:
            self._new = (self._last, cubes)
        since = self._new[0]
        if self._last - since < self._p.hold_off * cubes**2:
            return None
        self.cubes += cubes
        self._level, self._new = level, None
        return Change(since, cubes, step)

    def _retare(self, step: float, passed: float) -> None:
        """Follow the slow drift of an empty tray."""
        assert self._tare is not None
        self._tare += step * min(1.0, passed / self._p.tare_time)
