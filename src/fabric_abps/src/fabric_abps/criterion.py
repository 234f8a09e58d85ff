# SPDX-License-Identifier: BSD-3-Clause
"""What every way to choose a policy has in common."""

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fabric_abps.performance import PerformanceModel


class Criterion(ABC):
    """Scores every policy; the selector takes the one that `pick` names."""

    name: ClassVar[str]
    starts_from_base: ClassVar[bool] = True  # a new person begins with the base policy
    draws: ClassVar[bool] = False  # its choice is an outcome of chance
    told_by_experiments: ClassVar[bool] = False  # needs what no robot can know or measure

    @abstractmethod
    def score(
        self, belief: NDArray, performance: PerformanceModel, rng: np.random.Generator
    ) -> NDArray:
        """Scores (n_policies,), larger is better, for a belief (n_types,) that sums to 1."""

    def pick(self, score: NDArray, expected: NDArray, rng: np.random.Generator) -> int:
        """Index of the choice: the largest score; of equals the larger expected reward, then the
        first. score, expected: (n_policies,).
        """
        candidates = np.flatnonzero(score >= score.max() - 1e-12)
        return int(candidates[np.argmax(expected[candidates])])

    @abstractmethod
    def words(self, policy: int, score: NDArray, expected: NDArray) -> str:
        """Why this policy, for people."""

    def learn(self, policy: int, utility: float) -> None:  # noqa: B027
        """Take the utility [points] of a task with the policy picked last; most learn nothing."""

    def tell(self, utility: ArrayLike) -> None:
        """Take the person's true mean utility of every policy, (n_policies,) points."""
        raise ValueError(f"criterion {self.name} must not know the person's true utilities")

    def reset(self) -> None:  # noqa: B027
        """A new person: forget what was learnt from rewards, if anything was."""

    @property
    def memory(self) -> list[float]:
        """What was learnt from rewards, as plain numbers; empty for most."""
        return []

    @memory.setter
    def memory(self, numbers: list[float]) -> None:
        if numbers:
            raise ValueError(f"criterion {self.name} remembers nothing, got {len(numbers)} numbers")
