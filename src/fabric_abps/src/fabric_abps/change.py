# SPDX-License-Identifier: BSD-3-Clause
"""A shift change: is this still the same person? A Shiryaev-Roberts test over whole tasks."""

import math
from collections import deque

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import logsumexp

from fabric_abps.kept import rows, whole

CONCENTRATION = 2.0  # of the Dirichlet prior over a person's mixture of types, in tasks


class ChangeDetector:
    """Compares "the same person as before" with "somebody new since task k", for every late k.

    A person is a mixture of the known types (5.3.1.2) that each task is a draw from; the mixture
    is learnt from the tasks it is held responsible for, so that somebody between two types is not
    taken for two people in turns. The odds of a k are the product of how much better its person
    foretold the tasks since than the present one did. Their sum over k grows by 1 a task on
    average while nobody changes and what is foretold comes true (it is a martingale less the
    number of tasks), so crossing 1 / rate takes 1 / rate tasks on average at least: `rate` bounds
    the false alarms a task.
    """

    def __init__(self, n_types: int, rate: float = 0.05, window: int = 10) -> None:
        """rate in [0, 1), 0 never sounds; window >= 1: how many tasks ago a change is looked for.

        Raises ValueError naming what is out of range.
        """
        if not 0.0 <= rate < 1.0:
            raise ValueError(f"change_rate must be in [0, 1), got {rate}")
        if not (isinstance(window, int) and window >= 1):
            raise ValueError(f"change_window must be a whole number >= 1, got {window}")
        self._threshold = math.inf if rate == 0.0 else -math.log(rate)
        self._prior = np.full(n_types, CONCENTRATION / n_types)
        self._window = window
        self.reset()

    def reset(self) -> None:
        """Somebody new begins for certain."""
        self.tasks = 0  # since the present person came
        self._people = self._prior[None, :]  # Dirichlet counts: the present, then new ones by age
        self._log_odds = np.empty(0)  # of the new ones
        self._evidence: deque[NDArray] = deque(maxlen=self._window)

    def update(self, log_likelihood: ArrayLike, weight: float = 1.0) -> bool:
        """Take a task's log-likelihood under every type, (n_types,) nats; True on an alarm.

        After an alarm the present person is the one who came with the most likely k. weight: share
        of the log-likelihood that counts in `evidence`, (0, 1].
        """
        evidence = np.asarray(log_likelihood, dtype=float)
        self._evidence.append(weight * evidence)
        self.tasks += 1
        if self.tasks > 1:  # nobody could be relieved in the first task
            self._people = np.vstack([self._people, self._prior])
            self._log_odds = np.append(self._log_odds, 0.0)
        share = self._people / self._people.sum(axis=1, keepdims=True)
        joint = share * np.exp(evidence - evidence.max()) + np.finfo(float).tiny
        foretold = joint.sum(axis=1)
        self._people = self._people + joint / foretold[:, None]
        self._log_odds = self._log_odds + np.log(foretold[1:]) - np.log(foretold[0])
        self._forget_the_oldest()
        if self.log_odds < self._threshold:
            return False
        self._relieve(int(np.argmax(self._log_odds)))
        return True

    @property
    def log_odds(self) -> float:
        """ln of the summed odds that somebody new has come, -inf when that cannot be."""
        return float(logsumexp(self._log_odds)) if self._log_odds.size else -math.inf

    @property
    def evidence(self) -> NDArray:
        """Weighted log-likelihood of all tasks since the present person came, (n_types,) nats; of
        the last `window` ones when they are more."""
        return np.sum(self._evidence, axis=0)

    def state(self) -> dict:
        """Everything that `restore` needs, as plain lists and numbers."""
        return {
            "tasks": self.tasks,
            "people": self._people.tolist(),
            "log_odds": self._log_odds.tolist(),
            "evidence": [values.tolist() for values in self._evidence],
        }

    def restore(self, state: dict) -> None:
        """Go on from a `state`.

        Raises KeyError when an entry is missing, ValueError, TypeError or OverflowError when one
        does not fit; nothing changes then.
        """
        n = self._prior.size
        people = rows("change: people", state["people"], n)
        odds = np.asarray(state["log_odds"], dtype=float)
        evidence = rows("change: evidence", state["evidence"], n)
        if odds.shape != (len(people) - 1,):
            raise ValueError("change: each new person must have odds")
        if not all(np.isfinite(array).all() for array in (people, odds, evidence)):
            raise ValueError("change: holds a number that is not finite")
        if not (people > 0).all():
            raise ValueError("change: counts of a person must be positive")
        tasks = whole("change: tasks", state["tasks"])
        self.reset()
        self.tasks, self._people, self._log_odds = tasks, people, odds
        self._evidence.extend(evidence)
        self._forget_the_oldest()

    def _forget_the_oldest(self) -> None:
        self._log_odds = self._log_odds[-self._window :]
        self._people = np.vstack([self._people[:1], self._people[1:][-self._window :]])

    def _relieve(self, k: int) -> None:
        self.tasks = len(self._log_odds) - k
        self._people, self._log_odds = self._people[1 + k : 2 + k], np.empty(0)
        self._evidence = deque(list(self._evidence)[-self.tasks :], maxlen=self._window)
