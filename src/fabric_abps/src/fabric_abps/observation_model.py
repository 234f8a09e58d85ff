# SPDX-License-Identifier: BSD-3-Clause
"""The observation model P(sigma | tau, pi) (Definition 2) over the 64 type observation codes.

sigma is the sequence of codes of one task. Its order is kept: a first-order Markov chain from a
start symbol. docs/models/abps.md has the held-out likelihoods by which this was chosen.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fabric_abps.signals import N_CODES

START = N_CODES  # what stands before the first code of a task
QUANTILES = 100  # points of the stored distribution of the typicality statistic


def check_codes(codes: ArrayLike) -> NDArray:
    """The codes as integers, (n_codes,). Raises ValueError naming a code outside 0..63."""
    array = np.asarray(codes)
    if array.ndim != 1:
        raise ValueError(f"codes must be a sequence of integers, got shape {array.shape}")
    if array.size == 0:
        return np.zeros(0, dtype=np.int64)
    if not np.issubdtype(array.dtype, np.integer):
        raise ValueError(f"codes must be integers, got {array.dtype}")
    wrong = np.flatnonzero((array < 0) | (array >= N_CODES))
    if wrong.size:
        raise ValueError(f"code [{wrong[0]}] is {array[wrong[0]]}, outside 0..{N_CODES - 1}")
    return array.astype(np.int64)


def task_weight(count: int, effective: float) -> float:
    """Share of its log-likelihood that a task of so many observations counts with, (0, 1].

    A person is never exactly one of the known types, and what somebody does in a task hangs
    together more than the model knows, so the plain product would decide after a single task: it
    weighs like at most `effective` of its observations.
    """
    return min(1.0, effective / max(count, 1))


class ObservationModel:
    """A Markov chain over codes for each of n_types x n_policies pairs.

    With n(a, b) transitions of a pair seen in the training, N(a, b) of all pairs together, and c
    the concentration,

        P(b | a, tau, pi) = (n(a, b) + c Q(b | a)) / (n(a) + c)
        Q(b | a)          = (N(a, b) + c R(b)) / (N(a) + c),   R(b) = (N(b) + 1) / (N + 64):

    what a pair has seldom seen is as likely as it is with everybody, in this order, else in any.
    """

    def __init__(
        self, counts: ArrayLike, typicality: ArrayLike, concentration: float = 16.0
    ) -> None:
        """Transition counts of the training, (n_types, n_policies, 65, 64) from a code or START to
        a code, and ascending quantiles of the mean log-likelihood a code of a task under its own
        pair, (n_types, n_policies, n_quantiles) nats.

        Raises ValueError when something is negative, not finite or of the wrong shape.
        """
        self.counts = np.asarray(counts)
        self.typicality = np.asarray(typicality, dtype=float)
        if self.counts.ndim != 4 or self.counts.shape[2:] != (N_CODES + 1, N_CODES):
            raise ValueError(f"counts must be (n_types, n_policies, {N_CODES + 1}, {N_CODES})")
        if not np.issubdtype(self.counts.dtype, np.integer):
            raise ValueError(f"counts must be integers, got {self.counts.dtype}")
        if (self.counts < 0).any():
            raise ValueError("counts must not be negative")
        if self.typicality.ndim != 3 or self.typicality.shape[:2] != self.counts.shape[:2]:
            raise ValueError("typicality must be (n_types, n_policies, n_quantiles)")
        if not np.isfinite(self.typicality).all():
            raise ValueError("typicality holds a number that is not finite")
        if not (np.isfinite(concentration) and concentration > 0):
            raise ValueError(f"concentration must be positive, got {concentration}")
        self.concentration = float(concentration)
        self._everybody = everybody(self.counts.sum(axis=(0, 1)), self.concentration)
        self._log: dict[int, NDArray] = {}  # (n_types, 65, 64) nats by policy

    @classmethod
    def fit(
        cls,
        codes: Sequence[Sequence[Sequence[Any]]],
        concentration: float = 16.0,
        people: Sequence[Sequence[ArrayLike]] | None = None,
    ) -> "ObservationModel":
        """From the training tasks: codes[type][policy][task] is a sequence of codes.

        people[type][policy]: (n_tasks,) who did each task; without it everybody did one. Raises
        ValueError naming type, policy and task of a wrong code, or of a table that is not full.
        """
        if not codes or not codes[0] or len({len(row) for row in codes}) != 1:
            raise ValueError("codes must be a full table [type][policy]")
        checked = [
            [_check_pair(pair, i, j) for j, pair in enumerate(row)] for i, row in enumerate(codes)
        ]
        counts = np.array([[_transitions(pair) for pair in row] for row in checked])
        n_types, n_policies = counts.shape[:2]
        model = cls(counts, np.zeros((n_types, n_policies, QUANTILES)), concentration)
        for i, j in np.ndindex(n_types, n_policies):
            pair = checked[i][j]
            who = range(len(pair)) if people is None else people[i][j]
            model.typicality[i, j] = model._held_out(counts[i, j], pair, np.asarray(who))
        return model

    def probability(self, policy: int) -> NDArray:
        """P(next code | code before it) under a policy, (n_types, 65, 64); row 64 begins a task."""
        return np.exp(self._log_probability(policy))

    def contributions(self, codes: ArrayLike, policy: int, previous: int | None = None) -> NDArray:
        """ln P(code | the one before, tau, pi) of every code, (n_codes, n_types) nats.

        previous: the code before the first of these; None begins a task. The sum over a prefix is
        the log-likelihood of the prefix.
        """
        codes = check_codes(codes)
        before = np.concatenate(([START if previous is None else previous], codes))[:-1]
        return self._log_probability(policy)[:, before, codes].T

    def log_likelihood(
        self,
        codes: ArrayLike,
        policy: int,
        effective: float = np.inf,
        previous: int | None = None,
    ) -> NDArray:
        """ln P(sigma | tau, pi) of a task's codes for every type, (n_types,) nats.

        effective: see task_weight. previous: as in contributions.
        """
        if not effective > 0:
            raise ValueError(f"effective must be positive, got {effective}")
        parts = self.contributions(codes, policy, previous)
        return task_weight(len(parts), effective) * parts.sum(axis=0)

    def p_values(self, codes: ArrayLike, policy: int) -> NDArray:
        """How typical a task is of every type, (n_types,) in (0, 1].

        The share of training tasks of the pair, each scored by a model that has not seen the person
        who did it, whose mean log-likelihood was no larger: uniform over [0, 1] for a new person of
        that type.
        """
        parts = self.contributions(codes, policy)
        statistic = parts.sum(axis=0) / max(len(parts), 1)
        reference = self.typicality[:, policy]
        below = (reference <= statistic[:, None]).sum(axis=1)
        return (below + 1.0) / (reference.shape[1] + 1.0)

    def _log_probability(self, policy: int) -> NDArray:
        if policy not in self._log:
            self._log[policy] = self._smoothed(self.counts[:, policy])
        return self._log[policy]

    def _smoothed(self, counts: NDArray) -> NDArray:
        """ln P(b | a) from transition counts (..., 65, 64)."""
        c = self.concentration
        total = counts.sum(axis=-1, keepdims=True)
        return np.log(counts + c * self._everybody) - np.log(total + c)

    def _held_out(self, counts: NDArray, pair: Sequence[NDArray], who: NDArray) -> NDArray:
        """Quantiles of the mean log-likelihood of a task given those of others, (QUANTILES,)."""
        if len(set(who.tolist())) < 2:  # one person: at least not the task itself
            who = np.arange(len(pair))
        statistic = []
        for person in dict.fromkeys(who.tolist()):
            own = [pair[task] for task in np.flatnonzero(who == person)]
            log = self._smoothed(counts - _transitions(own))
            for codes in own:
                statistic.append(log[_before(codes), codes].sum() / max(len(codes), 1))
        return np.quantile(statistic, (np.arange(QUANTILES) + 0.5) / QUANTILES)


def everybody(counts: NDArray, concentration: float) -> NDArray:
    """Q(b | a) of ObservationModel from the counts of all pairs, both (n_rows, n_columns)."""
    unordered = counts.sum(axis=0) + 1.0
    R = unordered / unordered.sum()
    return (counts + concentration * R) / (counts.sum(axis=1, keepdims=True) + concentration)


def _before(codes: NDArray) -> NDArray:
    """What stands before each code of a task, (n_codes,)."""
    return np.concatenate(([START], codes))[:-1]


def _transitions(tasks: Sequence[NDArray]) -> NDArray:
    """How often each code followed each, (65, 64)."""
    places = [_before(codes) * N_CODES + codes for codes in tasks]
    flat = np.concatenate(places) if places else np.zeros(0, dtype=np.int64)
    counted = np.bincount(flat, minlength=(N_CODES + 1) * N_CODES)
    return counted.reshape(N_CODES + 1, N_CODES).astype(np.int32)


def _check_pair(pair: Sequence[Any], type_index: int, policy: int) -> list[NDArray]:
    """The codes of the tasks of a pair, each (n_codes,)."""
    if len(pair) == 0:
        raise ValueError(f"type {type_index}, policy {policy}: no training task")
    tasks = []
    for number, codes in enumerate(pair):
        try:
            tasks.append(check_codes(codes))
        except ValueError as error:
            place = f"type {type_index}, policy {policy}, task {number}"
            raise ValueError(f"{place}: {error}") from error
    return tasks
