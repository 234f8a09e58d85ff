# SPDX-License-Identifier: BSD-3-Clause
"""A shift change: is this still the same person? A Shiryaev-Roberts test over whole tasks."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import logsumexp


class ChangeDetector:
    """Compares "the same person as before" with "somebody new since task k", for every late k.

    Each hypothesis learns by Eq. 5.1 from the tasks it claims, without forgetting; its odds are
    the product of how much better it foretold those tasks than the present person did. The sum of
    the odds over k grows by 1 a task on average while nobody changes (it is a martingale less the
    number of tasks), so crossing 1 / rate takes 1 / rate tasks on average at least: `rate` bounds
    the false alarms a task for people whom the observation model describes.
    """

    def __init__(self, log_prior: ArrayLike, rate: float = 0.01, window: int = 10) -> None:
        """log_prior: over the types, (n_types,) nats; rate in [0, 1), 0 never sounds; window >= 1:
        how many tasks ago a change is looked for. Raises ValueError naming what is out of range.
        """
        if not 0.0 <= rate < 1.0:
            raise ValueError(f"change_rate must be in [0, 1), got {rate}")
        if not (isinstance(window, int) and window >= 1):
            raise ValueError(f"change_window must be a whole number >= 1, got {window}")
        self._log_prior = np.asarray(log_prior, dtype=float)
        self._threshold = math.inf if rate == 0.0 else -math.log(rate)
        self._window = window
        self.reset()

    def reset(self) -> None:
        """Somebody new begins for certain."""
        self._become(self._log_prior, 0)

    def update(self, log_likelihood: ArrayLike) -> bool:
        """Take a task's log-likelihood under every type, (n_types,) nats; True on an alarm.

        After an alarm the person is the one who began with the most likely k.
        """
        evidence = np.asarray(log_likelihood, dtype=float)
        foretold = logsumexp(self._log + evidence)
        self._log = self._log + evidence - foretold
        self.tasks += 1
        if self.tasks == 1:
            return False  # nobody was there before the first task
        new = np.vstack([self._new, self._log_prior]) + evidence
        new_foretold = logsumexp(new, axis=1)
        odds = np.append(self._odds, 0.0) + new_foretold - foretold
        self._new = (new - new_foretold[:, None])[-self._window :]
        self._odds = odds[-self._window :]
        if self.log_odds < self._threshold:
            return False
        k = int(np.argmax(self._odds))
        self._become(self._new[k], len(self._odds) - k)
        return True

    @property
    def log_odds(self) -> float:
        """ln of the summed odds that somebody new has come, -inf when that cannot be."""
        return float(logsumexp(self._odds)) if self._odds.size else -math.inf

    @property
    def log_belief(self) -> NDArray:
        """ln beta of the present person by the tasks since they came, (n_types,)."""
        return self._log.copy()

    def state(self) -> dict:
        """Everything that `restore` needs, as plain lists and numbers."""
        arrays = {"belief": self._log, "new": self._new, "odds": self._odds}
        return {"tasks": self.tasks} | {name: array.tolist() for name, array in arrays.items()}

    def restore(self, state: dict) -> None:
        """Go on from a `state`. Raises ValueError when it is none of this many types."""
        n = self._log_prior.size
        log = np.asarray(state["belief"], dtype=float)
        odds = np.asarray(state["odds"], dtype=float)
        new = np.asarray(state["new"], dtype=float).reshape(-1, n)
        if log.shape != (n,) or odds.shape != (len(new),):
            raise ValueError(f"change: must be of {n} types and have odds for each new person")
        if not all(np.isfinite(array).all() for array in (log, odds, new)):
            raise ValueError("change: holds a number that is not finite")
        self._become(log, int(state["tasks"]))
        self._new, self._odds = new[-self._window :], odds[-self._window :]

    def _become(self, log: NDArray, tasks: int) -> None:
        self._log, self.tasks = log, tasks
        self._new = np.empty((0, self._log_prior.size))
        self._odds = np.empty(0)
