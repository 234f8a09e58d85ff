# SPDX-License-Identifier: BSD-3-Clause
"""A worker who is watched: what happened in each task, and how long every state lasted."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from fabric_sim.character import Character, named_generator
from fabric_sim.worker import Worker
from fabric_sim.worker_events import EventKind, RobotView, WorkerEvent, WorldView
from fabric_sim.worker_model import ModelLibrary
from fabric_sim.worker_parameters import STATES, WorkerParameters


@dataclass
class TaskRecord:
    """One inspection task, from the moment the package stands at the pick point.

    began, ended, reported: s; when the package came, was dealt with, and when the task's status
    said so. success: the package was placed right. by_person: who placed it. seconds: time in s
    spent in every state of STATES; handling: the part of evaluating in which the hand is at the
    package, s. interferences, refusals: of the robot's grasps that the person
    noticed. attempts: for each grasp begun while evaluating, whether it will lift the package.
    events: what the person did until the package was dealt with. actions: how many of them began.
    """

    began: float | None = None
    ended: float | None = None
    reported: float | None = None
    success: bool = False
    by_person: bool = False
    interferences: int = 0
    refusals: int = 0
    attempts: list[bool] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=lambda: dict.fromkeys(STATES, 0.0))
    handling: float = 0.0
    events: list[WorkerEvent] = field(default_factory=list, repr=False)
    actions: int = 0

    @property
    def duration(self) -> float:
        """Time in s until the task's status said the end; 0 if the package never came."""
        came = self.began is not None and self.reported is not None
        return self.reported - self.began if came else 0.0

    def without_events(self) -> TaskRecord:
        """Return a copy that is cheap to hand to another process."""
        return replace(self, events=[])


class ObservedWorker(Worker):
    """A Worker that keeps the record of its current task; it behaves as any other."""

    record = TaskRecord()
    _since = 0.0

    def start_task(self, t: float, *arguments: object, **options: object) -> None:
        """Begin a task with an empty record."""
        self.record = TaskRecord()
        super().start_task(t, *arguments, **options)

    def step(self, t: float, robot: RobotView, world: WorldView) -> list[WorkerEvent]:
        """Advance as a Worker does, and take the time."""
        record = self.record
        if record.began is None and world.cube_at_pick_point and self._subtask:
            record.began = self._since = t
        self._take_time(t)
        events = super().step(t, robot, world)
        if events and record.began is not None and record.ended is None:
            record.events += events
            record.actions += sum(event.kind is EventKind.STARTED_ACTION for event in events)
        return events

    def _outcome_of_grasp(self) -> str:
        """Note the outcome when it is drawn: the robot interrupts more failures than liftings."""
        evaluating = self.state == "evaluating"
        outcome = super()._outcome_of_grasp()
        if evaluating:
            self.record.attempts.append(outcome == "success")
        return outcome

    def end_subtask(self, t: float, success: bool, by_person: bool) -> None:
        """Close the record with the fate of the package."""
        record = self.record
        if self._subtask and record.ended is None:
            self._take_time(t)
            record.ended, record.success, record.by_person = t, success, by_person
            record.interferences, record.refusals = self.interferences, self.refusals
        super().end_subtask(t, success, by_person)

    def end_task(self, t: float, success: bool) -> None:
        """Note the end of the task."""
        self.record.reported = t
        super().end_task(t, success)

    def _take_time(self, t: float) -> None:
        record = self.record
        if record.began is not None and record.ended is None:
            record.seconds[self.state] += t - self._since
            if self.state == "evaluating" and self.action == "grasp":
                record.handling += t - self._since
            self._since = t


class FreshStaff:
    """Gives each task a new person of one character, without a history, as in the recordings."""

    def __init__(
        self, character: Character, parameters: WorkerParameters, library: ModelLibrary
    ) -> None:
        self._character, self._parameters, self._library = character, parameters, library
        self._workers: dict[int, ObservedWorker] = {}

    def worker(self, task_number: int) -> ObservedWorker:
        """Return the person of a task; the task itself brings the generator."""
        if task_number not in self._workers:
            rng = named_generator(0, "nobody draws from this before the task brings its own")
            self._workers[task_number] = ObservedWorker(
                self._character, rng, self._parameters, self._library
            )
        return self._workers[task_number]
