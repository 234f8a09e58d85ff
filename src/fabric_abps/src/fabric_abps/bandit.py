# SPDX-License-Identifier: BSD-3-Clause
"""EXP4: a contextual bandit that learns from rewards which adviser to trust."""

import numpy as np
from numpy.typing import NDArray

from fabric_abps.criterion import Criterion
from fabric_abps.performance import PerformanceModel

EXPLORATION = 0.1  # gamma, share of tasks whose policy is drawn evenly
RATE = 0.1  # eta, of learning
SHARE = 0.01  # of all trust shared out again after each task, so that a change is survived


class Exp4(Criterion):
    """Auer, Cesa-Bianchi, Freund and Schapire 2002, with a fixed share (Herbster, Warmuth 1998).

    Advisers: one a known type, who names that type's best policy; one who names the best policy
    under the belief; one who names all policies evenly. With trust w over advisers and their
    advice xi, a policy is drawn from p = (1 - gamma) w xi + gamma / K. The loss of the drawn
    policy, scaled to [0, 1] and divided by its p, is an unbiased estimate of every policy's loss,
    and costs each adviser exp(-eta xi loss).
    """

    name = "exp4"
    starts_from_base = False
    draws = True
    told_by_experiments = True  # the reward: no robot of ours measures it while it works

    def __init__(self) -> None:
        self._trust = np.empty(0)
        self._advice = np.empty((0, 0))
        self._drawn_from = np.empty(0)
        self._range = (0.0, 1.0)

    def reset(self) -> None:
        """Trust all advisers alike."""
        self._trust = np.empty(0)

    def score(
        self, belief: NDArray, performance: PerformanceModel, rng: np.random.Generator
    ) -> NDArray:
        """p, (n_policies,), sums to 1."""
        n_types, K = performance.mean.shape
        xi = np.full((n_types + 2, K), 0.0)
        xi[np.arange(n_types), performance.mean.argmax(axis=1)] = 1.0
        xi[n_types, performance.expected(belief).argmax()] = 1.0
        xi[n_types + 1] = 1.0 / K
        if self._trust.size == 0:
            self._trust = np.full(len(xi), 1.0 / len(xi))
        if self._trust.size != len(xi):
            raise ValueError(f"exp4: trust in {self._trust.size} advisers, there are {len(xi)}")
        low = (performance.mean - 2.0 * performance.deviation).min()
        high = (performance.mean + 2.0 * performance.deviation).max()
        self._range, self._advice = (float(low), float(high)), xi
        self._drawn_from = (1.0 - EXPLORATION) * self._trust @ xi + EXPLORATION / K
        return self._drawn_from

    def pick(self, score: NDArray, expected: NDArray, rng: np.random.Generator) -> int:
        """A draw from p."""
        return int(rng.choice(len(score), p=score / score.sum()))

    def words(self, policy: int, score: NDArray, expected: NDArray) -> str:
        return f"drawn with probability {score[policy]:.2f} by what earned well so far"

    def learn(self, policy: int, utility: float) -> None:
        """The importance-weighted update. Raises ValueError when the utility is not finite."""
        if not np.isfinite(utility):
            raise ValueError(f"exp4: utility {utility} is not finite")
        low, high = self._range
        loss = 1.0 - min(1.0, max(0.0, (utility - low) / (high - low)))
        log = np.log(self._trust) - RATE * self._advice[:, policy] * loss / self._drawn_from[policy]
        trust = np.exp(log - log.max())
        self._trust = (1.0 - SHARE) * trust / trust.sum() + SHARE / len(trust)

    @property
    def memory(self) -> list[float]:
        """Trust in every adviser; empty before the first task."""
        return self._trust.tolist()

    @memory.setter
    def memory(self, numbers: list[float]) -> None:
        trust = np.asarray(numbers, dtype=float)
        adds_up = trust.size == 0 or abs(trust.sum() - 1.0) <= 1e-6
        if trust.ndim != 1 or not (trust > 0).all() or not adds_up:
            raise ValueError("exp4: trust must be a list of positive numbers that sum to 1")
        self._trust = trust
