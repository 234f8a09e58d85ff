# SPDX-License-Identifier: BSD-3-Clause
"""The tasks of one visit: a person who learns and tires, task after task, beside changing robots.

Every task runs through the headless loop with the person of the tasks before, so that practice,
tiredness and trust go on over the visit as the worker model has them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from fabric_abps import child_seed
from fabric_msgs.msg import TaskEvent
from fabric_sim.batch_loop import Files, HeadlessRun, RunSetup, TaskResult
from fabric_sim.character import Character, named_generator
from fabric_sim.rehearsal.robots import ABPS, Robots
from fabric_sim.worker import Worker
from fabric_sim.worker_model import ModelLibrary
from fabric_sim.worker_parameters import WorkerParameters


class ScoredRun(HeadlessRun):
    """A headless run that keeps the scored events of the last task."""

    def __init__(self, setup: RunSetup, files: Files, **stand_ins: Any) -> None:
        """stand_ins: `staff`, `decider` and `selector` of HeadlessRun."""
        super().__init__(setup, files, **stand_ins)
        self.scored: list[TaskEvent] = []

    def run_task(self) -> TaskResult:
        """Run the next task to its end."""
        self.scored = []
        return super().run_task()

    def _score(self, t: float, events: list[TaskEvent]) -> None:
        self.scored += events
        super()._score(t, events)


@dataclass(frozen=True)
class PlayedTask:
    """One task of a visit.

    row: as in results.csv. events: everything that was scored, in order, by the clock of the cell.
    person: the dials after the task. interferences, refusals: of the robot's grasps that the person
    noticed. remembered: items of the rules to remember.
    """

    row: dict[str, Any]
    events: list[TaskEvent]
    person: Character
    interferences: int
    refusals: int
    remembered: int


class Shift:
    """One person's tasks in the order of the visit. It is a `People` of the headless loop."""

    def __init__(self, person: Character, seed: int, robots: Robots) -> None:
        """seed: of this visit; equal seeds give equal tasks."""
        parameters = WorkerParameters.load()
        rng = named_generator(seed, "worker")  # every task brings a generator of its own
        self._worker = Worker(person, rng, parameters, ModelLibrary(parameters.model))
        self._seed, self._robots = seed, robots
        self._runs: dict[tuple[str, str], ScoredRun] = {}
        self.tasks = 0

    def worker(self, task_number: int) -> Worker:
        """The person, whatever the task."""
        return self._worker

    @property
    def person(self) -> Character:
        """The dials as the visit has made them by now."""
        return self._worker.person.now

    def play(self, definition: str, policy: str) -> PlayedTask:
        """Run the next task. Raises ValueError naming a definition or policy that is unknown."""
        run = self._run(definition, policy)
        before = (self._worker.interferences, self._worker.refusals)
        result = run.run_task()
        self.tasks += 1
        return PlayedTask(
            row={**result.row, "task": self.tasks},
            events=run.scored,
            person=self.person,
            interferences=self._worker.interferences - before[0],
            refusals=self._worker.refusals - before[1],
            remembered=self._remembered(definition),
        )

    def _run(self, definition: str, policy: str) -> ScoredRun:
        """One run for each kind of task beside each robot, so that ABPS goes on in its own."""
        key = (definition, policy)
        if key not in self._runs:
            self._runs[key] = self._new_run(definition, policy)
        return self._runs[key]

    def _new_run(self, definition: str, policy: str) -> ScoredRun:
        seed = child_seed(self._seed, "rehearsal", definition, policy)
        setup = RunSetup(definition, self._worker.person.character.name, policy, seed)
        selector = self._robots.selector() if policy == ABPS else None
        decider = self._robots.decider(policy, selector)
        options = {"staff": self, "decider": decider, "selector": selector}
        return ScoredRun(setup, self._robots.files, **options)

    def _remembered(self, definition: str) -> int:
        return len(self._robots.files.definition(definition).sorting_rules())
