# SPDX-License-Identifier: BSD-3-Clause
"""A labelled recording of one person's hand: what gestures are trained on and judged by."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fabric_perception.gestures.checks import Array

LABELS = ("idle", "grasp", "warn", "other")  # in the order of HumanActivity's constants
IDLE, GRASP, WARN, OTHER = range(len(LABELS))
UNLABELLED = -1  # the person is not there, or nobody said what is done


@dataclass(frozen=True)
class Recording:
    """What a tracker said of one person's hand, and what the hand did. Frame cell, m and s.

    person: code of the person. t: (n,) increasing. hand: (n, 3), rows of NaN where no hand was
    seen. target: (n, 3) the object of interest, rows of NaN where there was none. labels: (n,)
    index into LABELS, or UNLABELLED. situation: in which it was taken, for separate figures. Raises
    ValueError naming the recording, field, row and value.
    """

    person: str
    t: Array
    hand: Array
    target: Array
    labels: npt.NDArray[np.int64]
    situation: str = ""

    def __post_init__(self) -> None:
        n = len(self.t)
        if n == 0:
            raise ValueError(f"recording of {self.person!r} is empty")
        for name, shape in (("t", (n,)), ("hand", (n, 3)), ("target", (n, 3)), ("labels", (n,))):
            if getattr(self, name).shape != shape:
                raise ValueError(
                    f"recording of {self.person!r}: {name} has shape "
                    f"{getattr(self, name).shape}; it must be {shape}"
                )
        self._check_times()
        self._check_rows("hand")
        self._check_rows("target")
        known = range(UNLABELLED, len(LABELS))
        for row in np.flatnonzero(~np.isin(self.labels, known)):
            raise ValueError(f"recording of {self.person!r}: labels[{row}] is {self.labels[row]}")

    def _check_times(self) -> None:
        if not np.all(np.isfinite(self.t)):
            row = int(np.flatnonzero(~np.isfinite(self.t))[0])
            raise ValueError(f"recording of {self.person!r}: t[{row}] is {self.t[row]}")
        back = np.flatnonzero(np.diff(self.t) <= 0.0)
        if len(back):
            row = int(back[0]) + 1
            raise ValueError(
                f"recording of {self.person!r}: t[{row}] is {self.t[row]} s, "
                "not after the one before"
            )

    def _check_rows(self, name: str) -> None:
        """A row is all numbers or all NaN."""
        values = getattr(self, name)
        good = np.isfinite(values).all(axis=1) | np.isnan(values).all(axis=1)
        for row in np.flatnonzero(~good):
            raise ValueError(f"recording of {self.person!r}: {name}[{row}] is {values[row]}")
