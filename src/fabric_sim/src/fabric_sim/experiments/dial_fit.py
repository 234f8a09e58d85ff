# SPDX-License-Identifier: BSD-3-Clause
"""The four dials of a person from recorded trials: maximum likelihood, intervals, prediction.

The likelihood is explored by adaptive importance sampling: points are drawn over the whole square
of dials first, then where they explain the trials. The best point is polished on a local quadratic.
The sampled likelihood, a posterior under a flat prior, gives the 95 % intervals. Log-likelihoods
are kept per trial, so that leaving trials out costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.stats import beta as beta_distribution
from scipy.stats import qmc

from fabric_sim.character import CORNERS, Character

DIALS = ("expertise", "stamina", "attention", "collaborativeness")
LEVEL = 0.95
_FIRST, _ROUND, _ROUNDS, _POLISH = 112, 64, 4, 2
_NEAR = 70  # points for the local quadratic, which has 15 coefficients

#: (N, 4) dials -> (n_trials, N) log-likelihoods.
Scores = Callable[[Sequence[Character]], np.ndarray]


@dataclass(frozen=True)
class Fit:
    """Dials of one person: best (4,), least and most (4,) of the 95 % interval, mean (4,).

    log_likelihood: at `best`, of the trials fitted. effective: effective number of sampled points.
    """

    best: np.ndarray
    least: np.ndarray
    most: np.ndarray
    mean: np.ndarray
    log_likelihood: float
    effective: float


class Exploration:
    """The likelihood of a person's trials, sampled over the dials."""

    def __init__(self, scores: Scores, seed: int) -> None:
        """scores: per-trial log-likelihoods; seed: of the sampling."""
        self._scores = scores
        self._rng = np.random.default_rng(seed)
        self._proposals: list[tuple[int, np.ndarray]] = []  # how many points, beta (2, 4)
        self.points = np.empty((0, 4))
        self.table = np.empty((0, 0))
        corners = np.array([c.dials for c in CORNERS.values()])
        self.corner_table = scores(list(CORNERS.values()))
        sobol = qmc.Sobol(4, seed=np.random.default_rng(seed)).random(_next_power(_FIRST))
        self._add(sobol[:_FIRST], np.ones((2, 4)))
        self._extra = (corners, self.corner_table)
        for number in range(_ROUNDS):
            self._explore(heat=0.25 if number == 0 else 0.6 if number == 1 else 1.0)
        every = np.ones(self.trials, dtype=bool)
        self._polish([every, *(every ^ (np.arange(self.trials) == k) for k in range(self.trials))])

    @property
    def trials(self) -> int:
        """How many trials there are."""
        return len(self.corner_table)

    def fit(self, held_in: np.ndarray | None = None) -> Fit:
        """Return the dials by the trials with held_in (n_trials,) true, by default all."""
        held_in = np.ones(self.trials, dtype=bool) if held_in is None else held_in
        points, table = self._candidates()
        scores = table[held_in].sum(axis=0)
        best = int(scores.argmax())
        weight = self._weights(held_in)
        mean = weight @ self.points
        ends = [_quantiles(self.points[:, d], weight) for d in range(4)]
        least = np.minimum([end[0] for end in ends], points[best])
        most = np.maximum([end[1] for end in ends], points[best])
        effective = 1.0 / float((weight**2).sum())
        return Fit(points[best], least, most, mean, float(scores[best]), effective)

    def predict(self, k: int) -> tuple[float, float, float]:
        """Log-likelihood of trial k by the dials fitted to all others.

        Returns that of the best dials, that of the best of the 16 corners, and that of the whole
        posterior (the likelihood averaged over it).
        """
        held_in = np.arange(self.trials) != k
        _, table = self._candidates()
        best = int(table[held_in].sum(axis=0).argmax())
        corner = int(self.corner_table[held_in].sum(axis=0).argmax())
        weight = self._weights(held_in)
        top = self.table[k].max()
        mixed = top + np.log(weight @ np.exp(self.table[k] - top))
        return float(table[k, best]), float(self.corner_table[k, corner]), float(mixed)

    # -- sampling ---------------------------------------------------------------------------------

    def _candidates(self) -> tuple[np.ndarray, np.ndarray]:
        """Everything evaluated: points (N, 4), table (n_trials, N)."""
        corners, table = self._extra
        return np.vstack((self.points, corners)), np.hstack((self.table, table))

    def _add(self, points: np.ndarray, shape: np.ndarray) -> None:
        self._proposals.append((len(points), shape))
        table = self._scores([Character(*map(float, point)) for point in points])
        self.points = np.vstack((self.points, points))
        self.table = table if not self.table.size else np.hstack((self.table, table))

    def _explore(self, heat: float) -> None:
        """Draw a round near what explains the trials; heat < 1 flattens the likelihood."""
        weight = self._weights(np.ones(self.trials, dtype=bool), heat)
        mean = np.clip(weight @ self.points, 0.02, 0.98)
        variance = weight @ (self.points - mean) ** 2 * 1.5 + 4e-4
        size = np.clip(mean * (1.0 - mean) / variance - 1.0, 0.5, 400.0)
        shape = np.stack((np.maximum(mean * size, 0.4), np.maximum((1.0 - mean) * size, 0.4)))
        draws = self._rng.beta(shape[0], shape[1], size=(_ROUND, 4))
        self._add(np.clip(draws, 1e-6, 1.0 - 1e-6), shape)

    def _weights(self, held_in: np.ndarray, heat: float = 1.0) -> np.ndarray:
        """(N,): share of each sampled point in the posterior under a flat prior."""
        density = np.zeros(len(self.points))
        for count, shape in self._proposals:
            inside = np.clip(self.points, 1e-6, 1.0 - 1e-6)
            density += count * beta_distribution.pdf(inside, shape[0], shape[1]).prod(axis=1)
        logs = heat * self.table[held_in].sum(axis=0) - np.log(density)
        weight = np.exp(logs - logs.max())
        return weight / weight.sum()

    def _polish(self, folds: list[np.ndarray]) -> None:
        """Evaluate the tops of local quadratics of every fold, a few times."""
        for _ in range(_POLISH):
            points, table = self._candidates()
            tops = [_quadratic_top(points, table[fold].sum(axis=0)) for fold in folds if fold.any()]
            new = np.array([top for top in tops if top is not None]).reshape(-1, 4)
            if len(new):
                found = self._scores([Character(*map(float, point)) for point in new])
                old, known = self._extra
                self._extra = (np.vstack((old, new)), np.hstack((known, found)))


def _quadratic_top(points: np.ndarray, scores: np.ndarray) -> np.ndarray | None:
    """Return where a quadratic through the best points is highest within the cube, (4,)."""
    order = np.argsort(scores)[::-1][:_NEAR]
    x, y = points[order], scores[order]
    best = x[0]
    first, second = np.triu_indices(4)
    d = x - best
    A = np.hstack((np.ones((len(x), 1)), d, d[:, first] * d[:, second]))
    weight = np.exp(0.15 * (y - y[0]))[:, None]
    c, *_ = np.linalg.lstsq(A * weight, (y - y[0]) * weight[:, 0], rcond=None)

    def negative(z: np.ndarray) -> float:
        step = z - best
        return -float(c[1:5] @ step + c[5:] @ (step[first] * step[second]))

    box = [(max(0.0, b - 0.15), min(1.0, b + 0.15)) for b in best]
    top = minimize(negative, best, method="L-BFGS-B", bounds=box).x
    return top if np.isfinite(top).all() else None


def _quantiles(values: np.ndarray, weight: np.ndarray) -> tuple[float, float]:
    """Return the ends of the central 95 % of weighted values."""
    order = np.argsort(values)
    below = np.cumsum(weight[order]) - weight[order] / 2.0
    tail = (1.0 - LEVEL) / 2.0
    least, most = np.interp((tail, 1.0 - tail), below, values[order])
    return float(least), float(most)


def _next_power(n: int) -> int:
    return 1 << (n - 1).bit_length()
