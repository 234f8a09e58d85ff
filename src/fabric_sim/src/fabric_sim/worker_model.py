# SPDX-License-Identifier: BSD-3-Clause
"""The worker as a Markov decision process (thesis Fig. 6.28, sections 4.3.1 and 6.4.1.1).

A character gives T (A, S, S) and R (A, S); solving them gives Q and a softmax policy. History moves
the character: T(s, a, s' | n_r, k_t) is the T of `effective_character(character, history, ...)`.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from itertools import accumulate
from typing import Any, Protocol

import numpy as np
from mypy_extensions import mypyc_attr

from .character import INFLUENCES, Character
from .worker_parameters import (
    ACTIONS,
    STATES,
    HistoryParameters,
    ModelParameters,
    WorkerParameterError,
    known,
    number,
)

STATE_INDEX = {name: index for index, name in enumerate(STATES)}
ACTION_INDEX = {name: index for index, name in enumerate(ACTIONS)}

#: Dials are rounded to this grid before a model is built, so that models can be shared.
GRID = 50

#: solver(T (A, S, S), R (A, S), discount) -> object with q (A, S).
Solver = Callable[[np.ndarray, np.ndarray, float], Any]


def planner_solver(T: np.ndarray, R: np.ndarray, discount: float) -> Any:
    """Solve with fabric_planner; imported late because most uses of a worker need no policy."""
    import fabric_planner  # noqa: PLC0415

    return fabric_planner.solve_mdp_arrays(T, R, discount)


@dataclass
class History:
    """What a person went through: the n_r and k_t of Eq. T(s, a, s' | n_r, k_t).

    unwanted: unwanted interferences not made good yet (n_r). work: tasks' worth of work since
    the person was last fresh (k_t). practised: tasks' worth of own work in all.
    """

    unwanted: float = 0.0
    work: float = 0.0
    practised: float = 0.0


def effective_character(character: Character, h: History, p: HistoryParameters) -> Character:
    """Return the character as it is now: tired and bored by k_t, annoyed by n_r, practised."""
    tiredness = min(1.0, h.work / p.horizon)
    annoyance = 1.0 - math.exp(-h.unwanted / p.patience)
    practice = p.practice * (1.0 - math.exp(-h.practised / p.practice_horizon))
    practised = character.expertise + (1.0 - character.expertise) * practice
    return Character(
        practised * (1.0 - p.strain * tiredness),
        character.stamina * (1.0 - p.weariness * tiredness),
        character.attention * (1.0 - p.boredom * tiredness),
        character.collaborativeness * (1.0 - p.annoyance * annoyance),
    )


class TransitionTables:
    """The rows of worker.yaml as arrays: base distributions and the pulls on them.

    Raises WorkerParameterError naming state, action, next state and sum of a bad row.
    """

    def __init__(self, parameters: ModelParameters) -> None:
        self.base = np.zeros((len(ACTIONS), len(STATES), len(STATES)))
        self._pulls: list[tuple[int, int, int, float, float, np.ndarray]] = []
        self.allowed = _allowed_mask(parameters.allowed)
        self._copies_of_idle: list[tuple[int, int]] = []
        for state, rows in parameters.transitions.items():
            known(state, STATES, "transitions")
            for action, row in rows.items():
                known(action, ACTIONS, f"transitions.{state}")
                self._read_row(state, action, row)
        self._fill_the_rest()

    def _read_row(self, state: str, action: str, row: dict) -> None:
        where = f"transitions.{state}.{action}"
        if not isinstance(row, dict) or not set(row) <= {"base", "pulls"} or "base" not in row:
            raise WorkerParameterError(f"{where}: needs base and may have pulls, got {row!r}")
        s, a = STATE_INDEX[state], ACTION_INDEX[action]
        self.base[a, s] = _distribution(row["base"], f"{where}.base")
        for index, pull in enumerate(row.get("pulls", [])):
            self._pulls.append((a, s, *_pull(pull, f"{where}.pulls[{index}]")))

    def _fill_the_rest(self) -> None:
        for end in ("success", "failure"):
            self.base[:, STATE_INDEX[end]] = np.eye(len(STATES))[STATE_INDEX[end]]
        idle = ACTION_INDEX["idle"]
        for s, state in enumerate(STATES):
            if not self.base[idle, s].any():
                raise WorkerParameterError(f"transitions.{state}.idle: missing")
            for a, action in enumerate(ACTIONS):
                if not self.base[a, s].any():
                    if self.allowed[a, s]:
                        raise WorkerParameterError(f"transitions.{state}.{action}: missing")
                    self._copies_of_idle.append((a, s))

    def matrix(self, character: Character) -> np.ndarray:
        """Return T (A, S, S) of a character; every row sums to 1."""
        T = self.base.copy()
        influences = character.influences
        for a, s, influence, most, power, target in self._pulls:
            row = T[a, s]
            row += most * influences[influence] ** power * (target - row)
        for a, s in self._copies_of_idle:
            T[a, s] = T[0, s]
        return T


class RewardTables:
    """Rewards by next state and by action, each a base plus influences times weights."""

    def __init__(self, rewards: dict, allowed: np.ndarray) -> None:
        if set(rewards) != {"next", "action", "misplaced"}:
            raise WorkerParameterError(f"rewards: needs next, action, misplaced; got {[*rewards]}")
        self._next = _weights(rewards["next"], STATES, "rewards.next")
        self._action = _weights(rewards["action"], ACTIONS, "rewards.action")
        misplaced = number(rewards["misplaced"], "rewards.misplaced")
        self._penalty = np.where(allowed, 0.0, misplaced)
        self._ends = [STATE_INDEX["success"], STATE_INDEX["failure"]]

    def matrix(self, character: Character, T: np.ndarray) -> np.ndarray:
        """Return R (A, S), the expected immediate reward; 0 in success and failure."""
        features = np.array((1.0, *character.influences))
        R = T @ (self._next @ features) + (self._action @ features)[:, None] + self._penalty
        R[:, self._ends] = 0.0
        return R


def _pull(pull: Any, where: str) -> tuple[int, float, float, np.ndarray]:
    if not isinstance(pull, dict) or not {"by", "most", "to"} <= set(pull) <= {
        "by", "most", "to", "power",
    }:  # fmt: skip
        raise WorkerParameterError(f"{where}: needs by, most, to and may have power, got {pull!r}")
    most = number(pull["most"], f"{where}.most")
    power = number(pull.get("power", 1.0), f"{where}.power")
    if not 0.0 <= most <= 1.0:
        raise WorkerParameterError(f"{where}.most: {most:g} is outside [0, 1]")
    if power <= 0.0:
        raise WorkerParameterError(f"{where}.power: {power:g} is not positive")
    influence = INFLUENCES.index(known(pull["by"], INFLUENCES, f"{where}.by"))
    return influence, most, power, _distribution(pull["to"], f"{where}.to")


def _distribution(content: Any, where: str) -> np.ndarray:
    if not isinstance(content, dict):
        raise WorkerParameterError(f"{where}: expected state: probability, got {content!r}")
    row = np.zeros(len(STATES))
    for state, value in content.items():
        probability = number(value, f"{where}.{known(state, STATES, where)}")
        if probability < 0.0:
            raise WorkerParameterError(f"{where}.{state}: {probability:g} is negative")
        row[STATE_INDEX[state]] = probability
    if abs(row.sum() - 1.0) > 1e-9:
        raise WorkerParameterError(f"{where}: sums to {row.sum():g}, not 1")
    return row


def _weights(content: Any, names: tuple, where: str) -> np.ndarray:
    """Return (len(names), 9): the base, then the weight of each influence."""
    table = np.zeros((len(names), 1 + len(INFLUENCES)))
    columns = ("base", *INFLUENCES)
    for name, weights in content.items():
        row = table[names.index(known(name, names, where))]
        for column, value in weights.items():
            place = f"{where}.{name}.{known(column, columns, f'{where}.{name}')}"
            row[columns.index(column)] = number(value, place)
    return table


def _allowed_mask(allowed: dict) -> np.ndarray:
    mask = np.zeros((len(ACTIONS), len(STATES)), dtype=bool)
    for state, actions in allowed.items():
        for action in actions:
            known(action, ACTIONS, f"allowed.{state}")
            mask[ACTION_INDEX[action], STATE_INDEX[known(state, STATES, "allowed")]] = True
    for state, any_action in zip(STATES, mask.any(axis=0), strict=True):
        if not any_action:
            raise WorkerParameterError(f"allowed.{state}: missing or empty")
    return mask


def conditioned(T: np.ndarray) -> np.ndarray:
    """Return T (A, S, S) given that neither the robot nor the task's status interferes now.

    T holds what a person expects of the robot and of the clock. In a running task the robot's
    action and the task's status say themselves when they happen, so their columns are dropped and
    the rows renormalised: success stays for a grasp only (its cube is placed later); a row that
    held nothing else stays where it is.
    """
    keep = np.ones_like(T)
    interfered, to_robot = STATE_INDEX["robot_interfered"], STATE_INDEX["task_assigned_to_robot"]
    keep[:, :, STATE_INDEX["failure"]] = 0.0
    keep[:, :, to_robot] = 0.0
    keep[:, :, STATE_INDEX["success"]] = 0.0
    keep[ACTION_INDEX["grasp"], :, STATE_INDEX["success"]] = 1.0
    keep[:, :, interfered] = 0.0
    keep[:, interfered, interfered] = 1.0
    rows = T * keep
    sums = rows.sum(axis=2)
    stay = sums <= 0.0
    rows[stay] = np.broadcast_to(np.eye(len(STATES)), T.shape)[stay]
    return rows / rows.sum(axis=2, keepdims=True)


def _cumulative(row: np.ndarray) -> list[float]:
    """What np.cumsum gives, sooner for a short row."""
    return list(accumulate(row.tolist()))


@mypyc_attr(allow_interpreted_subclasses=True)
class WorkerModel:
    """T, R and policy of one character; the policy is solved when it is first asked for.

    T: (A, S, S), rows sum to 1. R: (A, S). policy: (S, A), softmax over Q / temperature among the
    allowed actions. States and actions are ordered as STATES and ACTIONS.
    """

    def __init__(
        self,
        character: Character,
        T: np.ndarray,
        R: np.ndarray,
        allowed: np.ndarray,
        parameters: ModelParameters,
        solver: Solver,
    ) -> None:
        self.character = character
        self.T, self.R, self.allowed = T, R, allowed
        self._parameters, self._solver = parameters, solver
        self._policy: np.ndarray | None = None
        self._choices: dict[int, list[float]] = {}
        self._outcomes: dict[int, list[float]] = {}
        self._now: np.ndarray | None = None

    @property
    def policy(self) -> np.ndarray:
        """(S, A): probability of each action, rows sum to 1."""
        if self._policy is None:
            q = np.asarray(self._solver(self.T, self.R, self._parameters.discount).q)
            preference = np.where(self.allowed, q / self._parameters.temperature, -np.inf)
            weight = np.exp(preference - preference.max(axis=0))
            self._policy = (weight / weight.sum(axis=0)).T
        return self._policy

    @property
    def now(self) -> np.ndarray:
        """T without what the robot and the clock do: `conditioned(T)`, (A, S, S)."""
        if self._now is None:
            self._now = conditioned(self.T)
        return self._now

    @property
    def refusal(self) -> float:
        """Probability to warn rather than to watch when the robot interferes, origin apart."""
        row = self.T[ACTION_INDEX["idle"], STATE_INDEX["robot_interfered"]]
        warns = row[STATE_INDEX["warns_the_robot"]]
        return float(warns / (warns + row[STATE_INDEX["robot_interfered"]]))

    def sample_action(self, state: int, rng: np.random.Generator) -> int:
        """Draw the index of an action in a state from the policy."""
        cumulative = self._choices.get(state)
        if cumulative is None:
            cumulative = self._choices[state] = _cumulative(self.policy[state])
        return bisect_right(cumulative, rng.random() * cumulative[-1])

    def sample_next(self, state: int, action: int, rng: np.random.Generator) -> int:
        """Draw the index of the next state from the conditioned T."""
        key = action * len(STATES) + state
        cumulative = self._outcomes.get(key)
        if cumulative is None:
            cumulative = self._outcomes[key] = _cumulative(self.now[action, state])
        return bisect_right(cumulative, rng.random() * cumulative[-1])


class ModelSource(Protocol):
    """Where a worker has its models from: a ModelLibrary, or a file."""

    def model(self, character: Character) -> WorkerModel:
        """Return the model of a character."""


@mypyc_attr(allow_interpreted_subclasses=True)
class ModelLibrary:
    """Builds the models of characters and keeps them; one library may serve many workers."""

    def __init__(self, parameters: ModelParameters, solver: Solver = planner_solver) -> None:
        self._parameters, self._solver = parameters, solver
        self._transitions = TransitionTables(parameters)
        self._rewards = RewardTables(parameters.rewards, self._transitions.allowed)
        self._models: dict[tuple[int, ...], WorkerModel] = {}

    def build(self, character: Character) -> WorkerModel:
        """Return the model of exactly this character."""
        T = self._transitions.matrix(character)
        R = self._rewards.matrix(character, T)
        return WorkerModel(
            character, T, R, self._transitions.allowed, self._parameters, self._solver
        )

    def model(self, character: Character) -> WorkerModel:
        """Return the model of the nearest character on the grid of 1/GRID, built only once."""
        key = tuple(round(dial * GRID) for dial in character.dials)
        if key not in self._models:
            self._models[key] = self.build(Character(*(step / GRID for step in key)))
        return self._models[key]
