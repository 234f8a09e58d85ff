# SPDX-License-Identifier: BSD-3-Clause
"""Shifts of the long-term study: one unknown person for some tasks beside a robot.

Everything random in a shift comes from its seed, so that all strategies meet the same person, the
same packages and the same errors of recognition, and a shift under a constant policy does not
depend on the shifts before it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Generic, TypeVar

import numpy as np

from fabric_abps import (
    Library,
    Policy,
    Selector,
    SelectorParameters,
    TrainedModels,
    child_seed,
)
from fabric_sim.batch_decider import AgentDecider
from fabric_sim.batch_files import Files
from fabric_sim.batch_loop import HeadlessRun, RunSetup, TaskResult
from fabric_sim.character import Character, named_generator
from fabric_sim.experiments.long_term_deciders import Prepared, PreparedDecider
from fabric_sim.experiments.observed_worker import ObservedWorker
from fabric_sim.experiments.scenario import OCCUPIED, occupied_seconds
from fabric_sim.worker import Worker
from fabric_sim.worker_model import ModelLibrary
from fabric_sim.worker_parameters import WorkerParameters

Person = TypeVar("Person", bound=Worker)

#: Columns of Course.figures and of results.csv.
MEASURES = {
    "reward": "discounted_reward",
    "success": "success",
    "warnings": "warnings",
    "duration_s": "duration_s",
}


@dataclass(frozen=True)
class Shift:
    """One person, new to the robot, for some tasks."""

    person: Character
    seed: int
    tasks: int


def unknown_person(seed: int, *place: object) -> Character:
    """Return a person drawn from the cube of characters, uniformly; never one of its corners."""
    return Character.random(named_generator(seed, "long-term", "person", *place))


def shifts_of(seed: int, part: str, people: int, repeats: int, tasks: int) -> list[list[Shift]]:
    """Return the shifts of `people` persons, each `repeats` times with other chance."""
    found = []
    for number in range(people):
        person = unknown_person(seed, number)
        seeds = [child_seed(seed, "long-term", part, number, again) for again in range(repeats)]
        found.append([Shift(person, shift_seed, tasks) for shift_seed in seeds])
    return found


@dataclass
class Course:
    """What happened over n tasks.

    figures: (n, len(MEASURES)). seconds: (n, len(OCCUPIED)), what the person was seen to be in.
    policies: (n,) names. types: (n, n_types) belief over the known types after each task, or (n, 0)
    when nobody estimates it. unlike: (n,) whether the person seemed unlike anyone known.
    """

    figures: np.ndarray
    seconds: np.ndarray
    policies: list[str]
    types: np.ndarray
    unlike: np.ndarray

    @classmethod
    def joined(cls, courses: Sequence[Course]) -> Course:
        """Return courses one after the other."""
        return cls(
            np.concatenate([course.figures for course in courses]),
            np.concatenate([course.seconds for course in courses]),
            [name for course in courses for name in course.policies],
            np.concatenate([course.types for course in courses]),
            np.concatenate([course.unlike for course in courses]),
        )


class ShiftStaff(Generic[Person]):
    """The person of a shift, who is fresh at its begin and goes on from task to task."""

    def __init__(self, shift: Shift, kind: Callable[..., Person]) -> None:
        """kind: class of the person."""
        parameters, library = _people()
        rng = named_generator(shift.seed, "worker", 1)
        self.person = kind(shift.person, rng, parameters, library)

    def worker(self, task_number: int) -> Person:
        """Return the person, whatever the task."""
        return self.person


@cache
def _people() -> tuple[WorkerParameters, ModelLibrary]:
    parameters = WorkerParameters.load()
    return parameters, ModelLibrary(parameters.model)


@dataclass
class World:
    """What all shifts of a scenario share; made before the processes are forked."""

    scenario: str
    files: Files = field(default_factory=Files)
    robots: dict[str, Prepared] = field(default_factory=dict)  # by the path of the model

    def prepare(self, policy: Policy) -> None:
        """Make a policy ready to run. Raises ValueError naming file and trouble."""
        path = str(policy.path)
        if path not in self.robots:
            maps = self.files.share("fabric_planner") / "config"
            prepared = Prepared.of(policy, maps)
            prepared.agent.reset()  # refuses what the robot cannot run
            self.robots[path] = prepared

    def constant(self, shift: Shift, policy: Policy) -> Course:
        """Run a shift under one policy."""
        run, staff = self._run(shift, policy.name, str(policy.path))
        tasks = [_figures(run.run_task(), staff) for _ in range(shift.tasks)]
        n = len(tasks)
        return _course(tasks, [policy.name] * n, np.zeros((n, 0)), np.zeros(n, dtype=bool))

    def rewards(self, shift: Shift, policy: Policy) -> np.ndarray:
        """(n,) reward of each task of `constant`, and nothing else of it: twice as fast."""
        setup = RunSetup(self.scenario, shift.person.name, policy.name, shift.seed)
        decider = AgentDecider(self.robots[str(policy.path)].agent)
        run = HeadlessRun(setup, self.files, ShiftStaff(shift, Worker), decider)
        return np.array([run.score_task()[0] for _ in range(shift.tasks)])

    def selected(self, shift: Shift, selector: Selector) -> Course:
        """Run a shift under a selector, which goes on from what it knows."""
        first = selector.library[selector.library.base].path
        run, staff = self._run(shift, "abps", str(first), selector)
        tasks, names, types, unlike = [], [], [], []
        for _ in range(shift.tasks):
            result = run.run_task()
            tasks.append(_figures(result, staff))
            names.append(selector.choice.policy)
            selector.end_task(result.row["discounted_reward"])
            types.append(selector.belief.probability)
            unlike.append(selector.unlike_anyone_known)
        return _course(tasks, names, np.array(types), np.array(unlike))

    def training(
        self, policy: Policy, human: str, seed: int, tasks: int
    ) -> list[tuple[float, list[int]]]:
        """Reward and type observation codes of each task of a person of a known type."""
        shift = Shift(Character.parse(human), seed, tasks)
        run, _ = self._run(shift, policy.name, str(policy.path))
        done = [run.run_task() for _ in range(tasks)]
        return [(result.row["discounted_reward"], result.codes) for result in done]

    def _run(
        self, shift: Shift, name: str, path: str, selector: Selector | None = None
    ) -> tuple[HeadlessRun, ShiftStaff[ObservedWorker]]:
        staff = ShiftStaff(shift, ObservedWorker)
        setup = RunSetup(self.scenario, shift.person.name, name, shift.seed)
        decider = PreparedDecider(self.robots, path)
        return HeadlessRun(setup, self.files, staff, decider, selector=selector), staff


def _figures(
    result: TaskResult, staff: ShiftStaff[ObservedWorker]
) -> tuple[list[float], list[float]]:
    seconds = occupied_seconds(staff.person.record)
    figures = [float(result.row[column]) for column in MEASURES.values()]
    return figures, [seconds[name] for name in OCCUPIED]


def _course(
    tasks: list[tuple[list[float], list[float]]],
    names: list[str],
    types: np.ndarray,
    unlike: np.ndarray,
) -> Course:
    figures, seconds = (np.array(part) for part in zip(*tasks, strict=True))
    return Course(figures, seconds, names, types, unlike)


@dataclass(frozen=True)
class Strategy:
    """A way to choose among the policies of a library."""

    name: str
    title: str
    library: Library
    models: TrainedModels
    parameters: SelectorParameters

    def selector(self) -> Selector:
        """Return a selector that knows nobody yet."""
        return Selector(self.library, self.models, self.parameters)
