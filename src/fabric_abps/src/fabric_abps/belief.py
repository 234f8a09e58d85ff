# SPDX-License-Identifier: BSD-3-Clause
"""The belief over the known types of worker, Eq. 5.1, in log space."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import logsumexp


class TypeBelief:
    """beta(tau) over known types; it can neither lock up nor hold a zero.

    Before each task the person may have changed with probability `forgetting` (a shift change):
    the belief is mixed with the prior by that share. After Bayes' rule every type keeps `floor`.
    """

    def __init__(
        self,
        types: Sequence[str],
        forgetting: float = 0.02,
        floor: float = 1e-4,
        prior: ArrayLike | None = None,
    ) -> None:
        """Types (n_types,), forgetting in [0, 1), floor in (0, 1/n_types), prior (n_types,) or
        uniform. Raises ValueError naming what is out of range.
        """
        self.types: list[str] = list(types)
        n = len(self.types)
        if n == 0 or len(set(self.types)) != n:
            raise ValueError("types must be distinct names, one at least")
        if not 0.0 <= forgetting < 1.0:
            raise ValueError(f"forgetting must be in [0, 1), got {forgetting}")
        if not 0.0 < floor < 1.0 / n:
            raise ValueError(f"floor must be in (0, 1/{n}), got {floor}")
        given = np.full(n, 1.0 / n) if prior is None else np.asarray(prior, dtype=float)
        if given.shape != (n,) or not (given > 0).all() or abs(given.sum() - 1.0) > 1e-6:
            raise ValueError("prior must be (n_types,), positive, and sum to 1")
        self.forgetting = forgetting
        self.floor = floor
        self._log_prior = np.log(given / given.sum())
        self._log = self._log_prior.copy()

    def reset(self) -> None:
        """Forget the person: back to the prior."""
        self._log = self._log_prior.copy()

    def update(self, log_likelihood: ArrayLike) -> None:
        """Eq. 5.1 with sigma's log-likelihood under every type, (n_types,) nats.

        Raises ValueError when an entry is NaN or infinite; the belief is unchanged then.
        """
        self._log = self._updated(log_likelihood)

    def foresee(self, log_likelihood: ArrayLike) -> NDArray:
        """What `update` would make of beta, (n_types,), which stays as it is."""
        return np.exp(self._updated(log_likelihood))

    def _updated(self, log_likelihood: ArrayLike) -> NDArray:
        evidence = np.asarray(log_likelihood, dtype=float)
        if evidence.shape != self._log.shape:
            raise ValueError(f"log-likelihood must be ({len(self.types)},), got {evidence.shape}")
        if not np.isfinite(evidence).all():
            wrong = self.types[int(np.flatnonzero(~np.isfinite(evidence))[0])]
            raise ValueError(f"log-likelihood of type '{wrong}' is not finite")
        log = _mix(self._log, self._log_prior, self.forgetting)
        return self._floored(log + evidence)

    def _floored(self, log: NDArray) -> NDArray:
        n = len(self.types)
        log = _mix(log - logsumexp(log), np.full(n, -np.log(n)), n * self.floor)
        return log - logsumexp(log)

    @property
    def log_probability(self) -> NDArray:
        """ln beta, (n_types,)."""
        return self._log.copy()

    @log_probability.setter
    def log_probability(self, log: ArrayLike) -> None:
        """Go on from a belief of before, (n_types,) nats.

        Raises ValueError unless the numbers are finite and their exponentials sum to 1.
        """
        given = np.asarray(log, dtype=float)
        if given.shape != self._log.shape or not np.isfinite(given).all():
            raise ValueError(f"belief must be ({len(self.types)},) finite logarithms")
        if abs(logsumexp(given)) > 1e-6:
            raise ValueError(f"belief sums to {np.exp(logsumexp(given)):.6g}, not to 1")
        self._log = given.copy()

    @property
    def probability(self) -> NDArray:
        """beta, (n_types,), sums to 1, every entry above 0."""
        return np.exp(self._log)

    @property
    def entropy(self) -> float:
        """Shannon entropy, nats: 0 when certain, ln n_types when ignorant."""
        return float(max(0.0, -(self.probability * self._log).sum()))

    @property
    def most_likely(self) -> str:
        """Name of the most probable type; the first of equals."""
        return self.types[int(np.argmax(self._log))]


def _mix(log_a: NDArray, log_b: NDArray, share: float) -> NDArray:
    """ln((1 - share) a + share b)."""
    if share == 0.0:
        return log_a
    return np.logaddexp(np.log1p(-share) + log_a, np.log(share) + log_b)
