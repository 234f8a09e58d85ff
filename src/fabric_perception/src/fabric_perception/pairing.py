# SPDX-License-Identifier: BSD-3-Clause
"""Messages of several topics brought together by their stamp."""

from typing import Any

KEPT = 20  # stamps; two seconds of percepts


class StampPairing:
    """Collects messages of the named kinds until all of one stamp are there."""

    def __init__(self, *kinds: str) -> None:
        self._kinds = kinds
        self._waiting: dict[int, dict[str, Any]] = {}

    def add(self, kind: str, stamp: int, message: Any) -> dict[str, Any] | None:
        """Add a message stamped `stamp` (ns); return the set by kind when it is complete.

        A complete set drops everything older; so do more than KEPT incomplete ones.
        """
        entry = self._waiting.setdefault(stamp, {})
        entry[kind] = message
        if len(entry) == len(self._kinds):
            self._waiting = {key: kept for key, kept in self._waiting.items() if key > stamp}
            return entry
        while len(self._waiting) > KEPT:
            del self._waiting[min(self._waiting)]
        return None
