# SPDX-License-Identifier: BSD-3-Clause
"""Ways to score the policies under a type belief; CRITERIA lists them by name."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fabric_abps.bandit import Exp4
from fabric_abps.criterion import Criterion
from fabric_abps.performance import PerformanceModel


class ExpectedImprovement(Criterion):
    """Eq. 5.4: sum_tau beta(tau) (1 - F(U_beta | tau, pi)), in [0, 1].

    U_beta is the best belief-weighted mean utility, max_pi sum_tau beta(tau) E[U | tau, pi].
    """

    name = "expected_improvement"

    def score(
        self, belief: NDArray, performance: PerformanceModel, rng: np.random.Generator
    ) -> NDArray:
        U_beta = float(performance.expected(belief).max())
        return belief @ (1.0 - performance.cdf(U_beta))

    def words(self, policy: int, score: NDArray, expected: NDArray) -> str:
        best = f"{expected.max():.2f}, the best expected reward"
        return f"{100.0 * score[policy]:.0f} % likely to earn more than {best}"


class ProbabilityOfImprovement(Criterion):
    """Eq. 5.2: sum_tau beta(tau) P(U+ | tau, pi), a density, 1/points.

    U+ is what somebody would earn who knew the type, sum_tau beta(tau) max_pi E[U | tau, pi]; it is
    never below U_beta and equals it when the belief is certain.
    """

    name = "probability_of_improvement"

    def score(
        self, belief: NDArray, performance: PerformanceModel, rng: np.random.Generator
    ) -> NDArray:
        U_plus = float(belief @ performance.mean.max(axis=1))
        return belief @ performance.density(U_plus)

    def words(self, policy: int, score: NDArray, expected: NDArray) -> str:
        return f"the likeliest to earn what knowing the type would ({score[policy]:.2f} a point)"


class Greedy(Criterion):
    """The belief-weighted mean utility itself: no exploration."""

    name = "greedy"

    def score(
        self, belief: NDArray, performance: PerformanceModel, rng: np.random.Generator
    ) -> NDArray:
        return performance.expected(belief)

    def words(self, policy: int, score: NDArray, expected: NDArray) -> str:
        return f"the best expected reward, {expected[policy]:.2f}"


class Thompson(Criterion):
    """A type drawn from the belief, then every policy's mean drawn from its posterior."""

    name = "thompson"
    draws = True

    def score(
        self, belief: NDArray, performance: PerformanceModel, rng: np.random.Generator
    ) -> NDArray:
        tau = int(rng.choice(len(belief), p=belief / belief.sum()))
        return performance.sample_mean(tau, rng)

    def words(self, policy: int, score: NDArray, expected: NDArray) -> str:
        return f"best in a draw from what is known, {score[policy]:.2f}"


class Random(Criterion):
    """A baseline that knows nothing."""

    name = "random"
    starts_from_base = False
    draws = True

    def score(
        self, belief: NDArray, performance: PerformanceModel, rng: np.random.Generator
    ) -> NDArray:
        return rng.random(performance.mean.shape[1])

    def words(self, policy: int, score: NDArray, expected: NDArray) -> str:
        return "drawn by lot"


class Fixed(Criterion):
    """A baseline that never changes: score 1 for one policy."""

    name = "fixed"
    starts_from_base = False

    def __init__(self, policy: int) -> None:
        self.policy = policy

    def score(
        self, belief: NDArray, performance: PerformanceModel, rng: np.random.Generator
    ) -> NDArray:
        scores = np.zeros(performance.mean.shape[1])
        scores[self.policy] = 1.0
        return scores

    def words(self, policy: int, score: NDArray, expected: NDArray) -> str:
        return "fixed by configuration"


class Oracle(Criterion):
    """The bound: it is told what every policy earns on average with this very person."""

    name = "oracle"
    starts_from_base = False
    told_by_experiments = True

    def __init__(self) -> None:
        self._utility: NDArray | None = None

    def tell(self, utility: ArrayLike) -> None:
        """Take the person's true mean utility of every policy, (n_policies,) points."""
        told = np.asarray(utility, dtype=float)
        if told.ndim != 1 or not np.isfinite(told).all():
            raise ValueError("oracle: utilities must be (n_policies,) finite numbers")
        self._utility = told

    def score(
        self, belief: NDArray, performance: PerformanceModel, rng: np.random.Generator
    ) -> NDArray:
        if self._utility is None:
            raise ValueError("oracle: has not been told the person's utilities")
        if self._utility.size != performance.mean.shape[1]:
            raise ValueError(
                f"oracle: was told {self._utility.size} utilities, "
                f"there are {performance.mean.shape[1]} policies"
            )
        return self._utility

    def words(self, policy: int, score: NDArray, expected: NDArray) -> str:
        return f"known to earn {score[policy]:.2f} with this person"


CRITERIA: dict[str, Callable[[], Criterion]] = {
    kind.name: kind
    for kind in (
        ExpectedImprovement,
        ProbabilityOfImprovement,
        Greedy,
        Thompson,
        Random,
        Oracle,
        Exp4,
    )
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
