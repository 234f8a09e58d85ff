# SPDX-License-Identifier: BSD-3-Clause
"""The performance model P(U | tau, pi) (Definition 3): utility of every policy with every type."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import gammaln, ndtr, stdtr

SWEEPS = 60  # of estimating posterior means; they stand still long before
PREDICTIVES = ("student", "normal")


class PerformanceModel:
    """Predictive distribution of the utility of one task, for n_types x n_policies pairs.

    'student' is the posterior predictive of a normal with unknown mean and variance under the
    non-informative prior: Student's t with n - 1 degrees of freedom, centre m, scale
    s sqrt(1 + 1/n). 'normal' takes m and s as the truth. s^2 is never below the floor, so that
    a policy that always earned the same stays comparable.
    """

    def __init__(
        self,
        count: ArrayLike,
        mean: ArrayLike,
        variance: ArrayLike,
        variance_floor: float = 0.25,
        predictive: str = "student",
    ) -> None:
        """Samples, their mean [points] and sample variance [points^2], each (n_types, n_policies).

        Raises ValueError naming the pair when something is not finite or too few samples.
        """
        self.count = np.asarray(count, dtype=np.int64)
        self.mean = np.asarray(mean, dtype=float)
        self.variance = np.asarray(variance, dtype=float)
        if self.mean.ndim != 2 or not self.mean.shape == self.count.shape == self.variance.shape:
            raise ValueError("count, mean and variance must have one shape (n_types, n_policies)")
        if predictive not in PREDICTIVES:
            raise ValueError(f"predictive '{predictive}' is none of {', '.join(PREDICTIVES)}")
        if not (np.isfinite(variance_floor) and variance_floor > 0):
            raise ValueError(f"variance_floor must be positive, got {variance_floor}")
        _check(self.count >= 2, "needs two tasks at least")
        _check(np.isfinite(self.mean), "mean utility is not finite")
        _check(np.isfinite(self.variance) & (self.variance >= 0), "variance is not in [0, inf)")
        self.variance_floor = float(variance_floor)
        self.predictive = predictive

    @classmethod
    def fit(
        cls,
        utilities: Sequence[Sequence[ArrayLike]],
        variance_floor: float = 0.25,
        predictive: str = "student",
    ) -> "PerformanceModel":
        """From the utilities of the training tasks, utilities[type][policy]: (n_tasks,) points."""
        rows: list[list[NDArray]] = [
            [np.asarray(pair, dtype=float).ravel() for pair in row] for row in utilities
        ]
        if not rows or not rows[0] or len({len(row) for row in rows}) != 1:
            raise ValueError("utilities must be a full table [type][policy]")
        count = np.array([[pair.size for pair in row] for row in rows])
        _check(count >= 2, "needs two tasks at least")
        _check(
            np.array([[np.isfinite(pair).all() for pair in row] for row in rows]),
            "a utility is not finite",
        )
        mean = np.array([[pair.mean() for pair in row] for row in rows])
        variance = np.array([[pair.var(ddof=1) for pair in row] for row in rows])
        return cls(count, mean, variance, variance_floor, predictive)

    def shrunk(self) -> "PerformanceModel":
        """The same with posterior means (empirical Bayes) in place of the sample means.

        The tasks of a pair tell its mean with a standard error s / sqrt(n) that is easily as large
        as what policies differ by, and the best of many noisy means is mostly luck. A pair's mean
        is taken as type + policy + their interaction, whose variance each policy has of its own:
        a policy that suits some and angers others keeps what is particular about it, one that does
        much the same as the rest is judged by all types together. The parts are weighted by their
        precision; each interaction keeps the share of itself that is not expected to be error.
        """
        n_types = len(self.mean)
        error = self.deviation**2 / self.count
        of_type, of_policy = self.mean.mean(axis=1, keepdims=True), np.zeros(self.mean.shape[1])
        variance = np.zeros(self.mean.shape[1])  # of the interactions of each policy, points^2
        for _ in range(SWEEPS):
            weight = 1.0 / (variance + error)
            of_type = np.average(self.mean - of_policy, axis=1, weights=weight)[:, None]
            of_policy = np.average(self.mean - of_type, axis=0, weights=weight)
            interaction = self.mean - of_type - of_policy
            scatter = interaction**2 * n_types / max(n_types - 1, 1) - error
            variance = np.maximum(0.0, np.average(scatter, axis=0, weights=weight**2))
        mean = of_type + of_policy + interaction * variance / (variance + error)
        return PerformanceModel(
            self.count, mean, self.variance, self.variance_floor, self.predictive
        )

    @property
    def deviation(self) -> NDArray:
        """Standard deviation s with the floor applied, (n_types, n_policies) points."""
        return np.sqrt(np.maximum(self.variance, self.variance_floor))

    def cdf(self, utility: float) -> NDArray:
        """F(utility | tau, pi), (n_types, n_policies)."""
        z = (utility - self.mean) / self._scale
        return ndtr(z) if self.predictive == "normal" else stdtr(self.count - 1.0, z)

    def density(self, utility: float) -> NDArray:
        """P(utility | tau, pi), (n_types, n_policies) 1/points."""
        z = (utility - self.mean) / self._scale
        if self.predictive == "normal":
            return np.exp(-0.5 * z**2) / np.sqrt(2.0 * np.pi) / self._scale
        nu = self.count - 1.0
        log = gammaln((nu + 1.0) / 2.0) - gammaln(nu / 2.0) - 0.5 * np.log(nu * np.pi)
        return np.exp(log - (nu + 1.0) / 2.0 * np.log1p(z**2 / nu)) / self._scale

    @property
    def _scale(self) -> NDArray:
        """Of the predictive distribution, (n_types, n_policies) points."""
        if self.predictive == "normal":
            return self.deviation
        return self.deviation * np.sqrt(1.0 + 1.0 / self.count)

    def expected(self, belief: ArrayLike) -> NDArray:
        """Belief-weighted mean utility of every policy, (n_policies,) points."""
        return np.asarray(belief, dtype=float) @ self.mean

    def sample_mean(self, type_index: int, rng: np.random.Generator) -> NDArray:
        """A draw from the posterior of every policy's mean utility with a type, (n_policies,)."""
        count = self.count[type_index]
        error = self.deviation[type_index] / np.sqrt(count)
        return self.mean[type_index] + error * rng.standard_t(count - 1.0)


def _check(valid: NDArray, complaint: str) -> None:
    if not valid.all():
        type_index, policy_index = np.argwhere(~valid)[0]
        raise ValueError(f"type {type_index}, policy {policy_index}: {complaint}")
