# SPDX-License-Identifier: BSD-3-Clause
"""The robots of the short-term study: the two of the thesis, and what they are measured against.

proactive, reactive, patient, eager: the shipped decision models. none: the person alone.
reactive_waiting: the reactive robot made more polite, its 15 s begin anew after a warning.
never_help: the proactive robot without its grasp. It may watch, prepare, point and cancel, and
plans with what it has (the proactive model without the action grasp).
oracle: the proactive model with the hidden state revealed, see `Oracle`.
"""

from __future__ import annotations

from collections import Counter
from functools import cache
from pathlib import Path
from shutil import copyfile
from typing import NamedTuple

import numpy as np

import fabric_planner as fp
from fabric_msgs.msg import Decision, Observation
from fabric_sim.batch_decider import AgentDecider, Decider, Names
from fabric_sim.batch_loop import Files
from fabric_sim.truth import Truth
from fabric_study.meter import at_border

TITLES = {
    "proactive": "proactive (A-POMDP)",
    "reactive": "reactive (MDP)",
    "reactive_waiting": "reactive, waits anew",
    "none": "person alone",
    "never_help": "never help",
    "oracle": "oracle",
    "patient": "patient",
    "eager": "eager",
}
SCENARIO = "inspection"
FILES = Files()
STAGE_1 = ("may_not_be_capable", "may_be_tired", "may_be_distracted")
STAGE_2 = ("needs_to_be_reminded", "needs_help", "does_not_need_help")
RUNNING = ("task_assigned_to_human", *STAGE_1, *STAGE_2, "warning_received")
_ACTIONS = {name.lower(): getattr(Decision, name) for name in
            ("IDLE", "PLANNING", "POINT", "GRASP", "CANCEL")}  # fmt: skip


def without_action(model: fp.Pomdp, name: str) -> fp.Pomdp:
    """Return a model without one of its actions. Raises ModelError when it has no such action."""
    dropped = model.action_index(name)
    kept = [index for index in range(model.n_actions) if index != dropped]
    return fp.Pomdp(
        model.states,
        [model.actions[index] for index in kept],
        model.observations,
        np.asarray(model.transition)[kept],
        np.asarray(model.observation)[kept],
        np.asarray(model.reward)[kept],
        model.discount,
        model.initial_belief,
        f"{model.name}_without_{name}",
    )


def write_never_help(folder: Path) -> Path:
    """Write the model of the robot that never helps and its observation map; return its path."""
    source = FILES.model("proactive", SCENARIO)
    path = folder / "never_help.pomdpx"
    fp.save_pomdpx(without_action(fp.load(source), "grasp"), path)
    copyfile(source.with_suffix(".obs.yaml"), path.with_suffix(".obs.yaml"))
    return path


class Oracle:
    """Knows the person's anticipated state and does what is best in it.

    It acts by the optimal policy of the fully observable MDP under the proactive model. It plans
    with the robot's idea of people, not with their model: it shows what perfect estimates would
    give this robot, not what any robot could do.
    """

    model_hash = "oracle"

    def __init__(self, model: fp.Pomdp) -> None:
        self.model: Names = model
        self._pomdp = model
        self._q = np.asarray(fp.solve_mdp(model).q)  # (A, S)

    def reset(self) -> None:
        """Nothing is remembered from task to task."""

    def set_model(self, path: str, keep_belief: bool) -> None:
        """Raises ValueError: the oracle has no other model."""
        raise ValueError(f"the oracle cannot change to {path}")

    def decide(self, observation: Observation, truth: Truth) -> Decision:
        """Return the best decision for the true state."""
        state = self._pomdp.state_index(truth.anticipated_state)
        values = self._q[:, state]
        best = int(values.argmax())
        return Decision(
            sequence=observation.sequence,
            observation_sequence=observation.sequence,
            task_id=observation.task_id,
            model_hash=self.model_hash,
            action=_ACTIONS[self._pomdp.actions[best]],
            action_index=best,
            belief=np.eye(self._pomdp.n_states)[state].tolist(),
            value=float(values[best]),
            lower_bound=float(values[best]),
            upper_bound=float(values[best]),
            runner_up=-1,
        )


class Believed(NamedTuple):
    """One decision: the person's true state and the likeliest of the robot's belief."""

    truth: str
    belief: str


class WatchedDecider:
    """Passes decisions on and counts what was believed while what was true."""

    def __init__(self, decider: Decider) -> None:
        self._decider = decider
        self.believed: Counter[Believed] = Counter()  # of the present task

    @property
    def model(self) -> Names:
        """The model in force."""
        return self._decider.model

    @property
    def model_hash(self) -> str:
        """Hash of the model in force."""
        return self._decider.model_hash

    def reset(self) -> None:
        """Begin a task; the counts of the last one are dropped."""
        self.believed = Counter()
        self._decider.reset()

    def set_model(self, path: str, keep_belief: bool) -> None:
        """Use another model file."""
        self._decider.set_model(path, keep_belief)

    def decide(self, observation: Observation, truth: Truth) -> Decision:
        """Decide, and count as TaskMeter judges."""
        decision = self._decider.decide(observation, truth)
        if not at_border(observation):
            likeliest = self.model.states[int(np.argmax(decision.belief))]
            self.believed[Believed(truth.anticipated_state, likeliest)] += 1
        return decision


@cache
def _agent(model: Path) -> AgentDecider:
    """Prepare a model once a process; an agent that was reset decides as a new one."""
    return AgentDecider(FILES.agent(model))


def decider_of(robot: str, model: Path) -> WatchedDecider:
    """Return what decides for a robot of TITLES; model: its decision model."""
    if robot == "oracle":
        return WatchedDecider(Oracle(fp.load(model)))
    return WatchedDecider(_agent(model))


def model_of(robot: str, folder: Path) -> Path:
    """Return the model file of a robot; folder: where write_never_help has put its model."""
    if robot == "never_help":
        return folder / "never_help.pomdpx"
    return FILES.model("proactive" if robot == "oracle" else robot, SCENARIO)
