# SPDX-License-Identifier: BSD-3-Clause
"""Smooth movements as functions of time: minimum-jerk legs one after another, and small swaying."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

MEDIAL = 0.02  # m/s; slower than this a hand counts as standing


class Motion(NamedTuple):
    """Position, velocity, acceleration, (n,) each; m or rad and s."""

    p: np.ndarray
    v: np.ndarray
    a: np.ndarray


class Leg:
    """One movement: the fifth-degree polynomial of least jerk from any motion to a standstill.

    Flash and Hogan 1985; `arc` bends the way by so much at its middle.
    """

    def __init__(
        self, start: float, duration: float, before: Motion, end: np.ndarray, arc: np.ndarray
    ) -> None:
        """start, duration: s. end, arc: (n,). Raises ValueError unless duration is positive."""
        if not (duration > 0.0 and math.isfinite(duration)):
            raise ValueError(f"duration of a movement is {duration} s, want a positive number")
        self.start, self.duration, self.end = start, duration, end
        T = duration
        d, v, a = end - before.p, before.v * T, before.a * T * T
        self._c = np.array([
            before.p,
            v,
            a / 2,
            10 * d - 6 * v - 1.5 * a,
            -15 * d + 8 * v + 1.5 * a,
            6 * d - 3 * v - 0.5 * a,
        ])  # fmt: skip
        self._arc = 64.0 * arc

    @property
    def stop(self) -> float:
        """When it ends, s."""
        return self.start + self.duration

    def at(self, t: float) -> Motion:
        """The motion at time t (s) within the leg."""
        T, c = self.duration, self._c
        s = min(1.0, max(0.0, (t - self.start) / T))
        p = c[0] + s * (c[1] + s * (c[2] + s * (c[3] + s * (c[4] + s * c[5]))))
        v = c[1] + s * (2 * c[2] + s * (3 * c[3] + s * (4 * c[4] + s * 5 * c[5])))
        a = 2 * c[2] + s * (6 * c[3] + s * (12 * c[4] + s * 20 * c[5]))
        r, q = s * (1.0 - s), 1.0 - 2.0 * s  # the bend is r^3: no speed, no push at either end
        p = p + self._arc * r**3
        v = v + self._arc * 3.0 * r * r * q
        a = a + self._arc * (6.0 * r * q * q - 6.0 * r * r)
        return Motion(p, v / T, a / (T * T))


class Track:
    """Where something is that moves leg by leg; between the legs it stands."""

    def __init__(self, at: ArrayLike) -> None:
        """at: (n,) where it stands first."""
        self._first = np.array(at, dtype=float).reshape(-1)
        self._legs: list[Leg] = []

    @property
    def end(self) -> np.ndarray:
        """Where the last leg leads, (n,)."""
        return self._legs[-1].end if self._legs else self._first

    @property
    def done_at(self) -> float:
        """When the last leg ends, s; minus infinity before the first one."""
        return self._legs[-1].stop if self._legs else -math.inf

    def at(self, t: float) -> Motion:
        """The motion at time t (s)."""
        standing = self._first
        for leg in self._legs:
            if t < leg.start:
                break
            if t < leg.stop:
                return leg.at(t)
            standing = leg.end
        still = np.zeros_like(standing)
        return Motion(standing, still, still)

    def go(
        self, t: float, end: ArrayLike, duration: float, arc: ArrayLike = 0.0, delay: float = 0.0
    ) -> None:
        """Go to `end` (n,) from wherever it is at time t, in place of what it was about to do.

        What stands may start `delay` s later; what moves turns at once.
        """
        now = self.at(t)
        self._legs = []
        self._first = now.p
        wait = delay if float(np.abs(now.v).max()) < MEDIAL else 0.0
        self._append(t + wait, now if wait == 0.0 else _standing(now.p), end, duration, arc)

    def then(self, delay: float, end: ArrayLike, duration: float, arc: ArrayLike = 0.0) -> None:
        """Go on to `end` (n,) so many s after the last leg has ended. Raises ValueError before
        the first leg."""
        if not self._legs:
            raise ValueError("there is no movement to go on from")
        self._append(self.done_at + delay, _standing(self.end), end, duration, arc)

    def _append(
        self, start: float, before: Motion, end: ArrayLike, duration: float, arc: ArrayLike
    ) -> None:
        end = np.array(end, dtype=float).reshape(self._first.shape)
        bend = np.broadcast_to(np.asarray(arc, dtype=float), end.shape)
        self._legs.append(Leg(start, duration, before, end, bend))


class Wobble:
    """Swaying or trembling: a sum of sines of random pitch and phase, a function of time."""

    def __init__(
        self,
        rng: np.random.Generator,
        amplitude: float,
        band: tuple[float, float],
        axes: int = 3,
        tones: int = 4,
    ) -> None:
        """amplitude: standard deviation along each axis, m or rad. band: Hz, lowest and highest."""
        low, high = band
        self._omega = 2.0 * math.pi * rng.uniform(low, high, (tones, axes))
        self._phase = rng.uniform(0.0, 2.0 * math.pi, (tones, axes))
        self._scale = amplitude * math.sqrt(2.0 / tones)

    def at(self, t: float) -> np.ndarray:
        """Displacement at time t (s), (axes,)."""
        return self._scale * np.sin(self._omega * t + self._phase).sum(axis=0)


def _standing(at: np.ndarray) -> Motion:
    return Motion(at, np.zeros_like(at), np.zeros_like(at))
