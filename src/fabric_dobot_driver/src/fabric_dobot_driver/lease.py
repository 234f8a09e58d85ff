# SPDX-License-Identifier: BSD-3-Clause
"""Who may move the arm has to say again and again that it is alive."""

import math


class Lease:
    """Holds for `term` seconds after each beat; before the first one it does not hold."""

    def __init__(self, term: float) -> None:
        self.term = term
        self._until = -math.inf

    def renew(self, now: float) -> None:
        """The holder was heard at time `now` (monotonic, s)."""
        self._until = now + self.term

    def holds(self, now: float) -> bool:
        """Whether the holder was heard within the term before `now`."""
        return now < self._until

    @property
    def ends(self) -> float:
        """When it lapses unless it is renewed, s."""
        return self._until
