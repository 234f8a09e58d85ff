# SPDX-License-Identifier: BSD-3-Clause
"""How a person is watched, and how many ticks a piece of behaviour covers."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from fabric_msgs.msg import Container
from fabric_sim.experiments.trials import TICK
from fabric_sim.sensing import DirectParameters
from fabric_sim.worker_parameters import Span

_POINTS = 8  # per tick, of the integral over a survival function


@dataclass(frozen=True)
class Watching:
    """How a person is watched, and what the models leave open; times in s, chances.

    slip: a symbol that no model explains. stray_event: a tray's report when the models have placed
    nothing, per tick. misjudged: a report that says nothing of the person. wait: mean time until
    the next cube has come, which recordings do not hold. report: mean time until a tray has
    reported a cube. hidden: somebody who carries a cube seems idle, the hand being far from the
    belt. held: a tick in which the recording repeats itself because nobody looked again. carried,
    remembered: share of the tiredness and of the practice that outlasts the time between two
    trials.
    """

    sensing: DirectParameters
    slip: float = 0.02
    stray_event: float = 0.002
    wait: float = 2.0
    report: float = 1.0
    misjudged: float = 0.02
    hidden: float = 0.0
    held: float = 0.0
    carried: float = 1.0
    remembered: float = 1.0

    @classmethod
    def of(cls, sensing: DirectParameters) -> Watching:
        """As the simulated cell watches."""
        return cls(sensing, report=sum(sensing.settle[Container.OWNER_PERSON]) / 2.0)

    @property
    def delay(self) -> float:
        """Mean time in s from a change of behaviour to its recognition."""
        return sum(self.sensing.delay) / 2.0

    @property
    def reported(self) -> float:
        """Chance that a tray reports a cube of the person in a tick, once placed."""
        return 1.0 - math.exp(-TICK / max(TICK / 2.0, self.report - self.delay))


def survival(span: Span, seconds: np.ndarray, factor: np.ndarray) -> np.ndarray:
    """P(duration > seconds) of a clipped lognormal span stretched by `factor`; shapes broadcast."""
    variance = math.log1p(span.cv * span.cv)
    at = np.maximum(seconds / factor, 1e-9)
    z = (np.log(at / span.mean) + variance / 2.0) / math.sqrt(variance)
    inside = np.where(at < span.least, 1.0, 1.0 - ndtr(z))
    return np.where(at >= span.most, 0.0, inside)


def tick_distribution(span: Span, factor: np.ndarray, ticks: int) -> np.ndarray:
    """P(a piece covers 1..ticks ticks), (B, ticks): it begins anywhere between two ticks.

    Pieces shorter than a tick cover one; the last entry holds all that is longer.
    """
    u = (np.arange(ticks * _POINTS) + 0.5) / _POINTS * TICK
    outlives = survival(span, u[None, :], factor[:, None]).reshape(len(factor), ticks, _POINTS)
    at_least = outlives.mean(axis=2)
    at_least[:, 0] = 1.0
    longer = np.concatenate((at_least[:, 1:], np.zeros((len(factor), 1))), axis=1)
    return at_least - longer
