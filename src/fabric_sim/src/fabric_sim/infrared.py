# SPDX-License-Identifier: BSD-3-Clause
"""The light barrier at the pick point as a device: edges chatter, now and then a sample is wrong.

barrier = InfraredBarrier(parameters, rng)
levels = barrier.step(0.05, cube_there)    # all samples of a tick
"""

from dataclasses import dataclass

import numpy as np

from fabric_sim.entries import Entries


@dataclass(frozen=True)
class InfraredParameters:
    """Numbers of sensors.yaml."""

    rate: float  # samples a second
    chatter: tuple[float, float]  # s that an edge chatters
    wrong: float  # probability that a sample is wrong

    @classmethod
    def read(cls, entries: Entries) -> "InfraredParameters":
        """Read a branch `infrared`. Raises ConfigError naming the entry and its value."""
        return cls(
            entries.number("rate", 1.0, 10000.0),
            entries.span("chatter", 0.0, 1.0),
            entries.number("wrong", 0.0, 0.5),
        )


class InfraredBarrier:
    """Samples evenly from time 0 on. level: what the belt's controller made of the last step, the
    majority of its samples."""

    def __init__(self, parameters: InfraredParameters, rng: np.random.Generator) -> None:
        """rng: decides chatter and errors."""
        self._p, self._rng = parameters, rng
        self._blocked = False
        self._chatters_for = 0.0
        self._owed = 0.0  # samples
        self.level = False

    def step(self, dt: float, blocked: bool) -> np.ndarray:
        """Return the samples of the next dt seconds, (n,) bool; the edge, if any, is at their
        start. Raises ValueError unless dt is positive."""
        if not dt > 0.0:
            raise ValueError(f"{dt} s cannot pass")
        if blocked != self._blocked:
            self._blocked = blocked
            self._chatters_for = self._rng.uniform(*self._p.chatter)
        self._owed += dt * self._p.rate
        count = int(self._owed + 1e-9)
        self._owed -= count
        samples = self._samples(count)
        if count:
            self.level = bool(samples.mean() > 0.5)
        self._chatters_for = max(0.0, self._chatters_for - dt)
        return samples

    def _samples(self, count: int) -> np.ndarray:
        chattering = np.arange(count) < self._chatters_for * self._p.rate
        wrong = self._rng.random(count) < np.where(chattering, 0.4, self._p.wrong)
        return np.full(count, self._blocked) ^ wrong
