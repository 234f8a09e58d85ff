# SPDX-License-Identifier: BSD-3-Clause
"""The predictive check: is this person unlike every known type?"""

from collections import deque

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import gammaincc

from fabric_abps.kept import rows


class Familiarity:
    """Looks back on the latest tasks.

    Fisher's method: -2 sum ln p over w tasks is chi-square with 2 w degrees of freedom for a
    person of that type. The flag is up when even the best fitting type stays below `rate`, so a
    known person raises it with probability `rate` at most.
    """

    def __init__(self, rate: float, window: int) -> None:
        """rate in (0, 1): of false alarms; window >= 1: tasks."""
        self.rate = rate
        self._p_values: deque[NDArray] = deque(maxlen=window)

    def reset(self) -> None:
        """A new person."""
        self._p_values.clear()

    def take(self, p_values: ArrayLike) -> None:
        """Take how typical a task was of every type, (n_types,) in (0, 1]."""
        self._p_values.append(np.asarray(p_values, dtype=float))

    @property
    def typicality(self) -> float:
        """Probability that the best fitting type looks this strange, [0, 1]."""
        w = len(self._p_values)
        if w == 0:
            return 1.0
        statistic = -np.log(np.array(self._p_values)).sum(axis=0)
        return float(gammaincc(w, statistic).max())

    @property
    def alarm(self) -> bool:
        """Whether the person is unlike everybody known."""
        return self.typicality < self.rate

    def state(self) -> list[list[float]]:
        """The p-values of the latest tasks, (n_tasks, n_types)."""
        return [values.tolist() for values in self._p_values]

    def restore(self, state: ArrayLike, n_types: int) -> None:
        """Go on from a `state`. Raises ValueError when it holds anything else."""
        values = rows("p_values", state, n_types)
        if not ((values > 0) & (values <= 1)).all():
            raise ValueError("p_values must be in (0, 1]")
        self.reset()
        self._p_values.extend(values)
