# SPDX-License-Identifier: BSD-3-Clause
"""The observation model P(sigma | tau, pi) (Definition 2) over the 64 type observation codes."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import gammaln

from fabric_abps.signals import N_CODES

QUANTILES = 100  # points of the stored distribution of the typicality statistic


def count_codes(codes: ArrayLike) -> NDArray:
    """How often each code occurs, (64,). Raises ValueError naming a code outside 0..63."""
    array = np.asarray(codes)
    if array.size == 0:
        return np.zeros(N_CODES, dtype=np.int64)
    if not np.issubdtype(array.dtype, np.integer):
        raise ValueError(f"codes must be integers, got {array.dtype}")
    wrong = np.flatnonzero((array < 0) | (array >= N_CODES))
    if wrong.size:
        raise ValueError(f"code [{wrong[0]}] is {array[wrong[0]]}, outside 0..{N_CODES - 1}")
    return np.bincount(array, minlength=N_CODES)


class ObservationModel:
    """Dirichlet-multinomial over codes for n_types x n_policies pairs.

    The prior of every pair is Dirichlet(concentration * pooled), where pooled are the frequencies
    over all pairs with one pseudo-count a code, so a code never seen with one type is as unlikely
    as it is rare everywhere.
    """

    def __init__(
        self, counts: ArrayLike, typicality: ArrayLike, concentration: float = 16.0
    ) -> None:
        """Code counts of the training, (n_types, n_policies, 64), and ascending quantiles of the
        mean log-likelihood of a task under its own pair, (n_types, n_policies, n_quantiles) nats.

        Raises ValueError when something is negative, not finite or of the wrong shape.
        """
        self.counts = np.asarray(counts, dtype=np.int64)
        self.typicality = np.asarray(typicality, dtype=float)
        if self.counts.ndim != 3 or self.counts.shape[2] != N_CODES:
            raise ValueError(f"counts must be (n_types, n_policies, {N_CODES})")
        if (self.counts < 0).any():
            raise ValueError("counts must not be negative")
        if self.typicality.ndim != 3 or self.typicality.shape[:2] != self.counts.shape[:2]:
            raise ValueError("typicality must be (n_types, n_policies, n_quantiles)")
        if not np.isfinite(self.typicality).all():
            raise ValueError("typicality holds a number that is not finite")
        if not (np.isfinite(concentration) and concentration > 0):
            raise ValueError(f"concentration must be positive, got {concentration}")
        self.concentration = float(concentration)
        pooled = self.counts.sum(axis=(0, 1)) + 1.0
        self._alpha = self.counts + concentration * pooled / pooled.sum()

    @classmethod
    def fit(
        cls, tasks: Sequence[Sequence[Sequence[Any]]], concentration: float = 16.0
    ) -> "ObservationModel":
        """From the code sequences of the training tasks, tasks[type][policy][task]: (n_codes,)."""
        counted = [
            [_count_tasks(pair, i, j) for j, pair in enumerate(row)] for i, row in enumerate(tasks)
        ]
        counts = np.array([[pair.sum(axis=0) for pair in row] for row in counted])
        model = cls(counts, np.zeros(counts.shape[:2] + (1,)), concentration)
        model.typicality = np.array(
            [
                [_leave_one_out(model._alpha[i, j], pair) for j, pair in enumerate(row)]
                for i, row in enumerate(counted)
            ]
        )
        return model

    def probability(self, policy: int) -> NDArray:
        """Predictive probability of the next code under a policy, (n_types, 64)."""
        alpha = self._alpha[:, policy]
        return alpha / alpha.sum(axis=1, keepdims=True)

    def log_likelihood(self, codes: ArrayLike, policy: int, effective: float = np.inf) -> NDArray:
        """ln P(sigma | tau, pi) of a task's codes for every type, (n_types,) nats.

        Successive observations of one task are anything but independent, so their product would
        decide after a single task. A task of n codes weighs like min(n, effective) of them.
        """
        if not effective > 0:
            raise ValueError(f"effective must be positive, got {effective}")
        counts = count_codes(codes)
        n = int(counts.sum())
        if n == 0:
            return np.zeros(self.counts.shape[0])
        return min(1.0, effective / n) * _dirichlet_multinomial(self._alpha[:, policy], counts)

    def p_values(self, codes: ArrayLike, policy: int) -> NDArray:
        """How typical a task is of every type, (n_types,) in (0, 1].

        The share of training tasks of the pair, each scored by a model that has not seen it,
        whose mean log-likelihood was no larger: uniform over [0, 1] for a person of that type.
        """
        counts = count_codes(codes)
        n = max(int(counts.sum()), 1)
        statistic = _dirichlet_multinomial(self._alpha[:, policy], counts) / n
        reference = self.typicality[:, policy]
        below = (reference <= statistic[:, None]).sum(axis=1)
        return (below + 1.0) / (reference.shape[1] + 1.0)


def _dirichlet_multinomial(alpha: NDArray, counts: NDArray) -> NDArray:
    """ln probability of an ordered sequence with these counts; codes along the last axis."""
    n = counts.sum(axis=-1)
    total = alpha.sum(axis=-1)
    each = gammaln(alpha + counts) - gammaln(alpha)
    return each.sum(axis=-1) - gammaln(total + n) + gammaln(total)


def _count_tasks(pair: Sequence[Any], type_index: int, policy: int) -> NDArray:
    """Code counts of the tasks of a pair, (n_tasks, 64)."""
    if len(pair) == 0:
        raise ValueError(f"type {type_index}, policy {policy}: no training task")
    rows = []
    for number, codes in enumerate(pair):
        try:
            rows.append(count_codes(codes))
        except ValueError as error:
            place = f"type {type_index}, policy {policy}, task {number}"
            raise ValueError(f"{place}: {error}") from error
    return np.array(rows)


def _leave_one_out(alpha: NDArray, tasks: NDArray) -> NDArray:
    """Quantiles of the mean log-likelihood of a task given the others, (QUANTILES,) nats."""
    n = np.maximum(tasks.sum(axis=1), 1)
    statistic = _dirichlet_multinomial(alpha - tasks, tasks) / n
    levels = (np.arange(QUANTILES) + 0.5) / QUANTILES
    return np.quantile(statistic, levels)
