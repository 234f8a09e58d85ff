# SPDX-License-Identifier: BSD-3-Clause
"""Workers modelled elsewhere: a human MDP in a POMDPX file runs as a simulated person.

    staff_member = FileWorker(WorkerFile.load("someone.pomdpx", parameters), rng, parameters)

T, R and discount are the file's. Seconds, the answers to the robot and the memory of sorting rules
are those of worker.yaml for a person in the middle of every dial (docs/models/own_workers.md).
"""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from .character import Character
from .truth import Truth
from .worker import Worker
from .worker_model import (
    ACTION_INDEX,
    GRID,
    STATE_INDEX,
    ModelLibrary,
    Solver,
    WorkerModel,
    conditioned,
    planner_solver,
)
from .worker_parameters import ACTIONS, STATES, WorkerParameters

SUFFIXES = (".pomdpx", ".pomdp")

#: Other names of our states and actions: those of the published simulation (thesis Fig. 6.28).
STATE_ALIASES = {
    "TaskHuman": "task_assigned",
    "GlobalSuccess": "success",
    "GlobalFail": "failure",
    "FailedToGrasp": "failed_to_grasp",
    "NoAttention": "no_attention",
    "Evaluating": "evaluating",
    "Tired": "tired",
    "Recovery": "recovery",
    "RobotInterfered": "robot_interfered",
    "WarningTheRobot": "warns_the_robot",
    "RobotIsWarned": "robot_receives_the_warning",
    "TaskRobot": "task_assigned_to_robot",
}
ACTION_ALIASES = {
    "graspAttempt": "grasp",
    "lookAround": "look_around",
    "idle": "idle",
    "walkAway": "walk_away",
    "warnRobot": "warn",
}

#: A file says nothing about the dials; what else depends on them is that of a middling person.
NEUTRAL = Character(0.5, 0.5, 0.5, 0.5)

_AT_WORK = ("task_assigned", "evaluating", "no_attention", "tired", "failed_to_grasp")
_CHOICES = ("idle", "grasp", "look_around", "walk_away")


class WorkerFileError(ValueError):
    """A file that is no worker; the message names the file, what is wrong and what is allowed."""


def is_worker_file(human: str) -> bool:
    """Whether the argument `human:=` names a file."""
    return human.lower().endswith(SUFFIXES)


class WorkerFile:
    """The MDP of one file, in the place of a ModelLibrary: one model, whatever the dials.

    name: stem of the file. Only the refusal of help follows the dials: n_r moves its log-odds by as
    much as it would move those of a middling built-in person.
    """

    def __init__(
        self,
        name: str,
        T: np.ndarray,
        R: np.ndarray,
        discount: float,
        parameters: WorkerParameters,
        solver: Solver = planner_solver,
    ) -> None:
        """T: (A, S, S), R: (A, S), ordered as ACTIONS and STATES; checked by `load`."""
        self.name = name
        options = replace(parameters.model, discount=discount)
        self._model = _FileModel(NEUTRAL, T, R, _allowed(), options, solver)
        self._model.solve()
        self._middling = ModelLibrary(parameters.model, solver)
        self._shifted: dict[int, _FileModel] = {}

    @classmethod
    def load(
        cls,
        path: str | Path,
        parameters: WorkerParameters | None = None,
        solver: Solver = planner_solver,
    ) -> WorkerFile:
        """Read a file in any order of states and actions.

        Raises ValueError: what the planner's loader cannot read, with its place; WorkerFileError
        for states or actions that are missing or unknown, observations, and discounts of 1.
        """
        import fabric_planner  # noqa: PLC0415  # late, as in worker_model

        model = fabric_planner.load(path)
        states = _order(path, "state", model.states, STATES, STATE_ALIASES)
        actions = _order(path, "action", model.actions, ACTIONS, ACTION_ALIASES)
        if not model.fully_observable:
            raise WorkerFileError(
                f"{path}: has {model.n_observations} observations; allowed: none, a worker knows "
                'its own state (StateVar with fullyObs="true", no ObsVar)'
            )
        if not model.discount < 1.0:
            raise WorkerFileError(f"{path}: discount is {model.discount:g}; allowed: below 1")
        T = np.array(model.transition)[np.ix_(actions, states, states)]
        R = np.array(model.reward)[np.ix_(actions, states)]
        parameters = parameters or WorkerParameters.load()
        return cls(Path(path).stem, T, R, model.discount, parameters, solver)

    def model(self, character: Character) -> WorkerModel:
        """Return the file's model with the refusal of somebody of this collaborativeness."""
        step = round(character.collaborativeness * GRID)
        if step not in self._shifted:
            now = NEUTRAL.with_dials(collaborativeness=step / GRID)
            shift = _log_odds(self._middling.model(now).refusal)
            shift -= _log_odds(self._middling.model(NEUTRAL).refusal)
            self._shifted[step] = self._model.shifted(shift)
        return self._shifted[step]


class _FileModel(WorkerModel):
    """A WorkerModel whose refusal is moved by log-odds."""

    _shift = 0.0

    def solve(self) -> None:
        """Solve now, so that copies share policy and rows."""
        self._policy = self.policy
        self._now = _without_robot(self.T)

    def shifted(self, log_odds: float) -> _FileModel:
        """Return the same model with other odds of refusing."""
        other = copy.copy(self)
        other._shift = log_odds
        return other

    @property
    def refusal(self) -> float:
        """Probability to warn rather than to watch, from the row idle | robot_interfered."""
        row = self.T[ACTION_INDEX["idle"], STATE_INDEX["robot_interfered"]]
        warns = float(row[STATE_INDEX["warns_the_robot"]])
        watches = float(row[STATE_INDEX["robot_interfered"]])
        if warns == 0.0:
            return 0.0
        odds = _log_odds(warns / (warns + watches)) + self._shift
        return 1.0 / (1.0 + math.exp(-odds))


class FileWorker(Worker):
    """A person whose mind is a file."""

    def __init__(
        self, file: WorkerFile, rng: np.random.Generator, parameters: WorkerParameters
    ) -> None:
        super().__init__(NEUTRAL, rng, parameters, file)
        self._name = file.name

    def truth(self, t: float) -> Truth:
        """Return the hidden state; the type is the file's name, the dials start at 0.5."""
        return super().truth(t)._replace(human_type=self._name)

    def _arrive(self, t: float, state: str) -> None:
        """Recovery is a break: whoever gets there without walking walks away first."""
        if state != "recovery" or self.away:
            super()._arrive(t, state)
            return
        self._begin(t, "walk_away")
        self._agenda.add(t + self._timing.leave.draw(self._rng), self._leave)


def _order(
    path: str | Path, what: str, found: Sequence[str], ours: Sequence[str], aliases: dict[str, str]
) -> list[int]:
    """Return for each of our names its place in the file; raises WorkerFileError by name."""
    allowed = ", ".join(f"{name} (or {alias})" for alias, name in aliases.items() if alias != name)
    places: dict[str, int] = {}
    for place, word in enumerate(found):
        name = aliases.get(word, word)
        if name not in ours:
            raise WorkerFileError(f"{path}: unknown {what} '{word}'; allowed: {allowed}")
        if name in places:
            raise WorkerFileError(f"{path}: {what} '{name}' is there twice: the second is '{word}'")
        places[name] = place
    missing = [name for name in ours if name not in places]
    if missing:
        raise WorkerFileError(
            f"{path}: {what} '{missing[0]}' is missing; needed, in any order: {allowed}"
        )
    return [places[name] for name in ours]


def _allowed() -> np.ndarray:
    """(A, S): at work the file decides; elsewhere only the robot and the clock do."""
    mask = np.zeros((len(ACTIONS), len(STATES)), dtype=bool)
    mask[ACTION_INDEX["idle"]] = True
    for state in _AT_WORK:
        for action in _CHOICES:
            mask[ACTION_INDEX[action], STATE_INDEX[state]] = True
    warns = STATE_INDEX["warns_the_robot"]
    mask[:, warns] = False
    mask[ACTION_INDEX["warn"], warns] = True
    return mask


def _without_robot(T: np.ndarray) -> np.ndarray:
    """Return `conditioned(T)` in which nobody warns a robot that is not there, (A, S, S)."""
    keep = np.ones_like(T)
    warns, warned = STATE_INDEX["warns_the_robot"], STATE_INDEX["robot_receives_the_warning"]
    with_robot = [STATE_INDEX["robot_interfered"], warns, warned]
    without = [s for s in range(len(STATES)) if s not in with_robot]
    keep[np.ix_(range(len(ACTIONS)), without, [warns, warned])] = 0.0
    keep[:, warned, warns] = 0.0
    return conditioned(T * keep)


def _log_odds(probability: float) -> float:
    bounded = min(1.0 - 1e-6, max(1e-6, probability))
    return math.log(bounded / (1.0 - bounded))


def to_pomdp(model: WorkerModel, discount: float, name: str = "worker") -> Any:
    """Return a built-in worker's MDP as a fabric_planner.Pomdp, ready for save_pomdpx."""
    import fabric_planner  # noqa: PLC0415  # late, as in worker_model

    O = np.broadcast_to(np.eye(len(STATES)), model.T.shape)  # noqa: E741  # the paper's symbol
    start = np.eye(len(STATES))[STATE_INDEX["task_assigned"]]
    names = (list(STATES), list(ACTIONS), list(STATES))
    return fabric_planner.Pomdp(*names, model.T, np.array(O), model.R, discount, start, name)
