# SPDX-License-Identifier: BSD-3-Clause
"""What the observation agent remembers of the current subtask."""


class SubtaskTracker:
    """Clock of the subtask, waiting time and grasp attempts that came to nothing. Times in s."""

    def __init__(self) -> None:
        self._started: float | None = None
        self._waiting_since: float | None = None
        self._attempting = False
        self._warning = False
        self.failed_attempts = 0

    def start(self, t: float, grasping: bool) -> None:
        """A cube has arrived: the clocks start; a person reaching already reaches for it."""
        self._started = t
        self._waiting_since = t
        self._attempting = grasping

    def end(self) -> None:
        """The cube is gone. An attempt in progress was for that cube, so it counts no more."""
        self._started = None
        self._waiting_since = None
        self._attempting = False
        self.failed_attempts = 0

    def grasp_begins(self) -> None:
        """A grasp attempt is recognised."""
        self._attempting = True

    def grasp_ends(self) -> None:
        """The attempt is over and no placement ended the subtask meanwhile: it has failed."""
        if self._attempting:
            self.failed_attempts += 1
        self._attempting = False

    def warn(self, t: float, warning: bool) -> None:
        """Tell whether a warning lasts at `t`; it wipes the attempts and restarts the waiting."""
        if warning:
            self.failed_attempts = 0
            self._attempting = False
        if (warning or self._warning) and self._started is not None:
            self._waiting_since = t
        self._warning = warning

    def elapsed(self, t: float) -> float:
        """Time since the subtask began, 0 while no cube is there."""
        return 0.0 if self._started is None else t - self._started

    def waiting(self, t: float) -> float:
        """Time since the subtask began or the last warning ended, whichever is later."""
        return 0.0 if self._waiting_since is None else t - self._waiting_since
