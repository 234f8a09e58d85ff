# SPDX-License-Identifier: BSD-3-Clause
"""The best constant policy for each person in hindsight, which the oracle plays.

Policies differ by tenths of a point and a task varies by about two, so the person's own tasks alone
would mostly name a lucky policy. What a policy earns is therefore taken to be a smooth function of
the four dials plus something of the person's own, and estimated from everybody (empirical Bayes).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fabric_sim.character import Character

#: Halving of the candidates: share of the policies that goes on, shifts more for each.
ROUNDS = ((1.0, 1), (0.25, 1), (0.15, 1))
SHIFTS_TO_JUDGE = sum(more for _, more in ROUNDS)
LEAST = 2  # policies of a round
RIDGE = 0.3  # penalty of the smooth function
FITS = 5  # of the function and of how far people depart from it, in turn
SHARED = 10.0  # shifts that all policies together count in the scatter between shifts of one

#: rewards of places (person, policy): mean reward of the shifts numbered from .. to, (n, n_shifts)
Judge = Callable[[list[tuple[int, int]], int, int], np.ndarray]


@dataclass(frozen=True)
class Hindsight:
    """best: (n_people,) names; shifts: how many the finalists were judged by; rewards: (n_people,
    n_policies) estimated mean reward of a task.
    """

    best: list[str]
    shifts: int
    rewards: np.ndarray

    def part(self, start: int, end: int) -> Hindsight:
        """Return the people numbered from `start` up to `end`."""
        return Hindsight(self.best[start:end], self.shifts, self.rewards[start:end])


def best_in_hindsight(names: Sequence[str], people: Sequence[Character], judge: Judge) -> Hindsight:
    """Judge all policies with everybody, then with each person the better ones again."""
    sums, squares, counts = (np.zeros((len(people), len(names))) for _ in range(3))
    estimate, used = np.zeros_like(sums), 0
    for share, more in ROUNDS:
        keep = min(len(names), max(LEAST, math.ceil(share * len(names))))
        alive = np.argsort(-estimate, axis=1, kind="stable")[:, :keep]
        places = [(p, int(i)) for p, own in enumerate(alive) for i in sorted(own)]
        found = judge(places, used, used + more)
        at = tuple(np.array(places).T)
        sums[at] += found.sum(axis=1)
        squares[at] += (found**2).sum(axis=1)
        counts[at] += more
        used += more
        estimate = estimated(people, sums, squares, counts)
    finalists = np.where(counts == counts.max(axis=1, keepdims=True), estimate, -np.inf)
    return Hindsight([names[int(i)] for i in finalists.argmax(axis=1)], used, estimate)


def estimated(
    people: Sequence[Character], sums: np.ndarray, squares: np.ndarray, counts: np.ndarray
) -> np.ndarray:
    """Return the mean reward of each policy with each person, (n_people, n_policies) points.

    sums, squares, counts: of the mean rewards of shifts, of the same shape; counts are 1 or more.
    """
    features, within = _features(people), _within(sums, squares, counts)
    columns = [
        _of_policy(features, sums[:, i] / counts[:, i], counts[:, i], within[i])
        for i in range(sums.shape[1])
    ]
    return np.column_stack(columns)


def _within(sums: np.ndarray, squares: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """(n_policies,): variance between shifts of a person; NaN while nobody worked two of them."""
    scatter = np.maximum(0.0, squares - sums**2 / counts).sum(axis=0)
    again = (counts - 1.0).sum(axis=0)
    if again.sum() == 0.0:
        return np.full(len(again), np.nan)
    shared = scatter.sum() / again.sum()
    return (scatter + SHARED * shared) / (again + SHARED)


def _features(people: Sequence[Character]) -> np.ndarray:
    """(n_people, 15): 1, the dials about their middle, their squares and products."""
    dials = np.array([person.dials for person in people]) - 0.5
    products = [dials[:, a] * dials[:, b] for a in range(4) for b in range(a + 1)]
    return np.column_stack([np.ones(len(dials)), dials, *products])


def _of_policy(
    features: np.ndarray, mean: np.ndarray, counts: np.ndarray, within: float
) -> np.ndarray:
    """Return the estimate for everybody. Half of the departures from the smooth function are taken
    for chance as long as `within` is not known.
    """
    penalty = RIDGE * np.eye(features.shape[1])
    penalty[0, 0] = 0.0
    own = float(mean.var())  # variance of what is the person's own, first guess
    for _ in range(FITS):
        noise = (own if math.isnan(within) else within) / counts  # variance of each mean
        weight = 1.0 / np.maximum(own + noise, 1e-9)
        weight /= weight.mean()
        weighted = features * weight[:, None]
        smooth = features @ np.linalg.solve(features.T @ weighted + penalty, weighted.T @ mean)
        departure = (mean - smooth) ** 2
        chance = departure / 2.0 if math.isnan(within) else noise
        own = max(0.0, float((weight * (departure - chance)).mean()))
    total = own + noise
    return smooth + np.divide(own, total, out=np.ones_like(total), where=total > 0) * (
        mean - smooth
    )
