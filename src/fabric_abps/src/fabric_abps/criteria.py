# SPDX-License-Identifier: BSD-3-Clause
"""Ways to score the policies under a type belief; the selector takes the largest score."""

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fabric_abps.performance import PerformanceModel


class Criterion(Protocol):
    """Scores every policy."""

    name: str

    def score(
        self, belief: NDArray, performance: PerformanceModel, rng: np.random.Generator
    ) -> NDArray:
        """Scores (n_policies,), larger is better, for a belief (n_types,) that sums to 1."""
        ...


class ExpectedImprovement:
    """Eq. 5.4: sum_tau beta(tau) (1 - F(U_beta | tau, pi)), in [0, 1].

    U_beta is the best belief-weighted mean utility, max_pi sum_tau beta(tau) E[U | tau, pi].
    """

    name = "expected_improvement"

    def score(
        self, belief: NDArray, performance: PerformanceModel, rng: np.random.Generator
    ) -> NDArray:
        U_beta = float(performance.expected(belief).max())
        return belief @ (1.0 - performance.cdf(U_beta))


class Greedy:
    """The belief-weighted mean utility itself: no exploration."""

    name = "greedy"

    def score(
        self, belief: NDArray, performance: PerformanceModel, rng: np.random.Generator
    ) -> NDArray:
        return performance.expected(belief)


class Thompson:
    """A type drawn from the belief, then every policy's mean drawn from its posterior."""

    name = "thompson"

    def score(
        self, belief: NDArray, performance: PerformanceModel, rng: np.random.Generator
    ) -> NDArray:
        tau = int(rng.choice(len(belief), p=belief / belief.sum()))
        return performance.sample_mean(tau, rng)


class Random:
    """A baseline that knows nothing."""

    name = "random"

    def score(
        self, belief: NDArray, performance: PerformanceModel, rng: np.random.Generator
    ) -> NDArray:
        return rng.random(performance.mean.shape[1])


class Fixed:
    """A baseline that never changes: score 1 for one policy."""

    name = "fixed"

    def __init__(self, policy: int) -> None:
        self.policy = policy

    def score(
        self, belief: NDArray, performance: PerformanceModel, rng: np.random.Generator
    ) -> NDArray:
        scores = np.zeros(performance.mean.shape[1])
        scores[self.policy] = 1.0
        return scores


CRITERIA: dict[str, Callable[[], Criterion]] = {
    kind.name: kind for kind in (ExpectedImprovement, Greedy, Thompson, Random)
}


def make_criterion(name: str, policies: list[str], fixed: str | None = None) -> Criterion:
    """The criterion of that name; 'fixed' takes the name of a policy.

    Raises ValueError naming the allowed values.
    """
    if name == Fixed.name:
        if fixed not in policies:
            raise ValueError(f"fixed policy '{fixed}' is none of {', '.join(policies)}")
        return Fixed(policies.index(fixed))
    if name not in CRITERIA:
        allowed = ", ".join([*CRITERIA, Fixed.name])
        raise ValueError(f"criterion '{name}' is none of {allowed}")
    return CRITERIA[name]()
