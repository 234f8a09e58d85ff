# SPDX-License-Identifier: BSD-3-Clause
"""What a frame says of the hand: numbers that mean the same wherever the cell stands.

Positions come in the frame cell at whatever rate the tracker has; features go out every `period`.
"""

from collections import deque
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from fabric_msgs.settings import check_settings, setting
from fabric_perception.gestures.checks import Array
from fabric_perception.gestures.recording import Recording

KINDS = ("relative", "thesis")
AXES = "xyz"
STEP = 0.095  # s
EARLY = 0.01  # s that a frame may come before its time and still count


@dataclass(frozen=True)
class FeatureSettings:
    """Which features, over which times. Raises ValueError naming a bad value.

    kind: "relative" - hand to object and to resting place, velocity, swinging; "thesis" - the
    three scalars of section 6.2.3.3. Places (3,) in the frame cell, m: pick_point of the cube, rest
    of the idle hand, camera.
    """

    kind: str = "relative"
    period: float = setting(0.1, "s", 0.01, 1.0, "from one frame of features to the next")
    slope: float = setting(0.2, "s", 0.02, 1.0, "over which the velocity is fitted")
    swing: float = setting(0.8, "s", 0.1, 5.0, "over which moving to and fro is measured")
    hold: float = setting(0.12, "s", 0.0, 1.0, "for which the last position of a lost hand counts")
    jump: float = setting(5.0, "m/s", 0.5, 50.0, "faster than this is a tracker's error")
    pick_point: tuple[float, float, float] = (0.281, 0.035, 0.1345)
    rest: tuple[float, float, float] = (0.63, 0.235, 0.06)
    camera: tuple[float, float, float] = (0.21, -0.02, 1.08)

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ValueError(f"kind is {self.kind!r}; it must be one of {', '.join(KINDS)}")
        check_settings(self)
        for item in fields(self):
            value = getattr(self, item.name)
            if item.name in ("pick_point", "rest", "camera"):
                if len(value) != 3 or not np.all(np.isfinite(np.asarray(value, dtype=float))):
                    raise ValueError(f"{item.name} is {value}; it must be a place x, y, z in m")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the features in their order."""
        if self.kind == "thesis":
            return ("hand to object", "speed", "hand to camera")
        near = [f"hand minus {place} {axis}" for place in ("object", "rest") for axis in AXES]
        return (*near, *(f"velocity {axis}" for axis in AXES), "swing")


class FeatureExtractor:
    """Positions in, features out; carries the last second of one hand."""

    def __init__(self, settings: FeatureSettings) -> None:
        self._s = settings
        self._places = [np.array(getattr(settings, n)) for n in ("pick_point", "rest", "camera")]
        self._times: deque[float] = deque()
        self._hands: deque[Array] = deque()
        self._due: float | None = None
        self.seen: float | None = None  # s, when the hand was last seen

    def forget_hand(self) -> None:
        """Forget where the hand was; frames go on in step."""
        self._times.clear()
        self._hands.clear()
        self.seen = None

    def reset(self) -> None:
        """Forget everything."""
        self.forget_hand()
        self._due = None

    def step(self, t: float, hand: Any | None, target: Any | None) -> tuple[bool, Array | None]:
        """Take what is seen at time t (s): hand and object of interest (3,) m, None if unseen.

        Returns whether a frame is due now, and its features (D,), None when there is no hand to
        speak of. A position that no hand can have reached is not believed. Time that does not go
        on is refused with ValueError, and so are numbers that are not finite.
        """
        if not np.isfinite(t):
            raise ValueError(f"t is {t} s")
        if self._times and t <= self._times[-1]:
            raise ValueError(f"t is {t} s, not after {self._times[-1]} s")
        point, goal = _place("hand", hand), _place("target", target)
        if point is not None and self._possible(t, point):
            self._times.append(t)
            self._hands.append(point)
            self.seen = t
        self._forget(t)
        if self._due is not None and t < self._due - EARLY:
            return False, None
        on_time = self._due is not None and t < self._due + self._s.period
        self._due = (self._due if on_time and self._due is not None else t) + self._s.period
        return True, self._features(t, goal)

    def _possible(self, t: float, point: Array) -> bool:
        if not self._times or t - self._times[-1] > self._s.hold:
            return True
        way = float(np.linalg.norm(point - self._hands[-1]))
        return way <= self._s.jump * (t - self._times[-1])

    def _forget(self, t: float) -> None:
        oldest = t - max(self._s.swing, self._s.slope) - EARLY
        while self._times and self._times[0] < oldest:
            self._times.popleft()
            self._hands.popleft()

    def _features(self, t: float, target: Array | None) -> Array | None:
        if not self._times or t - self._times[-1] > self._s.hold + EARLY:
            return None
        times, hands = np.array(self._times), np.array(self._hands)
        recent = times >= times[-1] - self._s.slope - EARLY
        place, velocity = _line(times[recent], hands[recent])
        pick_point, rest, camera = self._places
        goal = pick_point if target is None else target
        if self._s.kind == "thesis":
            scalars = (place - goal, velocity, place - camera)
            return np.array([float(np.linalg.norm(vector)) for vector in scalars])
        return np.concatenate([place - goal, place - rest, velocity, [_swing(times, hands)]])


def features_of(recording: Recording, settings: FeatureSettings) -> tuple[Array, Array, Array]:
    """Return times (m,), features (m, D) with rows of NaN where there is no hand, labels (m,)."""
    extractor, rows = FeatureExtractor(settings), []
    lost = np.full(len(settings.names), np.nan)
    seen = np.isfinite(recording.hand[:, 0])
    known = np.isfinite(recording.target[:, 0])
    for i, t in enumerate(recording.t):
        hand = recording.hand[i] if seen[i] else None
        target = recording.target[i] if known[i] else None
        due, frame = extractor.step(float(t), hand, target)
        if due:
            rows.append((t, lost if frame is None else frame, recording.labels[i]))
    return (
        np.array([row[0] for row in rows]),
        np.array([row[1] for row in rows]),
        np.array([row[2] for row in rows]),
    )


def _place(name: str, value: Any | None) -> Array | None:
    if value is None:
        return None
    array = np.asarray(value, dtype=float)
    if array.shape != (3,) or not np.all(np.isfinite(array)):
        raise ValueError(f"{name} is {array.tolist()}; it must be a place x, y, z in m")
    return array


def _line(times: Array, places: Array) -> tuple[Array, Array]:
    """Place (3,) now and velocity (3,) of the straight line fitted to places (n, 3)."""
    middle = times.mean()
    spread = times - middle
    power = float(spread @ spread)
    if power <= 0.0:
        return places[-1], np.zeros(3)
    velocity = spread @ places / power
    return places.mean(axis=0) + velocity * (times[-1] - middle), velocity


def _swing(times: Array, hands: Array) -> float:
    """How much longer the way was than it had to be, as a square root: moving to and fro.

    Measured in steps of STEP or more, so that neither the tracker's noise nor its rate counts.
    """
    steps, last = [0], times[0]
    for i, t in enumerate(times):
        if t >= last + STEP:
            steps.append(i)
            last = t
    places = hands[steps]
    way = np.linalg.norm(np.diff(places, axis=0), axis=1).sum()
    return float(np.sqrt(max(0.0, way - np.linalg.norm(places[-1] - places[0]))))
