# SPDX-License-Identifier: BSD-3-Clause
"""What the person does, believed only after percepts in a row agree."""

import math
from collections.abc import Sequence
from typing import Any, Generic, NamedTuple, TypeVar

from fabric_msgs.msg import HeadState, HumanActivity
from fabric_perception.parameters import ObservationParameters

Value = TypeVar("Value")
N_GESTURES = 4
SUM_TOLERANCE = 1e-3  # posteriors travel as float32


class Debounced(Generic[Value]):
    """A value that changes when `percepts` readings in a row agree on another one."""

    def __init__(self, percepts: int) -> None:
        self._percepts = percepts
        self._candidate: Value | None = None
        self._count = 0
        self.value: Value | None = None  # None before the first reading

    @property
    def open(self) -> bool:
        """Whether the newest reading was another value than the one believed."""
        return self._count > 0

    def feed(self, reading: Value) -> None:
        """Take one reading; the very first is believed at once."""
        if self.value is None or reading == self.value:
            self.force(reading)
            return
        self._count = self._count + 1 if reading == self._candidate else 1
        self._candidate = reading
        if self._count >= self._percepts:
            self.force(reading)

    def force(self, value: Value) -> None:
        """Believe `value` now."""
        self.value, self._candidate, self._count = value, None, 0


class Behaviour(NamedTuple):
    """What is believed of the person: the direct observations O3..O7 of Table 6.2."""

    gesture: int  # HumanActivity.IDLE, GRASP, WARN or OTHER
    detected: bool
    looking_around: bool


def check_activity(activity: Any) -> None:
    """Raise ValueError when the posterior (4,) is not a distribution or the age is no time."""
    posterior = list(activity.posterior)
    if len(posterior) != N_GESTURES:
        raise ValueError(f"posterior has {len(posterior)} entries; it must have {N_GESTURES}")
    for index, value in enumerate(posterior):
        if not math.isfinite(value):
            raise ValueError(f"posterior[{index}] is {value}")
        if value < 0.0:
            raise ValueError(f"posterior[{index}] is {value}; it must not be negative")
    if abs(sum(posterior) - 1.0) > SUM_TOLERANCE:
        raise ValueError(f"posterior sums to {sum(posterior):.6f}")
    if not math.isfinite(activity.evidence_age) or activity.evidence_age < 0.0:
        raise ValueError(f"evidence_age is {activity.evidence_age}")


class Reading(NamedTuple):
    """What a pair of percepts of one moment says, before it is believed."""

    gesture: int  # HumanActivity.IDLE, GRASP, WARN or OTHER
    detected: bool
    looking_around: bool | None  # None: the helmet is out of view


class Recogniser:
    """Hysteresis over gestures, presence and head: percepts in, one Behaviour out.

    behaviour: what is believed now, None before the first percept. settled: whether more of the
    newest reading would change nothing.
    """

    def __init__(self, parameters: ObservationParameters) -> None:
        self._parameters = parameters
        self._gesture: Debounced[int] = Debounced(parameters.action_percepts)
        self._detected: Debounced[bool] = Debounced(parameters.detection_percepts)
        self._looking: Debounced[bool] = Debounced(parameters.head_percepts)
        self.behaviour: Behaviour | None = None
        self.settled = False

    def read(self, activity: HumanActivity, head: HeadState) -> Reading:
        """Return what percepts say. Raises ValueError when the activity is malformed."""
        check_activity(activity)
        looking = bool(head.looking_around) if head.visible else None
        return Reading(self._classify(activity.posterior), bool(activity.detected), looking)

    def take(self, reading: Reading, age: float, hold_warning: bool) -> None:
        """Believe a reading or not yet; `hold_warning` keeps a warning from ending.

        age: of the gesture evidence, s; when it is old it is not used. A helmet out of view says
        nothing about the head.
        """
        if age <= self._parameters.evidence_age_limit:
            self._detected.feed(reading.detected)
            warned = self._gesture.value == HumanActivity.WARN
            if not (hold_warning and warned):
                self._gesture.feed(reading.gesture)
        elif self._gesture.value is None:
            self._gesture.force(HumanActivity.OTHER)
        if reading.looking_around is not None:
            self._looking.feed(reading.looking_around)
        self._conclude()

    def force_warning(self) -> None:
        """Believe that the person warns (the fast road has told so)."""
        self._gesture.force(HumanActivity.WARN)
        self._conclude()

    def _conclude(self) -> None:
        gesture = self._gesture.value
        self.behaviour = None
        if gesture is not None:
            detected, looking = bool(self._detected.value), bool(self._looking.value)
            self.behaviour = Behaviour(gesture, detected, looking)
        self.settled = not (self._gesture.open or self._detected.open or self._looking.open)

    def _classify(self, posterior: Sequence[float]) -> int:
        best = 0
        for gesture in range(1, N_GESTURES):
            if posterior[gesture] > posterior[best]:
                best = gesture
        return best if posterior[best] >= self._parameters.action_threshold else HumanActivity.OTHER
