# SPDX-License-Identifier: BSD-3-Clause
"""The task manager: shows the rules, starts the task, scores every placement once, ends it.

Thesis Fig. 6.3. A task walks through these phases; each has a time limit, counted on the stamps of
`conveyor/state`, so the manager needs neither clock nor timer:

    RULES   the rules are shown for their time
    BELT    the belt brings the next cube
    WORK    the cube stands at the pick point, or somebody has it; the belt waits, but brings back a
            cube that was put down upstream
    OVERRUN t_max is over: the belt runs on, towards the box at its end
    DONE    the last cube is somewhere
"""

import enum
import math
from dataclasses import dataclass

from fabric_msgs.clock import header_of, micro
from fabric_msgs.msg import (
    Container,
    ContainerArray,
    ConveyorState,
    SubtaskResult,
    TaskEvent,
    TaskState,
)
from fabric_study.policies import ON_CALL
from fabric_study.stamps import checked
from fabric_study.tasks import TaskDefinition

RESOLUTION = 1e-6  # s
OWNERS = {
    Container.OWNER_PERSON: TaskEvent.BY_PERSON,
    Container.OWNER_ROBOT: TaskEvent.BY_ROBOT,
    Container.OWNER_BELT: TaskEvent.BY_NOBODY,
}


class Phase(enum.Enum):
    """Where the task is."""

    NEW = enum.auto()
    RULES = enum.auto()
    BELT = enum.auto()
    WORK = enum.auto()
    OVERRUN = enum.auto()
    DONE = enum.auto()


@dataclass
class Counters:
    """Numbers that go on from task to task of a run; share one object between its managers."""

    events: int = 0  # sequence of the last TaskEvent
    states: int = 0  # sequence of the last TaskState


class TaskManager:
    """One task. Times are seconds on the stamps of the messages and never run backwards."""

    def __init__(
        self,
        definition: TaskDefinition,
        task_id: int,
        seed: int,
        counters: Counters | None = None,
        policy: str = "",
    ) -> None:
        """policy: what decides for the robot, for the record."""
        self._definition = definition
        self._counters = counters or Counters()
        self._phase = Phase.NEW
        self._phase_began: float | None = None  # None: at the next conveyor/state
        self._time = 0.0
        self._belt: tuple[float, bool] | None = None
        self._scored: set[int] = set()
        self._events: list[TaskEvent] = []
        self._subtask_began = 0.0
        self._results: list[SubtaskResult] = []
        self._last_warning: float | None = None
        self._called = False  # the robot is at work because somebody asked for help
        self._changed = False
        self._state = state = TaskState()
        state.task_id, state.seed = task_id, seed
        state.scenario, state.definition = definition.scenario, definition.name
        state.status, state.subtasks_total = TaskState.WAITING, definition.count
        state.rules = definition.sorting_rules()
        state.cube_colours = list(definition.cube_colours(seed))
        state.cube_rules = list(definition.cube_rules(seed))
        state.policy, state.load = policy, definition.load

    @property
    def state(self) -> TaskState:
        """A copy of the task as it is now; its sequence has risen when anything changed."""
        state = TaskState.__new__(TaskState)
        for name in TaskState.__slots__:  # header and rules are never changed in place
            setattr(state, name, getattr(self._state, name))
        state.rules, state.cube_colours = list(state.rules), list(state.cube_colours)
        state.cube_rules = list(state.cube_rules)
        return state

    @property
    def belt_command(self) -> tuple[float, bool] | None:
        """The newest (speed m/s, ignore_sensor) for the belt, handed out once."""
        command, self._belt = self._belt, None
        return command

    @property
    def results(self) -> list[SubtaskResult]:
        """The subtasks that have ended, in order."""
        return list(self._results)

    @property
    def finished(self) -> bool:
        """Whether the task has ended, in whatever way."""
        return self._phase is Phase.DONE

    @property
    def quiet_until(self) -> float:
        """Time in s before which a belt and containers that stay alike bring nothing."""
        if self._phase in (Phase.NEW, Phase.DONE):
            return math.inf
        if self._phase_began is None:
            return self._time
        return self._phase_began + self._limit() - RESOLUTION

    def begin(self, t: float) -> None:
        """Show the rules. The display time counts from the next conveyor/state."""
        if self._phase is not Phase.NEW:
            raise RuntimeError(f"task {self._state.task_id} has begun before")
        self._open(t)
        self._enter(Phase.RULES, None)
        self._state.status = TaskState.SHOWING_RULES
        self._belt = (0.0, False)
        self._changed = True
        self._close()

    def on_conveyor(self, t: float, conveyor: ConveyorState) -> list[TaskEvent]:
        """Take the belt's state, which is also the clock; return what is scored now."""
        self._open(t)
        if self._phase_began is None:
            self._phase_began = self._time
        if self._phase is Phase.RULES and self._passed(self._definition.rules_display_time):
            self._start()
        if self._phase is Phase.BELT and conveyor.cube_at_pick_point:
            self._begin_subtask()
        self._check_limits()
        return self._close()

    def on_containers(self, t: float, containers: ContainerArray) -> list[TaskEvent]:
        """Take the contents of all containers; every cube counts where it is seen first."""
        self._open(t)
        for container in containers.containers:
            for cube_id in container.cube_ids:
                self._place(cube_id, container)
        return self._close()

    def on_warning(self, t: float) -> list[TaskEvent]:
        """Take the fast road of a warning; signals without a gap between them are one warning.

        Under policy on_call it is a call while the robot does nothing: nobody has called it for
        this cube, or it was sent away.
        """
        self._open(t)
        last, self._last_warning = self._last_warning, self._time
        apart = last is None or self._time - last >= self._definition.warning_gap - RESOLUTION
        if apart and self._running():
            if self._waits_for_call():
                self._call()
            else:
                self._called = False
                self._state.warnings += 1
                self._event(TaskEvent.WARNING, TaskEvent.BY_PERSON)
        return self._close()

    @property
    def objection_to_call(self) -> str:
        """Why the robot cannot be called now, as a sentence, or nothing."""
        if self._state.policy != ON_CALL:
            return f"nobody waits for a call under policy {self._state.policy}"
        if not self._running():
            return "no task is running"
        return "the robot has been called already" if self._called else ""

    def on_call(self, t: float) -> list[TaskEvent]:
        """Take the button that calls the robot; nothing happens when there is an objection."""
        self._open(t)
        if self._running() and self._waits_for_call():
            self._call()
        return self._close()

    def _waits_for_call(self) -> bool:
        return self._state.policy == ON_CALL and not self._called

    def _call(self) -> None:
        self._called = True
        self._event(TaskEvent.CALL, TaskEvent.BY_PERSON)

    def abort(self, t: float) -> list[TaskEvent]:
        """End the task without a result; nothing happens when it has ended."""
        self._open(t)
        if self._phase is not Phase.DONE:
            self._finish(TaskEvent.TASK_ABORTED, TaskState.ABORTED)
        return self._close()

    def _open(self, t: float) -> None:
        t = checked(t)
        if t < self._time:
            raise ValueError(f"time runs backwards from {self._time} s to {t} s")
        self._time = t

    def _close(self) -> list[TaskEvent]:
        events, self._events = self._events, []
        if self._changed:
            self._changed = False
            self._counters.states += 1
            self._state.sequence = self._counters.states
            self._state.header = header_of(self._time)
            if self._state.status != TaskState.SHOWING_RULES:
                self._state.duration = micro(self._time - self._state.started)
        return events

    def _running(self) -> bool:
        return self._phase in (Phase.BELT, Phase.WORK, Phase.OVERRUN)

    def _enter(self, phase: Phase, t: float | None) -> None:
        self._phase = phase
        self._phase_began = t

    def _limit(self) -> float:
        """How long the phase may last, s."""
        definition = self._definition
        if self._phase is Phase.WORK:
            return definition.t_max
        if self._phase is Phase.RULES:
            return definition.rules_display_time
        return definition.arrival_limit if self._phase is Phase.BELT else definition.overrun_limit

    def _passed(self, limit: float) -> bool:
        began = self._time if self._phase_began is None else self._phase_began
        return self._time - began >= limit - RESOLUTION

    def _start(self) -> None:
        self._state.status = TaskState.RUNNING
        self._state.started = self._time
        self._event(TaskEvent.TASK_STARTED)
        self._bring_next()

    def _bring_next(self) -> None:
        self._enter(Phase.BELT, self._time)
        self._belt = (self._definition.belt_speed, False)

    def _begin_subtask(self) -> None:
        self._enter(Phase.WORK, self._time)
        self._event_start(self._expected())

    def _event_start(self, cube_id: int) -> None:
        self._subtask_began = self._time
        self._event(TaskEvent.SUBTASK_STARTED, cube_id=cube_id)

    def _check_limits(self) -> None:
        definition = self._definition
        if self._phase is Phase.WORK and self._passed(definition.t_max):
            self._enter(Phase.OVERRUN, self._time)
            self._belt = (definition.belt_speed, True)
        elif self._phase is Phase.OVERRUN and self._passed(definition.overrun_limit):
            self._end_subtask(self._expected(), False, TaskEvent.BY_NOBODY, "")
        elif self._phase is Phase.BELT and self._passed(definition.arrival_limit):
            self._end_subtask(self._expected(), False, TaskEvent.BY_NOBODY, "")

    def _expected(self) -> int:
        """The first cube that is not scored yet; ids are 1..count in the order of arrival."""
        return next(
            number for number in range(1, self._definition.count + 1) if number not in self._scored
        )

    def _place(self, cube_id: int, container: Container) -> None:
        known = 1 <= cube_id <= self._definition.count
        if not known or cube_id in self._scored or not self._running():
            return
        by = OWNERS.get(container.owner, TaskEvent.BY_NOBODY)
        rule = self._state.rules[self._state.cube_rules[cube_id - 1]]
        fits = rule.label == container.label
        self._end_subtask(cube_id, fits and by != TaskEvent.BY_NOBODY, by, container.label)

    def _end_subtask(self, cube_id: int, success: bool, by: int, container: str) -> None:
        if self._phase is Phase.BELT:  # the sensor has missed it: a subtask starts before it ends
            self._event_start(cube_id)
        self._scored.add(cube_id)
        self._called = False
        kind = TaskEvent.SUBTASK_SUCCEEDED if success else TaskEvent.SUBTASK_FAILED
        score = self._score(success, by)
        self._state.score += score
        self._count(success, by)
        self._event(kind, by, cube_id=cube_id, container=container, score=score)
        result = SubtaskResult.__new__(SubtaskResult)  # every field is set here
        result.number, result.success, result.by = len(self._scored), success, by
        result.cube_colour = self._state.cube_colours[cube_id - 1]
        result.container = container
        result.duration = self._time - self._subtask_began
        self._results.append(result)
        self._go_on()

    def _score(self, success: bool, by: int) -> int:
        scores = self._definition.scores
        if not success:
            return scores.wrong
        return scores.person if by == TaskEvent.BY_PERSON else scores.robot

    def _count(self, success: bool, by: int) -> None:
        outcome = "succeeded" if success else "failed"
        who = "person" if by == TaskEvent.BY_PERSON else "robot"
        name = f"{outcome}_by_{who}"
        setattr(self._state, name, getattr(self._state, name) + 1)

    def _go_on(self) -> None:
        definition, state = self._definition, self._state
        succeeded = state.succeeded_by_person + state.succeeded_by_robot
        failed = state.failed_by_person + state.failed_by_robot
        if definition.fails_at is not None and failed >= definition.fails_at:
            self._finish(TaskEvent.TASK_FAILED, TaskState.FAILED)
        elif len(self._scored) < definition.count:
            self._bring_next()
        elif succeeded >= definition.success_needs:
            self._finish(TaskEvent.TASK_SUCCEEDED, TaskState.SUCCEEDED)
        else:
            self._finish(TaskEvent.TASK_FAILED, TaskState.FAILED)

    def _finish(self, kind: int, status: int) -> None:
        if self._state.status in (TaskState.WAITING, TaskState.SHOWING_RULES):
            self._state.started = self._time
        self._event(kind)
        self._state.status = status
        self._enter(Phase.DONE, self._time)
        self._belt = (0.0, False)

    def _event(
        self,
        kind: int,
        by: int = TaskEvent.BY_NOBODY,
        cube_id: int = 0,
        container: str = "",
        score: int = 0,
    ) -> None:
        self._counters.events += 1
        event = TaskEvent.__new__(TaskEvent)  # every field is set here
        event.header, event.sequence = header_of(self._time), self._counters.events
        event.task_id, event.kind, event.by = self._state.task_id, kind, by
        event.cube_id = cube_id
        event.cube_colour = self._state.cube_colours[cube_id - 1] if cube_id else 0
        event.container, event.score = container, score
        self._events.append(event)
        self._changed = True
