# SPDX-License-Identifier: BSD-3-Clause
"""Percepts of the hands and of the head brought together by their stamps."""

from collections.abc import Callable
from typing import Any, NamedTuple

KEPT = 20  # messages of a kind that wait; two seconds of percepts


class Pair(NamedTuple):
    """What was seen of hands and head at one moment, `stamp` ns."""

    stamp: int
    activity: Any
    head: Any


class StampPairing:
    """Gives every activity the head that was seen nearest to it in time.

    Two cameras do not share a shutter, so stamps may differ by up to `tolerance` ns; with 0 only
    equal stamps are a pair. An activity waits until a head of its own time or later has come, for
    `patience` later activities at most. Where no head was seen in time, `unseen(stamp)` says so;
    without it the activity is dropped.
    """

    def __init__(
        self, tolerance: int = 0, unseen: Callable[[int], Any] | None = None, patience: int = 3
    ) -> None:
        self._tolerance, self._unseen, self._patience = tolerance, unseen, patience
        self._activities: dict[int, Any] = {}
        self._heads: dict[int, Any] = {}

    def add_activity(self, stamp: int, message: Any) -> list[Pair]:
        """Add an activity stamped `stamp` (ns); return the complete pairs, oldest first."""
        self._activities[stamp] = message
        return self._complete()

    def add_head(self, stamp: int, message: Any) -> list[Pair]:
        """Add a head stamped `stamp` (ns); return the complete pairs, oldest first."""
        self._heads[stamp] = message
        return self._complete()

    def _complete(self) -> list[Pair]:
        pairs = []
        for stamp in sorted(self._activities):
            head = self._head_at(stamp)
            if head is not None:
                pairs.append(Pair(stamp, self._activities[stamp], head))
        if pairs:
            self._forget(pairs[-1].stamp)
        _keep_newest(self._activities)
        _keep_newest(self._heads)
        return pairs

    def _head_at(self, stamp: int) -> Any:
        """The head for an activity; None while a nearer one may still come, or there is none."""
        if stamp in self._heads:
            return self._heads[stamp]
        later = any(other > stamp for other in self._heads)
        tired = sum(other > stamp for other in self._activities) >= self._patience
        if self._tolerance == 0 or not (later or tired):
            return None
        near = min(self._heads, key=lambda other: abs(other - stamp), default=None)
        if near is not None and abs(near - stamp) <= self._tolerance:
            return self._heads[near]
        return None if self._unseen is None else self._unseen(stamp)

    def _forget(self, stamp: int) -> None:
        """Drop what is older than a pair just made; a head may serve one activity more."""
        self._activities = {at: kept for at, kept in self._activities.items() if at > stamp}
        least = stamp - self._tolerance
        self._heads = {at: kept for at, kept in self._heads.items() if at > least}


def _keep_newest(waiting: dict[int, Any]) -> None:
    while len(waiting) > KEPT:
        del waiting[min(waiting)]
