# SPDX-License-Identifier: BSD-3-Clause
"""What the person does, believed only after percepts in a row agree."""

import math
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

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


@dataclass(frozen=True)
class Behaviour:
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


class Recogniser:
    """Hysteresis over gestures, presence and head: percepts in, one Behaviour out."""

    def __init__(self, parameters: ObservationParameters) -> None:
        self._parameters = parameters
        self._gesture: Debounced[int] = Debounced(parameters.action_percepts)
        self._detected: Debounced[bool] = Debounced(parameters.detection_percepts)
        self._looking: Debounced[bool] = Debounced(parameters.head_percepts)

    @property
    def behaviour(self) -> Behaviour | None:
        """What is believed now, None before the first percept."""
        if self._gesture.value is None:
            return None
        return Behaviour(self._gesture.value, bool(self._detected.value), bool(self._looking.value))

    def feed(self, activity: HumanActivity, head: HeadState, hold_warning: bool) -> None:
        """Take a pair of percepts of one moment; `hold_warning` keeps a warning from ending.

        Old gesture evidence is not used, and a helmet out of view says nothing about the head.
        Raises ValueError when the activity is malformed.
        """
        check_activity(activity)
        if activity.evidence_age <= self._parameters.evidence_age_limit:
            self._detected.feed(bool(activity.detected))
            warned = self._gesture.value == HumanActivity.WARN
            if not (hold_warning and warned):
                self._gesture.feed(self._classify(activity.posterior))
        elif self._gesture.value is None:
            self._gesture.force(HumanActivity.OTHER)
        if head.visible:
            self._looking.feed(bool(head.looking_around))

    def force_warning(self) -> None:
        """Believe that the person warns (the fast road has told so)."""
        self._gesture.force(HumanActivity.WARN)

    def _classify(self, posterior: tuple[float, ...]) -> int:
        best = max(range(N_GESTURES), key=lambda gesture: posterior[gesture])
        return best if posterior[best] >= self._parameters.action_threshold else HumanActivity.OTHER
