# SPDX-License-Identifier: BSD-3-Clause
"""P(a take-over is accepted) = sum over types and states of beta(type) b(state) P(accept | both).

The type is how willing the person is to be taken over, u ~ N(0, spread^2), on a grid:

    P(accept | u, s) = 1 / (1 + exp(-(mean + u + x_s)))

b(s) is the belief of the sorting model. beta starts as the prior of u, and Bayes' rule (Eq. 5.1)
multiplies it by the likelihood of every answer this person has given, and of every warning begun at
other times: 1 / (1 + exp(-(warning - reluctance u))) an observation. Beside it stands what the
known types of ABPS say, recognised by looks alone: sum over tau of beta(tau) P(accept | tau). All
numbers (`Habits`) come from simulated people; no recording of a real person has a share in them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml
from numpy.typing import NDArray
from scipy.special import expit, log_expit, logsumexp

from fabric_sim.character import Character
from fabric_sim.experiments.take_overs_watch import TakeOver
from fabric_study import strict_yaml

GRID = np.linspace(-3.0, 3.0, 25)  # of u, in spreads
LEAST = 1e-6  # no answer is impossible


class HabitsError(ValueError):
    """The numbers cannot be used; the message names file, entry and value."""


@dataclass(frozen=True)
class Habits:
    """How people answer take-overs, in log-odds; see the head of this file.

    states: x_s by name; a state that is not named does not matter. known, dials: of a known type,
    known + dials . (tau - 1/2) with tau (4,) = expertise, stamina, attention, collaborativeness.
    model: SHA-256 of the sorting model they were learnt with. people: how many were simulated.
    """

    mean: float
    spread: float
    warning: float
    reluctance: float
    states: dict[str, float]
    known: float
    dials: tuple[float, float, float, float]
    model: str = ""
    people: int = 0

    def __post_init__(self) -> None:
        numbers = {
            "mean": self.mean, "spread": self.spread, "warning": self.warning,
            "reluctance": self.reluctance, "known": self.known,
            **{f"dials[{i}]": value for i, value in enumerate(self.dials)},
            **{f"states/{name}": value for name, value in self.states.items()},
        }  # fmt: skip
        for name, value in numbers.items():
            if isinstance(value, bool) or not isinstance(value, (int, float)):
                raise HabitsError(f"{name}: {value!r} is not a number")
            if not math.isfinite(value):
                raise HabitsError(f"{name}: {value} is not finite")
        if len(self.dials) != 4:
            raise HabitsError(f"dials: must be 4 numbers, got {len(self.dials)}")
        if self.spread <= 0.0:
            raise HabitsError(f"spread: must be positive, got {self.spread}")

    @classmethod
    def load(cls, path: Path) -> Habits:
        """Read what `save` wrote; raises HabitsError or DefinitionError naming file and entry."""
        strict_yaml.read(path)  # refuses what is no mapping, or gives a key twice
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
        names = set(cls.__dataclass_fields__)
        for name in sorted(names ^ set(content)):
            raise HabitsError(f"{path}: '{name}' is {'missing' if name in names else 'unknown'}")
        if not isinstance(content["dials"], list) or not isinstance(content["states"], dict):
            raise HabitsError(f"{path}: dials must be a list and states a mapping")
        try:
            return cls(**{**content, "dials": tuple(content["dials"])})
        except HabitsError as error:
            raise HabitsError(f"{path}: {error}") from None

    def save(self, path: Path, head: str) -> None:
        """Write a YAML file; head: its comment lines."""
        content = {name: getattr(self, name) for name in self.__dataclass_fields__}
        text = yaml.safe_dump({**content, "dials": list(self.dials)}, sort_keys=False)
        path.write_text(head + text, encoding="utf-8")


@dataclass(frozen=True)
class History:
    """A person's n take-overs as arrays.

    state (n, n_states), types (n, n_types), accepted (n,) 0 or 1, warned and quiet (n,), answered
    (n, n): 1 where the column's answer was known at the row.
    """

    state: NDArray
    types: NDArray
    accepted: NDArray
    warned: NDArray
    quiet: NDArray
    answered: NDArray

    @classmethod
    def of(cls, take_overs: Sequence[TakeOver]) -> History:
        """From one person's take-overs in order, one at least."""
        n = len(take_overs)
        answered = np.zeros((n, n))
        for row, take_over in enumerate(take_overs):
            answered[row, list(take_over.answered)] = 1.0
        return cls(
            np.array([t.state for t in take_overs]),
            np.array([t.types for t in take_overs]),
            np.array([t.accepted for t in take_overs], dtype=float),
            np.array([t.warned for t in take_overs], dtype=float),
            np.array([t.quiet for t in take_overs], dtype=float),
            answered,
        )


@dataclass(frozen=True)
class Predictions:
    """P(accept) of each take-over of a person, (n,) each: by state and type together, by either
    with the other at its average, and by the known types, recognised by looks alone."""

    together: NDArray
    state: NDArray
    type: NDArray
    known_types: NDArray


class TypeStateModel:
    """The sum over types and states, for given numbers."""

    def __init__(self, habits: Habits, states: Sequence[str], types: Sequence[str]) -> None:
        """states: names of the sorting model's. types: names of the known types."""
        self._u = habits.spread * GRID
        x = np.array([habits.states.get(name, 0.0) for name in states])
        self._table = expit(habits.mean + self._u[:, None] + x[None, :])
        self._by_type = expit(habits.mean + self._u)
        log = -0.5 * GRID**2
        self._prior = log - logsumexp(log)
        odds = habits.warning - habits.reluctance * self._u
        self._began, self._not_begun = log_expit(odds), log_expit(-odds)
        dials = np.array([Character.parse(name).dials for name in types]) - 0.5
        self._by_looks = expit(habits.known + dials @ np.array(habits.dials))

    def predict(self, history: History) -> Predictions:
        """Return the chances; a row uses the answers that were known at it and no others."""
        joint = self._joint(history)
        belief = self.belief(history)
        prior = np.exp(self._prior)
        return Predictions(
            together=(belief * joint).sum(axis=1),
            state=joint @ prior,
            type=belief @ self._by_type,
            known_types=history.types @ self._by_looks,
        )

    def belief(self, history: History) -> NDArray:
        """beta over the grid of u at each take-over, (n, n_grid), rows sum to 1."""
        joint = self._joint(history)
        accepted = history.accepted[:, None] > 0.0
        answers = np.where(accepted, np.log(joint), np.log1p(-joint))
        log = self._prior + history.answered @ answers + self._others(history)
        return np.exp(log - logsumexp(log, axis=1, keepdims=True))

    def log_likelihood(self, history: History) -> float:
        """ln P of all answers, each given those before it, and of the other warnings, nats."""
        chance = self.predict(history).together
        answers = np.where(history.accepted > 0.0, chance, 1.0 - chance)
        others = logsumexp(self._prior + self._others(history)[-1])
        return float(np.log(answers).sum() + others)

    def _joint(self, history: History) -> NDArray:
        """P(accept | u) under the belief over states, (n, n_grid)."""
        return np.clip(history.state @ self._table.T, LEAST, 1.0 - LEAST)

    def _others(self, history: History) -> NDArray:
        """ln P of the other warnings so far, (n, n_grid)."""
        return history.warned[:, None] * self._began + history.quiet[:, None] * self._not_begun
