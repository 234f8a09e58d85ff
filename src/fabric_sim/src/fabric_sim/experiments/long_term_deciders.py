# SPDX-License-Identifier: BSD-3-Clause
"""Robots whose policies were solved beforehand, so that hundreds of thousands of tasks can run.

A PreparedDecider changes its model between tasks, or inside one and then takes the belief along.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

import numpy as np

import fabric_planner as fp
from fabric_abps import Policy
from fabric_msgs.msg import Decision, Observation
from fabric_sim.batch_files import SOLVER_GAP, SOLVER_TIME, SOLVER_WORK
from fabric_sim.truth import Truth

#: Maps for models of the original layouts that have none beside them, by number of observations.
ORIGINAL_MAPS = {number: f"original_{number}.obs.yaml" for number in (6, 12, 14)}
_ACTIONS = {name.lower(): getattr(Decision, name) for name in
            ("IDLE", "PLANNING", "POINT", "GRASP", "CANCEL")}  # fmt: skip


@dataclass(frozen=True)
class Prepared:
    """A model with its policy and its observation map, ready to run."""

    path: Path
    map_path: Path
    solved: fp.AlphaVectors

    @classmethod
    def of(cls, policy: Policy, maps: Path) -> Prepared:
        """Read or solve a policy. maps: folder of ORIGINAL_MAPS.

        Raises ValueError naming the file and what is wrong with it.
        """
        solved = vectors_of(policy.path, getattr(policy, "solved", None))
        return cls(policy.path, map_of(policy.path, fp.load(policy.path), maps), solved)

    @cached_property
    def agent(self) -> fp.DecisionAgent:
        """What decides by it; raises ModelError when model and map do not fit the robot."""
        limits = fp.PlannerOptions(max_nodes=1)
        return fp.DecisionAgent(
            str(self.path), limits, str(self.map_path), solver="offline", policy=self.solved
        )

    @cached_property
    def map(self) -> fp.ObservationMap:
        """From observations to the model's symbols."""
        return fp.ObservationMap.load(str(self.map_path), self.agent.model.observations)


@cache
def vectors_of(path: Path, stored: Path | None) -> fp.AlphaVectors:
    """Return the policy of a model from a .policy file, or solve the model; once a process."""
    model = fp.load(path)
    if stored is not None:
        return fp.load_policy(stored, model)
    return fp.solve(model, time=SOLVER_TIME, gap=SOLVER_GAP, work=SOLVER_WORK).lower


def map_of(path: Path, model: fp.Pomdp, maps: Path) -> Path:
    """Return the map beside a model, else the shipped one of its layout.

    Raises ValueError naming the model when there is neither.
    """
    beside = path.with_suffix(".obs.yaml")
    if beside.exists():
        return beside
    name = ORIGINAL_MAPS.get(len(model.observations))
    if name is not None:
        with suppress(fp.ModelError):  # other names in as many observations
            fp.ObservationMap.load(str(maps / name), model.observations)
            return maps / name
    raise ValueError(
        f"{path}: there is no {beside.name} beside it, and its observations "
        f"{', '.join(model.observations)} are of no layout that comes with a map"
    )


class PreparedDecider:
    """Decides as the planner's agent does, without a search; it never looks at the truth."""

    def __init__(self, robots: Mapping[str, Prepared], first: str) -> None:
        """robots: by the path of the model. first: the path to begin with."""
        self._robots = robots
        self._now = robots[first]
        self._carried: CarriedBelief | None = None
        self._last: fp.AgentDecision | Decided | None = None

    @property
    def model(self) -> fp.Pomdp:
        """The model in force."""
        return self._now.agent.model

    @property
    def model_hash(self) -> str:
        """Hash of the model in force."""
        return self._now.agent.model_hash

    def reset(self) -> None:
        """Begin a task."""
        self._carried = self._last = None
        self._now.agent.reset()

    def set_model(self, path: str, keep_belief: bool) -> None:
        """Change to another prepared model; keep_belief: inside a task."""
        before, self._now = self._now, self._robots[path]
        if not keep_belief:
            self.reset()
        elif before is not self._now and self._last is not None:
            belief = before.agent.belief if self._carried is None else self._carried.belief
            self._carried = CarriedBelief(before, belief, self._last, self._now)

    def decide(self, observation: Observation, truth: Truth) -> Decision:
        """Return what the policy says to the belief after the observation."""
        if self._carried is not None:
            self._last = self._carried.decide(observation)
            return self._last.fill(Decision(), observation, self.model_hash)
        self._last = self._now.agent.decide(observation)
        return self._last.fill(Decision())


@dataclass(frozen=True)
class Decided:
    """A decision of CarriedBelief, in the words of AgentDecision."""

    action_name: str
    action_index: int
    observation_index: int
    belief: np.ndarray
    value: float

    def fill(self, message: Decision, observation: Observation, model_hash: str) -> Decision:
        """Set the fields of the message but its header."""
        message.sequence = message.observation_sequence = observation.sequence
        message.task_id = observation.task_id
        message.model_hash = model_hash
        message.action = _ACTIONS[self.action_name]
        message.action_index = self.action_index
        message.belief = self.belief.tolist()
        message.value = message.lower_bound = message.upper_bound = self.value
        message.runner_up = -1
        return message


class CarriedBelief:
    """A model taken up inside a task: what was believed goes on by the names of the states.

    As DecisionAgent.set_model does for models that it solves itself; an offline agent has a policy
    for one model only.
    """

    def __init__(
        self,
        before: Prepared,
        belief: np.ndarray,
        last: fp.AgentDecision | Decided,
        now: Prepared,
    ) -> None:
        self._now, self._pomdp = now, now.agent.model
        self._filter = fp.BeliefFilter(self._pomdp)
        old = before.agent.model
        weights = dict(zip(old.states, np.asarray(belief), strict=True))
        carried = np.array([weights.get(state, 0.0) for state in self._pomdp.states])
        if carried.sum() > 0.0:
            self._filter.reset(carried / carried.sum())
        self._symbol = _index(self._pomdp.observations, old.observations[last.observation_index])
        self._action = last.action_name

    @property
    def belief(self) -> np.ndarray:
        """(S,), sums to 1."""
        return self._filter.belief

    def decide(self, observation: Observation) -> Decided:
        """Return the decision after the next observation."""
        actions = [_canonical(name) for name in self._pomdp.actions]
        taken = actions.index(self._action if self._action in actions else "idle")
        self._symbol = self._now.map.symbol(observation, self._symbol)
        self._filter.update(taken, self._symbol)
        belief = self.belief
        chosen = self._now.solved.action(belief)
        self._action = actions[chosen]
        value = float(self._now.solved.value(belief))
        return Decided(self._action, chosen, self._symbol, belief, value)


def _index(names: list[str], name: str) -> int | None:
    return names.index(name) if name in names else None


def _canonical(name: str) -> str:
    """Return idle, planning, point, grasp or cancel for a model's word of it."""
    word = name.lower()
    return next(known for known in ("planning", "point", "grasp", "cancel", "idle")
                if known in word)  # fmt: skip
