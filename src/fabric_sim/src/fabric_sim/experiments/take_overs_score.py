# SPDX-License-Identifier: BSD-3-Clause
"""How well scores tell accepted from warned take-overs: area under the ROC curve, intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fabric_sim.experiments.paired import Interval

DRAWS = 2000
TAILS = (2.5, 97.5)  # percentiles: a 95 % interval


def auc(scores: ArrayLike, positive: ArrayLike) -> float:
    """P(a positive scores above a negative), ties half; NaN without either. (n,) each.

    Raises ValueError for a score that is not finite.
    """
    scores, positive = np.asarray(scores, dtype=float), np.asarray(positive, dtype=bool)
    if not np.isfinite(scores).all():
        wrong = int(np.flatnonzero(~np.isfinite(scores))[0])
        raise ValueError(f"score [{wrong}] is {scores[wrong]}")
    if positive.all() or not positive.any():
        return math.nan
    return float(_above(scores, positive).mean())


def _above(scores: NDArray, positive: NDArray) -> NDArray:
    """(n_positive, n_negative): 1 where the positive scores above the negative, ties 1/2."""
    difference = scores[positive][:, None] - scores[~positive][None, :]
    return (np.sign(difference) + 1.0) / 2.0


def roc(scores: ArrayLike, positive: ArrayLike) -> tuple[NDArray, NDArray]:
    """The curve from (0, 0) to (1, 1): false and true positive rates, ties in one step."""
    scores, positive = np.asarray(scores, dtype=float), np.asarray(positive, dtype=bool)
    levels = np.unique(scores)[::-1]
    hits = np.array([0.0, *((scores[positive] >= level).mean() for level in levels)])
    alarms = np.array([0.0, *((scores[~positive] >= level).mean() for level in levels)])
    return alarms, hits


@dataclass(frozen=True)
class Groups:
    """Who each take-over belongs to: person and task, (n,) each."""

    person: tuple[str, ...]
    task: tuple[int, ...]

    def counts(self, rng: np.random.Generator) -> NDArray:
        """(n,): how often each take-over is in a resample of people, then of their tasks."""
        tasks: dict[str, dict[int, list[int]]] = {}
        for i, (person, task) in enumerate(zip(self.person, self.task, strict=True)):
            tasks.setdefault(person, {}).setdefault(task, []).append(i)
        people, counts = list(tasks.values()), np.zeros(len(self.person))
        for drawn in rng.integers(len(people), size=len(people)):
            own = list(people[drawn].values())
            for task in rng.integers(len(own), size=len(own)):
                counts[own[task]] += 1.0
        return counts


def resamples(groups: Groups, seed: int, draws: int = DRAWS) -> NDArray:
    """(draws, n) counts of the bootstrap; one table serves all scores, so that they are paired."""
    rng = np.random.default_rng(seed)
    return np.array([groups.counts(rng) for _ in range(draws)])


def resampled_auc(scores: ArrayLike, positive: ArrayLike, counts: NDArray) -> NDArray:
    """(draws,) areas of the resamples, NaN where one of the outcomes is missing."""
    scores, positive = np.asarray(scores, dtype=float), np.asarray(positive, dtype=bool)
    with np.errstate(invalid="ignore"):
        hits, misses = counts[:, positive], counts[:, ~positive]
        pairs = hits.sum(axis=1) * misses.sum(axis=1)
        return ((hits @ _above(scores, positive)) * misses).sum(axis=1) / pairs


def interval(value: float, draws: NDArray) -> Interval:
    """A percentile interval around a value; NaN ends without a draw that has one."""
    finite = draws[np.isfinite(draws)]
    if finite.size == 0 or not math.isfinite(value):
        return Interval(value, math.nan, math.nan)
    low, high = np.percentile(finite, TAILS)
    return Interval(value, float(low), float(high))


def within_people(scores: ArrayLike, positive: ArrayLike, people: Sequence[str]) -> float:
    """P(a positive scores above a negative of the same person), ties half; NaN without a pair."""
    scores, positive = np.asarray(scores, dtype=float), np.asarray(positive, dtype=bool)
    who = np.array(people)
    same = who[positive][:, None] == who[~positive][None, :]
    return float(_above(scores, positive)[same].mean()) if same.any() else math.nan
