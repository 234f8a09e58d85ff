# SPDX-License-Identifier: BSD-3-Clause
"""P(a take-over is accepted) = sum over types and states of beta(type) b(state) P(accept | both).

A type is one of the known types tau together with a willingness u of the person's own, on a grid;

    P(accept | tau, u, s) = 1 / (1 + exp(-(e + x_s))),    e = mean + dials . (tau - 1/2) + u

with u ~ N(0, spread^2). b(s) is the belief of the sorting model. beta starts as the belief over the
known types by what was seen (Eq. 5.1) times the prior of u, and Bayes' rule multiplies it by
the likelihood of every answer this person has given, and of every warning begun at other times,
1 / (1 + exp(-(warning - reluctance (e - mean)))) an observation. All numbers (`Habits`) come from
simulated people; no recording of a real person has a share in them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import yaml
from numpy.typing import NDArray
from scipy.special import log_expit, logsumexp

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

    dials: (4,) of expertise, stamina, attention, collaborativeness. states: x_s by name; a state
    that is not named does not matter. model: SHA-256 of the sorting model they were learnt with.
    people: how many were simulated.
    """

    mean: float
    spread: float
    dials: tuple[float, float, float, float]
    warning: float
    reluctance: float
    states: dict[str, float]
    model: str = ""
    people: int = 0

    def __post_init__(self) -> None:
        numbers = {
            "mean": self.mean, "spread": self.spread, "warning": self.warning,
            "reluctance": self.reluctance,
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
    with the other at its average, and by the known types alone (what was seen, not the answers)."""

    together: NDArray
    state: NDArray
    type: NDArray
    known_types: NDArray


class TypeStateModel:
    """The sum over types and states, for given numbers."""

    def __init__(self, habits: Habits, states: Sequence[str], types: Sequence[str]) -> None:
        """states: names of the sorting model's. types: names of the known types."""
        self._habits = habits
        dials = np.array([Character.parse(name).dials for name in types]) - 0.5
        known = habits.mean + dials @ np.array(habits.dials)
        self._e = (known[:, None] + habits.spread * GRID[None, :]).ravel()
        x = np.array([habits.states.get(name, 0.0) for name in states])
        self._table = np.exp(log_expit(self._e[:, None] + x[None, :]))

    @cached_property
    def _prior(self) -> NDArray:
        """ln of the prior of u, (n_grid,)."""
        log = -0.5 * GRID**2
        return log - logsumexp(log)

    def predict(self, history: History) -> Predictions:
        """Return the chances; a row uses the answers that were known at it and no others."""
        joint = np.clip(history.state @ self._table.T, LEAST, 1.0 - LEAST)
        by_type = np.exp(log_expit(self._e))[None, :]
        looks = self._looks(history.types)
        learnt = looks + self._learnt(history, joint)
        learnt -= logsumexp(learnt, axis=1, keepdims=True)
        blank = self._looks(np.full_like(history.types, 1.0 / history.types.shape[1]))
        return Predictions(
            together=_mean(learnt, joint),
            state=_mean(blank, joint),
            type=_mean(learnt, by_type),
            known_types=_mean(looks, by_type),
        )

    def log_likelihood(self, history: History) -> float:
        """ln P of all answers and of the other warnings, nats."""
        chance = self.predict(history).together
        answers = np.where(history.accepted > 0.0, chance, 1.0 - chance)
        blank = self._looks(history.types[-1:] * 0.0 + 1.0 / history.types.shape[1])
        others = logsumexp(blank + self._others(history)[-1:])
        return float(np.log(answers).sum() + others)

    def _looks(self, types: NDArray) -> NDArray:
        """ln of the belief over types before any answer, (n, n_types * n_grid)."""
        return (np.log(types)[:, :, None] + self._prior[None, None, :]).reshape(len(types), -1)

    def _learnt(self, history: History, joint: NDArray) -> NDArray:
        """ln-likelihood of the answers known and the other warnings, (n, n_types * n_grid)."""
        accepted = history.accepted[:, None] > 0.0
        answers = np.where(accepted, np.log(joint), np.log1p(-joint))
        return history.answered @ answers + self._others(history)

    def _others(self, history: History) -> NDArray:
        h = self._habits
        odds = h.warning - h.reluctance * (self._e - h.mean)
        began, not_begun = log_expit(odds), log_expit(-odds)
        return history.warned[:, None] * began + history.quiet[:, None] * not_begun


def _mean(log_weight: NDArray, values: NDArray) -> NDArray:
    """(n,): values (n or 1, m) under weights that sum to 1 in each row."""
    return (np.exp(log_weight) * values).sum(axis=1)
