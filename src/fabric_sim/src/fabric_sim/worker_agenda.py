# SPDX-License-Identifier: BSD-3-Clause
"""What a worker is about to do and about to notice, in order of time."""

from __future__ import annotations

from collections.abc import Callable

NEVER = float("inf")
_SLACK = 1e-9  # s, so that a tick at exactly the planned time counts as reached

Handler = Callable[[float], None]


class Agenda:
    """The remaining pieces of one action, plus at most one thing that will be noticed.

    `until` is the time in s of the next of them, NEVER when there is none.
    """

    def __init__(self) -> None:
        self._pieces: list[tuple[float, Handler]] = []
        self._notice: Handler | None = None
        self._notice_at = NEVER
        self.until = NEVER

    def __bool__(self) -> bool:
        """Whether pieces of an action remain; a notice does not count."""
        return bool(self._pieces)

    @property
    def next_piece(self) -> float:
        """When the present piece of the action ends, s; NEVER when there is none."""
        return self._pieces[0][0] if self._pieces else NEVER

    def add(self, at: float, handler: Handler) -> None:
        """Append a piece at time `at` (s), not before the pieces already there."""
        self._pieces.append((at, handler))
        self._update()

    def clear(self) -> None:
        """Forget the action; what will be noticed stays."""
        self._pieces.clear()
        self._update()

    def notice(self, at: float, handler: Handler) -> None:
        """Let something be noticed at time `at` (s) in place of what was to be noticed."""
        self._notice, self._notice_at = handler, at
        self._update()

    def drop_notice(self) -> None:
        """Nothing will be noticed."""
        self._notice, self._notice_at = None, NEVER
        self._update()

    def run(self, t: float) -> None:
        """Call everything due at time t (s), notices first; handlers may change the agenda."""
        while self.until <= t + _SLACK:
            if self._notice is not None and self._notice_at <= t + _SLACK:
                handler = self._notice
                self.drop_notice()
            else:
                handler = self._pieces.pop(0)[1]
                self._update()
            handler(t)

    def _update(self) -> None:
        self.until = min(self.next_piece, self._notice_at)
