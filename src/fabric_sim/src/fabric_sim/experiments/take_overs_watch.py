# SPDX-License-Identifier: BSD-3-Clause
"""What is known of a person at the moment the recorded robot takes over, and nothing of later.

A Watcher goes through a person's recordings observation by observation, as the decision node would
have: the belief over the states of the sorting model (fed with what the recorded robot did), the
belief over the known types of ABPS (Eq. 5.1), and which earlier take-overs have been answered.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import fabric_planner as fp
from fabric_abps import Selector, SignalEncoder, TypeBelief
from fabric_planner.replay import Step
from fabric_sim.batch_files import Files
from fabric_sim.experiments.take_overs_read import SCENARIO, Begin, Task, answer, begins, warns

POLICY = "proactive"


@dataclass(frozen=True)
class TakeOver:
    """One take-over and what was known when it began.

    state: (n_states,) belief of the sorting model. types: (n_types,) belief over the known types
    by what was seen. answered: numbers, from 0, of this person's earlier take-overs whose answer
    was known. warned, quiet: earlier observations, not answers to a take-over, at which a warning
    began or might have begun. warnings_task, warnings_person: begun so far in this task, in all.
    idle: s the person has been seen idle. accepted, ended_by: the outcome.
    """

    person: str
    task: int
    robot: str
    time: float  # s since the recording began
    subtask: int
    first: bool
    begun: bool
    state: NDArray
    types: NDArray
    answered: tuple[int, ...]
    warned: int
    quiet: int
    warnings_task: int
    warnings_person: int
    idle: float
    accepted: bool
    ended_by: str


class Models:
    """The sorting model of the proactive policy, its observation map, and the known types."""

    def __init__(self, path: Path, selector: Selector) -> None:
        """path: of the model, its map beside it."""
        self.path = path
        self.pomdp = fp.load(path)
        rules = path.with_suffix(".obs.yaml")
        self.symbols = fp.ObservationMap.load(str(rules), self.pomdp.observations)
        self.selector = selector

    @classmethod
    def shipped(cls, files: Files) -> Models:
        """As the project ships them."""
        return cls(files.model(POLICY, SCENARIO), files.selector(SCENARIO))

    def action(self, name: str | None) -> int:
        """Index of the recorded robot's action; idle before the first and where it is unknown."""
        known = name in self.pomdp.actions
        return self.pomdp.action_index(name if known else "idle")


class Watcher:
    """One person, task after task."""

    def __init__(self, models: Models) -> None:
        self._models = models
        given, trained = models.selector.parameters, models.selector.models
        self._effective = given.effective_observations
        self._types = TypeBelief(trained.types, given.forgetting, given.floor)
        self._answered: list[int] = []
        self._open: list[int] = []
        self._count = self._warned = self._quiet = self._warnings = 0

    def watch(self, task: Task) -> list[TakeOver]:
        """Go through the next task and return its take-overs."""
        steps = task.recording.steps
        there = {begin.index: begin for begin in begins(steps)}
        seen = _TaskView(self._models, task.recording.robot)
        before, found = self._warnings, []
        for index, step in enumerate(steps):
            self._learn(steps[index - 1] if index else None, step)
            seen.see(step)
            if index in there:
                found.append(
                    self._take_over(task, there[index], steps, seen, self._warnings - before)
                )
                self._open.append(self._count)
                self._count += 1
        self._settle()
        self._types.update(seen.evidence(self._effective))
        return found

    def _take_over(
        self, task: Task, begin: Begin, steps: Sequence[Step], seen: _TaskView, warnings: int
    ) -> TakeOver:
        step, outcome = steps[begin.index], answer(steps, begin.index)
        return TakeOver(
            person=task.person,
            task=task.number,
            robot=task.recording.robot,
            time=step.time,
            subtask=step.decides_for,
            first=begin.first,
            begun=begin.begun,
            state=seen.state,
            types=_posterior(self._types.probability, seen.evidence(self._effective)),
            answered=tuple(self._answered),
            warned=self._warned,
            quiet=self._quiet,
            warnings_task=warnings,
            warnings_person=self._warnings,
            idle=seen.idle,
            accepted=outcome.accepted,
            ended_by=outcome.ended_by,
        )

    def _learn(self, before: Step | None, step: Step) -> None:
        """Warnings answer the take-overs that are open, placements accept them; other warnings
        are counted by themselves."""
        warning = warns(step)
        began = warning and not (before and before.observation.warning)
        self._warnings += began
        if warning and self._open:
            self._settle()
        elif began or not step.observation.warning:
            self._warned += began
            self._quiet += not began
        if step.placement:
            self._settle()

    def _settle(self) -> None:
        """The answer to the open take-overs is known from now on."""
        self._answered += self._open
        self._open = []


class _TaskView:
    """What one task looked like up to an observation."""

    def __init__(self, models: Models, robot: str) -> None:
        self._models = models
        self._filter = fp.BeliefFilter(models.pomdp)
        self._symbol: int | None = None
        self._action = "idle"
        self._encoder, self._codes = SignalEncoder(), []
        names = models.selector.library.names
        self._policy = names.index(robot) if robot in names else None
        self._idle_since: float | None = None
        self.idle = 0.0

    def see(self, step: Step) -> None:
        """Take the next observation; the robot's answer to it acts from then on."""
        o, models = step.observation, self._models
        self._symbol = models.symbols.symbol(o, self._symbol)
        self._filter.update(models.action(self._action), self._symbol)
        self._codes.append(self._encoder.encode(o))
        self._action = step.recorded or self._action
        if not (o.idle and o.detected):
            self._idle_since = None
        elif self._idle_since is None:
            self._idle_since = step.time
        self.idle = 0.0 if self._idle_since is None else step.time - self._idle_since

    @property
    def state(self) -> NDArray:
        """(n_states,) belief before the robot's answer, sums to 1."""
        return np.array(self._filter.belief)

    def evidence(self, effective: float) -> NDArray:
        """ln P(sigma | tau, pi) so far, (n_types,) nats; 0 beside a robot that is no known policy.

        A task so far weighs like `effective` of its observations at most.
        """
        observation = self._models.selector.models.observation
        if self._policy is None or not self._codes:
            return np.zeros(len(self._models.selector.models.types))
        return observation.log_likelihood(self._codes, self._policy, effective)


def _posterior(prior: NDArray, evidence: NDArray) -> NDArray:
    """Eq. 5.1, (n_types,)."""
    weight = prior * np.exp(evidence - evidence.max())
    return weight / weight.sum()


def watch_all(models: Models, people: dict[str, list[Task]]) -> dict[str, list[TakeOver]]:
    """Return the take-overs of everybody, in order; nobody's are known to anybody else."""
    found = {}
    for person, tasks in people.items():
        watcher = Watcher(models)
        found[person] = [take_over for task in tasks for take_over in watcher.watch(task)]
    return found
