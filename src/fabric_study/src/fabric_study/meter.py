# SPDX-License-Identifier: BSD-3-Clause
"""What a task was worth: one row of results.csv, computed from the messages of the task.

Messages of different topics may arrive in any order: the meter keeps what it is told and puts it in
order by the stamps when the row is asked for.
"""

import math
from bisect import bisect_left, bisect_right
from collections import Counter, deque
from collections.abc import Sequence
from pathlib import PurePath
from typing import NamedTuple

from fabric_msgs.msg import (
    Decision,
    GroundTruth,
    ModelInfo,
    Observation,
    PolicyChoice,
    TaskEvent,
    TaskState,
    TypeBelief,
)
from fabric_study.event_rows import LogRow, log_rows
from fabric_study.policies import ABPS, MODEL_SUFFIXES
from fabric_study.stamps import to_seconds

Value = int | float | str | None

COLUMNS = (
    "task",
    "seed",
    "scenario",
    "human",
    "policy",
    "model",
    "discounted_reward",
    "success",
    "warnings",
    "false_warnings",
    "duration_s",
    "decisions",
    "human_succeeded",
    "human_failed",
    "robot_succeeded",
    "robot_failed",
    "human_success_rate",
    "human_contribution",
    "task_success_rate",
    "efficiency",
    "stage1_accuracy",
    "stage2_accuracy",
    "type_belief_entropy",
)

DISCOUNT = 0.98  # per decision
WARNING_REWARD = -3.0
WARNING_STATE = "warns_the_robot"  # of GroundTruth
WARNING_MEMORY = 5.0  # s; a warning recognised later than this after the person's is a false one
SUCCESS_REWARD = 6.0
FAILURE_REWARD = {"inspection": -3.0, "sorting": -6.0}  # Table 6.4 is the sorting scenario's

STAGES = (
    ("may_not_be_capable", "may_be_tired", "may_be_distracted"),
    ("needs_to_be_reminded", "needs_help", "does_not_need_help"),
)
END_OF_SUBTASK = (TaskEvent.SUBTASK_SUCCEEDED, TaskEvent.SUBTASK_FAILED)


def policy_name(policy: str) -> str:
    """Return the name of a policy in the tables: a model file goes by its name, not its place."""
    path = PurePath(policy)
    return path.stem if path.suffix.lower() in MODEL_SUFFIXES else policy


class TrueMoment(NamedTuple):
    """What the meter needs of a GroundTruth."""

    t: float  # s
    state: str
    word: str  # anticipated_state
    human: str  # human_type


class TaskMeter:
    """Meter of one task; messages of other tasks are ignored."""

    def __init__(self, task_state: TaskState, human: str, policy: str) -> None:
        """`human` names the worker until the truth does; `policy` is what was asked for."""
        if task_state.scenario not in FAILURE_REWARD:
            raise ValueError(
                f"scenario {task_state.scenario!r}; known are {', '.join(FAILURE_REWARD)}"
            )
        self._state = task_state
        self._human = human
        self._policy = self._model = policy_name(policy)
        self._entropy: float | None = None
        self._observations: dict[int, Observation] = {}
        self._observed_at: dict[int, float] = {}  # s, by the same sequence
        self._decisions: dict[int, Decision] = {}
        self._events: dict[int, TaskEvent] = {}
        self._truths: dict[int, TrueMoment] = {}
        self._states: dict[str, list[str]] = {}

    def on_state(self, state: TaskState) -> None:
        """Take the newest state of the task."""
        if self._mine(state) and state.sequence >= self._state.sequence:
            self._state = state

    def on_model(self, info: ModelInfo) -> None:
        """Take the names of a model's states, for the accuracies."""
        self._states[info.hash] = list(info.states)

    def on_policy(self, choice: PolicyChoice) -> None:
        """Take the policy that was selected for this task."""
        if self._mine(choice):
            self._model = choice.policy

    def on_type_belief(self, belief: TypeBelief) -> None:
        """Take the belief over types that the task has left; there is one a task."""
        if self._mine(belief) and self._entropy is None:
            self._entropy = belief.entropy

    def on_observation(self, observation: Observation) -> None:
        """Take an observation of the task."""
        if self._mine(observation):
            self._observations[observation.sequence] = observation
            self._observed_at[observation.sequence] = to_seconds(observation)

    def on_decision(self, decision: Decision) -> None:
        """Take a decision of the task."""
        if self._mine(decision):
            self._decisions[decision.sequence] = decision

    def on_event(self, event: TaskEvent) -> None:
        """Take a scored thing of the task."""
        if self._mine(event):
            self._events[event.sequence] = event

    def on_truth(self, truth: GroundTruth) -> None:
        """Take the simulated person's hidden state."""
        if self._mine(truth):
            moment = TrueMoment(
                to_seconds(truth), truth.state, truth.anticipated_state, truth.human_type
            )
            self.on_moment(truth.sequence, moment)

    def on_moment(self, sequence: int, moment: TrueMoment) -> None:
        """As `on_truth`; moments like the one before need not be told."""
        self._truths[sequence] = moment

    def complete(self) -> bool:
        """Say whether everything that belongs to the ended task is there.

        That is its last event, the observation that tells the end, a decision on each
        observation, the state names of each deciding model, and the type belief under ABPS.
        """
        kinds = {event.kind for event in self._events.values()}
        if TaskEvent.TASK_ABORTED in kinds:
            return True
        if not kinds & {TaskEvent.TASK_SUCCEEDED, TaskEvent.TASK_FAILED}:
            return False
        if not any(o.task_success or o.task_failure for o in self._observations.values()):
            return False
        known = all(d.model_hash in self._states for d in self._decisions.values())
        believed = self._policy != ABPS or self._entropy is not None
        return known and believed and set(self._decisions) >= set(self._observations)

    def decisions(self) -> list[Decision]:
        """Return the decisions in order."""
        return [self._decisions[sequence] for sequence in sorted(self._decisions)]

    def log(self) -> list[LogRow]:
        """Return everything that happened in the task, in order (see event_rows)."""
        return log_rows(
            self._policy, self._state, self._events, self._observations, self._decisions
        )

    def row(self) -> dict[str, Value]:
        """Return the row in the order of COLUMNS; what is undefined is None."""
        state = self._state
        counts = self._counts()
        human_succeeded, human_failed, robot_succeeded, _ = counts
        contribution = _ratio(human_succeeded, state.subtasks_total)  # Eq. 6.3
        success_rate = _ratio(human_succeeded + robot_succeeded, state.subtasks_total)  # Eq. 6.4
        accuracy = [self._accuracy(stage) for stage in STAGES]
        values = (
            state.task_id,
            state.seed,
            state.scenario,
            self._human_name(),
            self._policy,
            self._model,
            self.discounted_reward(),
            self._success(),
            len(self._warning_stamps()),
            self._false_warnings(),
            state.duration,
            len(self._decisions),
            *counts,
            _ratio(human_succeeded, human_succeeded + human_failed),  # Eq. 6.6
            contribution,
            success_rate,
            _product(success_rate, contribution),  # Eq. 6.5
            *accuracy,
            self._entropy,
        )
        return dict(zip(COLUMNS, values, strict=True))

    def discounted_reward(self) -> float:
        """Return Eq. 6.2: the sum of Eq. 6.1 over the subtasks.

        A reward comes with the observation that tells it, and is discounted by the number of
        observations (so decisions) made in the subtask before that one. A warning costs what it
        costs when the person gives it, told or not.
        """
        stamps = sorted(self._observed_at.values())
        told = self._told_of_ends()
        warnings = deque(self._warning_stamps())
        reward, begun = 0.0, 0  # number of observations that belong to earlier subtasks
        for event in self._ends_of_subtasks():
            t = to_seconds(event)
            while warnings and warnings[0] <= t:
                reward += WARNING_REWARD * _discount(stamps, warnings.popleft(), begun)
            reward += self._immediate(event) * _discount(stamps, t, begun)
            begun = bisect_left(stamps, t) + told[t]
        return reward + sum(WARNING_REWARD * _discount(stamps, t, begun) for t in warnings)

    def _mine(self, message: object) -> bool:
        return message.task_id == self._state.task_id  # type: ignore[attr-defined]

    def _told_of_ends(self) -> Counter[float]:
        """Count the observations that tell of the end of a subtask, by their time in s.

        What the person did in the same instant is observed after it and counts for the next.
        """
        return Counter(
            self._observed_at[sequence]
            for sequence, observation in self._observations.items()
            if observation.trigger == Observation.TRIGGER_SUBTASK
        )

    def _ends_of_subtasks(self) -> list[TaskEvent]:
        events = [self._events[sequence] for sequence in sorted(self._events)]
        return [event for event in events if event.kind in END_OF_SUBTASK]

    def _ordered_truths(self) -> list[TrueMoment]:
        return [self._truths[sequence] for sequence in sorted(self._truths)]

    def _warning_stamps(self) -> list[float]:
        """Times in s at which warnings began.

        Where the truth is known these are the warnings that the person gave: the true state became
        WARNING_STATE. Repeating a warning while the robot goes on is part of it. Without the truth
        they are the recognised ones.
        """
        if not self._truths:
            return self._recognised_warnings()
        return [began for began, _ in self._given_warnings()]

    def _given_warnings(self) -> list[tuple[float, float]]:
        """Begin and end of every warning that the person gave, s; an open end is infinite."""
        spans: list[tuple[float, float]] = []
        before = False
        for moment in self._ordered_truths():
            warns = moment.state == WARNING_STATE
            if warns and not before:
                spans.append((moment.t, math.inf))
            elif before and not warns:
                spans[-1] = (spans[-1][0], moment.t)
            before = warns
        return spans

    def _recognised_warnings(self) -> list[float]:
        events = [self._events[sequence] for sequence in sorted(self._events)]
        return [to_seconds(event) for event in events if event.kind == TaskEvent.WARNING]

    def _false_warnings(self) -> int | None:
        """Count the recognised warnings while which, and WARNING_MEMORY before, nobody warned.

        None without the truth.
        """
        if not self._truths:
            return None
        given = self._given_warnings()
        return sum(
            not any(began <= t < ended + WARNING_MEMORY for began, ended in given)
            for t in self._recognised_warnings()
        )

    def _immediate(self, end: TaskEvent) -> float:
        """Return the immediate reward of Table 6.4 for the end of a subtask."""
        if end.kind == TaskEvent.SUBTASK_SUCCEEDED:
            return SUCCESS_REWARD
        return FAILURE_REWARD[self._state.scenario]

    def _number_of(self, kind: int) -> int:
        return sum(event.kind == kind for event in self._events.values())

    def _counts(self) -> tuple[int, int, int, int]:
        """Subtasks: human succeeded, human failed, robot succeeded, robot (or belt) failed."""
        human = [e.kind for e in self._events.values() if e.by == TaskEvent.BY_PERSON]
        other = [e.kind for e in self._events.values() if e.by != TaskEvent.BY_PERSON]
        return (
            human.count(TaskEvent.SUBTASK_SUCCEEDED),
            human.count(TaskEvent.SUBTASK_FAILED),
            other.count(TaskEvent.SUBTASK_SUCCEEDED),
            other.count(TaskEvent.SUBTASK_FAILED),
        )

    def _success(self) -> int | None:
        if self._number_of(TaskEvent.TASK_SUCCEEDED):
            return 1
        return 0 if self._number_of(TaskEvent.TASK_FAILED) else None

    def _human_name(self) -> str:
        if not self._truths:
            return self._human
        return self._truths[min(self._truths)].human

    def _accuracy(self, stage: Sequence[str]) -> float | None:
        """Share of decisions whose most likely state was the truth, while the truth was in `stage`.

        Decisions of models that do not know the stage are not judged, nor are those at_border.
        """
        truths = self._ordered_truths()
        stamps = [truth.t for truth in truths]
        right = judged = 0
        for sequence, decision in self._decisions.items():
            names = self._states.get(decision.model_hash, [])
            observation = self._observations.get(sequence)
            if observation is None or at_border(observation):
                continue
            index = bisect_right(stamps, self._observed_at[sequence]) - 1
            if index < 0 or truths[index].word not in stage or not set(names) & set(stage):
                continue
            judged += 1
            right += names[_arg_max(decision.belief)] == truths[index].word
        return _ratio(right, judged)


def at_border(observation: Observation) -> bool:
    """Whether nothing has been seen yet of the task, or nothing is left to infer."""
    ended = observation.task_success or observation.task_failure
    return ended or observation.trigger == Observation.TRIGGER_START


def _discount(stamps: Sequence[float], t: float, begun: int) -> float:
    """Return DISCOUNT to the number of observations before t, not counting the first `begun`."""
    return DISCOUNT ** max(bisect_left(stamps, t) - begun, 0)


def _ratio(part: float, whole: float) -> float | None:
    return None if whole == 0 else part / whole


def _product(first: float | None, second: float | None) -> float | None:
    return None if first is None or second is None else first * second


def _arg_max(values: Sequence[float]) -> int:
    best = 0
    for index in range(1, len(values)):
        if values[index] > values[best]:
            best = index
    return best
