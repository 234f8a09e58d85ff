# SPDX-License-Identifier: BSD-3-Clause
"""Hands and head as one behaviour: what lies between two of them is not observed."""

from fabric_msgs.msg import HumanActivity
from fabric_perception.recognition import Reading


class JointHysteresis:
    """Passes a change of hands or head on when both have said the same for some readings in a row.

    A person who stops looking around and reaches out does so in one movement, but its halves are
    recognised apart: the turn of the head sooner than the gesture. In between such a person seems
    to be idle and attentive, which is no behaviour of theirs. Presence and warnings pass at once;
    a helmet out of view counts as where it was.
    """

    def __init__(self, percepts: int) -> None:
        """percepts: equal readings in a row; 1 passes everything on."""
        self._percepts = percepts
        self._passed: Reading | None = None
        self._newest: tuple[int, bool | None] | None = None
        self._count = 0
        self._looking: bool | None = None

    def feed(self, reading: Reading) -> Reading:
        """Take a reading; return what may be believed now. The very first passes."""
        if reading.looking_around is not None:
            self._looking = reading.looking_around
        newest = (reading.gesture, self._looking)
        self._count = self._count + 1 if newest == self._newest else 1
        self._newest = newest
        warns = reading.gesture == HumanActivity.WARN
        if self._passed is None or warns or self._count >= self._percepts:
            self._passed = reading
        return self._passed._replace(detected=reading.detected)
