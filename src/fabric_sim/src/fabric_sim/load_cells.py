# SPDX-License-Identifier: BSD-3-Clause
"""Load cells under trays as devices: they swing, drift, have spikes, and feel resting hands.

bank = LoadCellBank(parameters, tray_ids, rng)
counts = bank.step(0.05, grams_by_tray, pressed_trays)   # all readings of a tick
"""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fabric_sim.entries import Entries

HIGH, LOW = 0x7FFFFF, -0x800000  # codes of an HX711 whose clock was late
TREMBLE = 0.12  # s, time constant of the changes of a hand's pressure


@dataclass(frozen=True)
class LoadCellParameters:
    """Numbers of sensors.yaml."""

    rate: float  # readings a second
    counts_per_gram: float
    cube: tuple[float, float]  # g, weight of a cube
    noise: float  # g, standard deviation of a reading
    swing: float  # Hz
    damping: float  # of the swinging, 1 is none
    drift: float  # g after 1 s, grows with the square root of time
    spike: float  # probability that a reading is nonsense
    press: tuple[float, float]  # g of a hand that rests on a tray

    @classmethod
    def read(cls, entries: Entries) -> "LoadCellParameters":
        """Read a branch `load_cells`. Raises ConfigError naming the entry and its value."""
        return cls(
            rate=entries.number("rate", 1.0, 1000.0),
            counts_per_gram=entries.positive("counts_per_gram"),
            cube=entries.span("cube", 0.1, 1000.0),
            noise=entries.number("noise", 0.0, 1000.0),
            swing=entries.number("swing", 0.1, 100.0),
            damping=entries.number("damping", 0.01, 2.0),
            drift=entries.number("drift", 0.0, 10.0),
            spike=entries.number("spike", 0.0, 0.5),
            press=entries.span("press", 0.0, 10000.0),
        )


class LoadCellBank:
    """The cells under some trays, read together."""

    def __init__(
        self, parameters: LoadCellParameters, trays: Sequence[int], rng: np.random.Generator
    ) -> None:
        """trays: ids. rng: decides offsets, noise, drift, spikes and pressure."""
        self._p, self._rng = parameters, rng
        self.trays = tuple(trays)
        n = len(self.trays)
        self._level, self._speed = np.zeros(n), np.zeros(n)  # g, g/s
        self._drift = np.zeros(n)
        self._offset = rng.uniform(-3e5, 3e5, n)  # counts of an empty tray
        self._press = np.zeros(n)
        self._hand = np.zeros(n)  # g that this hand means to press with; 0 without a hand
        self._owed = 0.0

    def weight(self) -> float:
        """Draw the weight of a new cube, g."""
        return float(self._rng.uniform(*self._p.cube))

    def step(
        self, dt: float, loads: Mapping[int, float], pressed: Collection[int] = ()
    ) -> np.ndarray:
        """Return the readings of the next dt seconds, (n, trays) int32 counts.

        loads: g by tray id; a tray without an entry is empty. pressed: ids of trays that a hand
        touches. Raises ValueError unless dt is positive.
        """
        if not dt > 0.0:
            raise ValueError(f"{dt} s cannot pass")
        self._owed += dt * self._p.rate
        count = int(self._owed + 1e-9)
        self._owed -= count
        target = np.array([loads.get(tray, 0.0) for tray in self.trays], dtype=float)
        touched = np.array([tray in pressed for tray in self.trays], dtype=bool)
        rows = [self._reading(target, touched) for _ in range(count)]
        return np.array(rows, dtype=np.int32).reshape(count, len(self.trays))

    def _reading(self, target: np.ndarray, touched: np.ndarray) -> np.ndarray:
        p, rng, n = self._p, self._rng, len(self.trays)
        dt = 1.0 / p.rate
        self._feel(touched, dt)
        self._swing_on(target + self._press, dt)
        self._drift += p.drift * math.sqrt(dt) * rng.standard_normal(n)
        grams = self._level + self._drift + p.noise * rng.standard_normal(n)
        counts = np.rint(self._offset + p.counts_per_gram * grams)
        spikes = rng.random(n) < p.spike
        nonsense = rng.choice((HIGH, LOW, 0), n)
        return np.where(spikes, nonsense, np.clip(counts, LOW, HIGH))

    def _feel(self, touched: np.ndarray, dt: float) -> None:
        """A hand presses unevenly; it comes and goes within a few hundredths of a second."""
        p, rng, n = self._p, self._rng, len(self.trays)
        fresh = touched & (self._hand == 0.0)
        self._hand = np.where(fresh, rng.uniform(*p.press, n), np.where(touched, self._hand, 0.0))
        pull = min(1.0, dt / TREMBLE)
        shake = 0.25 * self._hand * math.sqrt(2.0 * pull) * rng.standard_normal(n)
        self._press = np.maximum(0.0, self._press + pull * (self._hand - self._press) + shake)
        self._press[~touched] *= 1.0 - min(1.0, 2.0 * pull)

    def _swing_on(self, load: np.ndarray, dt: float) -> None:
        """The tray on its spring: a damped oscillator, in steps short enough to be stable."""
        omega = 2.0 * math.pi * self._p.swing
        steps = max(1, math.ceil(dt * omega / 0.2))
        for _ in range(steps):
            push = omega**2 * (load - self._level) - 2.0 * self._p.damping * omega * self._speed
            self._speed = self._speed + push * dt / steps
            self._level = self._level + self._speed * dt / steps
