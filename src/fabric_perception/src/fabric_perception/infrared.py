# SPDX-License-Identifier: BSD-3-Clause
"""The light barrier at the pick point: a level that chatters becomes one that can be relied on.

barrier = LightBarrier(hold=0.03)
for level in samples:
    edge = barrier.step(t, level)
"""

import math
from typing import NamedTuple


class Edge(NamedTuple):
    """The barrier was interrupted or became free. t: when it began to, s."""

    t: float
    blocked: bool


class LightBarrier:
    """Believes a level when it prevailed for `hold` s; single wrong samples only delay it.

    blocked: whether something stands in the light.
    """

    def __init__(self, hold: float = 0.03, blocked: bool = False) -> None:
        """hold: s, 0.02 to 0.05 for the usual chatter. Raises ValueError unless positive."""
        if not (hold > 0.0 and math.isfinite(hold)):
            raise ValueError(f"hold is {hold} s, want a positive number")
        self._hold = hold
        self.blocked = blocked
        self._sum = hold if blocked else 0.0
        self._last: float | None = None
        self._since: float | None = None  # when the level began to differ

    def step(self, t: float, blocked: bool) -> Edge | None:
        """Take a sample of time t (s), later than the one before; return an edge when it is sure.

        A sample counts for the time since the one before it, at most half of `hold`. Raises
        ValueError when t is not finite or not later.
        """
        if not math.isfinite(t) or (self._last is not None and t <= self._last):
            raise ValueError(f"a sample of {t} s does not follow one of {self._last} s")
        passed = 0.0 if self._last is None else min(t - self._last, self._hold / 2)
        self._last = t
        self._sum = min(self._hold, max(0.0, self._sum + (passed if blocked else -passed)))
        rest = 0.0 if not self.blocked else self._hold
        if self._sum == rest:
            self._since = None
        elif self._since is None:
            self._since = t
        if self._sum != self._hold - rest:
            return None
        began = t if self._since is None else self._since
        self.blocked, self._since = not self.blocked, None
        return Edge(began, self.blocked)
