# SPDX-License-Identifier: BSD-3-Clause
"""How long after a picture was sent what it shows was told: times of one run brought together."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

PERCENTILES = (50, 95, 99)


class Latency(NamedTuple):
    """Of one topic. p50, p95, p99, most: ms; NaN when nothing was told."""

    told: int
    p50: float
    p95: float
    p99: float
    most: float


class Stopwatches:
    """When pictures were sent and when answers of their stamps came, s of one steady clock."""

    def __init__(self, topics: Sequence[str]) -> None:
        self._sent: dict[int, float] = {}
        self._took: dict[str, dict[int, float]] = {topic: {} for topic in topics}

    def sent(self, stamp: int, at: float) -> None:
        """A picture stamped `stamp` (ns) is about to be sent."""
        self._sent[stamp] = at

    def told(self, topic: str, stamp: int, at: float) -> None:
        """Something of a stamp has come; that of stamps that were not sent, or again, is none."""
        if stamp in self._sent:
            self._took[topic].setdefault(stamp, at - self._sent[stamp])

    def answered(self, topic: str, stamp: int) -> bool:
        """Whether anything of this stamp has come."""
        return stamp in self._took[topic]

    def latency(self, topic: str) -> Latency:
        """All that was measured of a topic."""
        took = 1e3 * np.array(list(self._took[topic].values()))
        if not len(took):
            return Latency(0, *[float("nan")] * 4)
        values = (float(v) for v in np.percentile(took, PERCENTILES))
        return Latency(len(took), *values, float(took.max()))


def to_and_fro(count: int, turn: int) -> list[int]:
    """Return `count` indices of a film of `turn` pictures, forth and back without a jump."""
    if turn < 2:
        return [0] * count
    period = 2 * turn - 2
    return [min(k % period, period - k % period) for k in range(count)]
