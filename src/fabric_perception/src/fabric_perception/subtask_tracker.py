# SPDX-License-Identifier: BSD-3-Clause
"""What the observation agent remembers of the current subtask."""

import math

RESOLUTION = 1e-6  # s; times are compared to this resolution


class SubtaskTracker:
    """Clock of the subtask, waiting time and grasp attempts that came to nothing. Times in s.

    Load cells are slow, so an attempt that has ended counts as failed only when the containers
    have had their time to settle, or when the person reaches again.
    """

    def __init__(self, settling_time: float) -> None:
        self._settling_time = settling_time
        self._started: float | None = None
        self._waiting_since: float | None = None
        self._warning = False
        self._attempting = False
        self._attempt_ended: float | None = None  # an attempt whose outcome is open
        self.failed_attempts = 0

    @property
    def active(self) -> bool:
        """Whether a cube waits to be dealt with."""
        return self._started is not None

    def start(self, t: float, grasping: bool) -> None:
        """A cube has arrived: the clocks start; a person reaching already reaches for it."""
        self._started = t
        self._waiting_since = t
        self._attempting = grasping

    def end(self) -> None:
        """The cube is gone, and with it every attempt at it."""
        self._started = None
        self._waiting_since = None
        self._forget_attempts()

    def grasp_begins(self) -> None:
        """A grasp attempt is recognised; the one before has failed if its outcome was open."""
        self._attempting = True
        if self._attempt_ended is not None:
            self._fail()

    def grasp_ends(self, t: float) -> None:
        """The attempt is over; a placement may still be reported."""
        if self._attempting:
            self._attempt_ended = t
        self._attempting = False

    def pass_time(self, t: float, warning: bool) -> None:
        """Go on to `t`, told whether a warning lasts; it wipes attempts and holds the waiting."""
        if warning:
            self._forget_attempts()
        if (warning or self._warning) and self._started is not None:
            self._waiting_since = t
        self._warning = warning
        ended = self._attempt_ended
        if ended is not None and t - ended >= self._settling_time - RESOLUTION:
            self._fail()

    @property
    def fails_at(self) -> float:
        """When an attempt whose outcome is open will have failed, s; else infinite."""
        ended = self._attempt_ended
        return math.inf if ended is None else ended + self._settling_time

    def elapsed(self, t: float) -> float:
        """Time since the subtask began, 0 while no cube is there."""
        return 0.0 if self._started is None else t - self._started

    def waiting(self, t: float) -> float:
        """Time since the subtask began or the last warning ended, whichever is later.

        0 while no cube is there or a warning lasts.
        """
        if self._waiting_since is None or self._warning:
            return 0.0
        return t - self._waiting_since

    def _fail(self) -> None:
        self.failed_attempts += 1
        self._attempt_ended = None

    def _forget_attempts(self) -> None:
        self._attempting = False
        self._attempt_ended = None
        self.failed_attempts = 0
