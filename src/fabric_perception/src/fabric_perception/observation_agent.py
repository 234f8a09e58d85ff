# SPDX-License-Identifier: BSD-3-Clause
"""The observation agent: fuses percepts and task events, and says when a decision is due.

Fig. 6.5: a decision is due when a container has changed or a warning has begun (both interrupt),
when the recognised behaviour of the person has changed, when an attempt turns out to have failed,
and when nothing has changed for the time-out - the last three while a cube waits to be dealt with.
Tables 6.2 and 6.3 define what the observation then holds.
"""

import math

from fabric_msgs.clock import header_of, micro
from fabric_msgs.msg import HeadState, HumanActivity, Observation, TaskEvent, TaskState
from fabric_perception.parameters import ObservationParameters
from fabric_perception.recognition import Behaviour, Reading, Recogniser
from fabric_perception.subtask_tracker import RESOLUTION, SubtaskTracker

SUBTASK_END = (TaskEvent.SUBTASK_SUCCEEDED, TaskEvent.SUBTASK_FAILED)
TASK_END = (TaskEvent.TASK_SUCCEEDED, TaskEvent.TASK_FAILED)
RAISED_HAND = (TaskEvent.WARNING, TaskEvent.CALL)  # the model knows by what came before


class ObservationAgent:
    """One agent for a run of many tasks; its observations are numbered from 1 without gaps.

    All times are seconds on the clock of the messages and must not run backwards within a task.
    Observations are made from TASK_STARTED to the end of the task. The subtask that ends a task
    and the end itself are one observation, so that a model sees its terminal symbol once.
    """

    def __init__(self, parameters: ObservationParameters | None = None) -> None:
        self._parameters = parameters or ObservationParameters()
        self._sequence = 0
        self._warning_told = False
        self._reset(TaskState())

    def start_task(self, t: float, state: TaskState) -> None:
        """Forget the last task when `state` is of another one; later states change nothing."""
        _check_time(t)
        if state.task_id != self._task.task_id:
            self._reset(state)

    def on_task_event(self, t: float, event: TaskEvent) -> list[Observation]:
        """Take a scored thing; return the observation it makes due, if any.

        Events of other tasks are ignored. Raises ValueError when time runs backwards.
        """
        if event.task_id != self._task.task_id:
            return []
        t = self._advance(t)
        if event.kind == TaskEvent.TASK_STARTED:
            self._running = True
        elif not self._running:
            return []
        elif event.kind == TaskEvent.SUBTASK_STARTED:
            self._subtask.start(t, self._gesture() == HumanActivity.GRASP)
        elif event.kind in SUBTASK_END:
            return self._on_subtask_end(t, event)
        elif event.kind in RAISED_HAND:
            return self._on_warning(t)
        elif event.kind in TASK_END:
            return self._on_task_end(t, event)
        elif event.kind == TaskEvent.TASK_ABORTED:
            self._running = False
        return []

    def on_percepts(self, t: float, activity: HumanActivity, head: HeadState) -> list[Observation]:
        """Take the percepts of the moment `t`; return the observation they make due, if any.

        Raises ValueError when the activity is malformed or time runs backwards.
        """
        return self.on_reading(t, self.read(activity, head), activity.evidence_age)

    def read(self, activity: HumanActivity, head: HeadState) -> Reading:
        """Return what percepts say. Raises ValueError when the activity is malformed."""
        return self._recogniser.read(activity, head)

    def on_reading(self, t: float, reading: Reading, age: float) -> list[Observation]:
        """As `on_percepts`, of percepts that are read; age: of the gesture evidence, s."""
        before = self._recogniser.behaviour
        t = self._advance(t)
        if self._warning_told:
            self._recogniser.force_warning()
            self._warning_told = False
        hold = t < self._warning_held_until - RESOLUTION
        self._recogniser.take(reading, age, hold)
        self._read_at = t
        return self._conclude(t, before)

    def _conclude(self, t: float, before: Behaviour | None) -> list[Observation]:
        """Compare what is believed now with what was before; return what that makes due."""
        now = self._recogniser.behaviour
        assert now is not None  # the recogniser believes its first percept
        failures = self._subtask.failed_attempts
        self._track(t, before, now)
        changed = before != now or self._subtask.failed_attempts > failures
        trigger = self._trigger(t, before, now, changed)
        return [] if trigger is None else [self._observe(t, trigger)]

    @property
    def quiet_until(self) -> float:
        """Time in s before which percepts like the last ones bring nothing; may be past.

        Valid after percepts, until the next task event.
        """
        if self._warning_told or not self._recogniser.settled:
            return self._time
        until = self._subtask.fails_at
        if self._time < self._warning_held_until:
            until = min(until, self._warning_held_until)
        if self._running and self._subtask.active:
            until = min(until, self._last_observation + self._parameters.same_action_timeout)
        return until - RESOLUTION

    def _reset(self, state: TaskState) -> None:
        self._task = state
        self._recogniser = Recogniser(self._parameters)
        self._subtask = SubtaskTracker(self._parameters.settling_time)
        self._running = False
        self._started = False
        self._ended = 0
        self._pending: Observation | None = None
        self._time = -math.inf
        self._read_at = -math.inf
        self._last_observation: float = -math.inf
        self._warning_held_until: float = -math.inf
        self._warning_told = False

    def _advance(self, t: float) -> float:
        _check_time(t)
        t = micro(t)
        if t < self._time:
            raise ValueError(f"time runs backwards from {self._time} s to {t} s")
        self._time = t
        return t

    def _gesture(self) -> int:
        behaviour = self._recogniser.behaviour
        return HumanActivity.OTHER if behaviour is None else behaviour.gesture

    def _track(self, t: float, before: Behaviour | None, now: Behaviour) -> None:
        grasped = before is not None and before.gesture == HumanActivity.GRASP
        grasps = now.gesture == HumanActivity.GRASP
        self._subtask.pass_time(t, now.gesture == HumanActivity.WARN)
        if grasps and not grasped:
            self._subtask.grasp_begins()
        if grasped and not grasps:
            self._subtask.grasp_ends(t)

    def _trigger(
        self, t: float, before: Behaviour | None, now: Behaviour, changed: bool
    ) -> int | None:
        """Say why a decision is due. Between two cubes only a warning and its end make it so: a
        person who waits for the belt is neither idle nor distracted (6.2.4.1).
        """
        if not self._running:
            return None
        warns = now.gesture == HumanActivity.WARN
        warned = before is not None and before.gesture == HumanActivity.WARN
        if self._started and warns and not warned:
            return Observation.TRIGGER_WARNING
        if not self._subtask.active and not (self._started and warned and not warns):
            return None
        if not self._started:
            return Observation.TRIGGER_START
        if changed:
            return Observation.TRIGGER_ACTION_CHANGE
        if t - self._last_observation >= self._parameters.same_action_timeout - RESOLUTION:
            return Observation.TRIGGER_TIMEOUT
        return None

    def _on_warning(self, t: float) -> list[Observation]:
        """The fast road holds the arm at once; the percepts of the moment carry the observation,
        or have been here: then it does not wait for others.
        """
        self._warning_held_until = t + self._parameters.warning_hold
        if self._read_at < t:
            self._warning_told = True
            return []
        before = self._recogniser.behaviour
        self._recogniser.force_warning()
        return self._conclude(t, before)

    def _on_subtask_end(self, t: float, event: TaskEvent) -> list[Observation]:
        observation = self._fill(t, Observation.TRIGGER_SUBTASK)
        success = event.kind == TaskEvent.SUBTASK_SUCCEEDED
        by_person = event.by == TaskEvent.BY_PERSON
        by_robot = event.by == TaskEvent.BY_ROBOT
        observation.subtask_success = by_person and success
        observation.subtask_failure = by_person and not success
        observation.robot_success = by_robot and success
        observation.robot_failure = by_robot and not success
        self._ended += 1
        self._subtask.end()
        if self._ended >= self._task.subtasks_total:
            self._pending = observation  # the end of the task follows at once
            return []
        return [self._number(t, observation)]

    def _on_task_end(self, t: float, event: TaskEvent) -> list[Observation]:
        observation = self._pending or self._fill(t, Observation.TRIGGER_SUBTASK)
        self._pending = None
        observation.task_success = event.kind == TaskEvent.TASK_SUCCEEDED
        observation.task_failure = event.kind == TaskEvent.TASK_FAILED
        self._running = False
        return [self._number(t, observation)]

    def _observe(self, t: float, trigger: int) -> Observation:
        return self._number(t, self._fill(t, trigger))

    def _fill(self, t: float, trigger: int) -> Observation:
        """Observables that are seen directly, and the clocks; O1, O2, O8, O9 are false."""
        behaviour = self._recogniser.behaviour or Behaviour(HumanActivity.OTHER, False, False)
        observation = Observation.__new__(Observation)  # every field is set here
        observation.header, observation.sequence = header_of(t), 0
        observation.task_id, observation.trigger = self._task.task_id, trigger
        observation.task_success = observation.task_failure = False
        observation.subtask_success = observation.subtask_failure = False
        observation.robot_success = observation.robot_failure = False
        observation.detected = behaviour.detected
        observation.looking_around = behaviour.looking_around
        observation.grasp_attempt = behaviour.gesture == HumanActivity.GRASP
        observation.warning = behaviour.gesture == HumanActivity.WARN
        observation.idle = behaviour.gesture == HumanActivity.IDLE
        observation.subtask_elapsed = micro(self._subtask.elapsed(t))
        observation.waiting_time = micro(self._subtask.waiting(t))
        observation.failed_attempts = self._subtask.failed_attempts
        return observation

    def _number(self, t: float, observation: Observation) -> Observation:
        self._sequence += 1
        observation.sequence = self._sequence
        self._started = True
        self._last_observation = t
        return observation


def _check_time(t: float) -> None:
    if not math.isfinite(t):
        raise ValueError(f"time is {t}")
