# SPDX-License-Identifier: BSD-3-Clause
"""How well the pictures come: what a diagnostic of the tracker says. Knows no ROS."""

from typing import NamedTuple

OK, WARN, ERROR = 0, 1, 2  # as diagnostic_msgs/DiagnosticStatus
RECENT = 2.0  # s
LITTLE_DEPTH = 0.3  # share of the coloured pixels
WEIGHT = 0.1  # of the newest picture in the share of depth


class Status(NamedTuple):
    """level: OK, WARN or ERROR. values: names and figures."""

    level: int
    text: str
    values: dict[str, str]


class Health:
    """Counts pictures that were used, and those that were not, by reason. Times in s."""

    def __init__(self) -> None:
        self.used = 0
        self.refused = 0
        self._last_used: float | None = None
        self._last_refused: tuple[float, str] | None = None
        self._depth_share = 1.0
        self._age = 0.0

    def take(self, now: float, stamp: float, depth_share: float) -> None:
        """A pair of pictures was used."""
        self.used += 1
        self._last_used = now
        self._age = now - stamp
        self._depth_share += WEIGHT * (depth_share - self._depth_share)

    def refuse(self, now: float, reason: str) -> None:
        """A pair of pictures was not used."""
        self.refused += 1
        self._last_refused = (now, reason)

    def status(self, now: float) -> Status:
        """Return what is to be said at `now`."""
        values = {
            "pictures used": str(self.used),
            "pictures left out": str(self.refused),
            "age of the newest, s": f"{self._age:.3f}",
            "coloured pixels with depth": f"{self._depth_share:.2f}",
        }
        level, text = self._judge(now)
        return Status(level, text, values)

    def _judge(self, now: float) -> tuple[int, str]:
        if self._last_refused is not None and now - self._last_refused[0] <= RECENT:
            seen = self._last_used is not None and now - self._last_used <= RECENT
            return WARN if seen else ERROR, f"pictures are left out: {self._last_refused[1]}"
        if self._last_used is None:
            return ERROR, "no pictures have come yet"
        if now - self._last_used > RECENT:
            return ERROR, f"no pictures for {now - self._last_used:.1f} s"
        if self._depth_share < LITTLE_DEPTH:
            return WARN, "hardly any depth: places are inferred, no glove is recognised"
        return OK, "tracking"
