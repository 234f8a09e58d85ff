# SPDX-License-Identifier: BSD-3-Clause
"""What the person's hand does, from the tracker's hand and cubes: a posterior for every frame."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from fabric_msgs.msg import Cube
from fabric_msgs.settings import check_settings, setting
from fabric_perception.gestures.checks import Array
from fabric_perception.gestures.features import FeatureExtractor
from fabric_perception.gestures.model_file import TrainedGestures
from fabric_perception.gestures.recording import LABELS
from fabric_perception.gestures.scoring import StreamingScore
from fabric_perception.gestures.warning_road import WarningRoad

NOTHING_KNOWN = np.full(len(LABELS), 1.0 / len(LABELS))
NEW_TIME = 2.0  # s; time that jumps back further begins anew, as when a bag is played again


@dataclass(frozen=True)
class RecogniserParameters:
    """How posteriors become percepts. Raises ValueError naming a bad value."""

    warning_threshold: float = setting(
        0.9, "1", 0.01, 0.999, "posterior of a warning at which the fast road tells of it"
    )
    warning_rearm: float = setting(
        0.5, "1", 0.01, 0.999, "the next warning is told only after it has fallen below this"
    )
    warning_weight: float = setting(
        0.15, "1", 1e-3, 1.0, "exponent of a frame's likelihood on the fast road"
    )
    warning_look_back: float = setting(
        0.2, "s", 0.0, 2.0, "look_back of the fast road: how much is seen of it beforehand"
    )
    look_back: float = setting(
        0.4, "s", 0.0, 2.0, "how long ago the moment is of which the posterior speaks"
    )
    lost_after: float = setting(
        1.0, "s", 0.1, 10.0, "without a hand until the person counts as gone and is forgotten"
    )
    cubes_age_limit: float = setting(
        1.0, "s", 0.1, 10.0, "cubes seen longer ago than this are not used"
    )
    silence: float = setting(
        0.5, "s", 0.1, 10.0, "without a message of the tracker until that itself is told"
    )

    def __post_init__(self) -> None:
        check_settings(self)
        if self.warning_rearm > self.warning_threshold:
            raise ValueError(
                f"warning_rearm is {self.warning_rearm}; it must not exceed warning_threshold"
            )

    def lags(self, period: float) -> tuple[int, int]:
        """look_back and warning_look_back in frames that are `period` s apart."""
        return round(self.look_back / period), round(self.warning_look_back / period)


class GesturePercept(NamedTuple):
    """What is recognised at one moment, in the fields of HumanActivity."""

    t: float  # s, of the image
    posterior: Array  # (4,) look_back before t, in the order of HumanActivity's constants, sum 1
    detected: bool
    evidence_age: float  # s since the hand was last seen
    warning: bool  # a warning begins: the fast road tells of it


class GestureRecogniser:
    """Frames of one person in, percepts out. Has no clock: time is data."""

    def __init__(self, trained: TrainedGestures, parameters: RecogniserParameters) -> None:
        """Raises ValueError when the model's classes are not those of HumanActivity."""
        if trained.model.labels != LABELS:
            raise ValueError(
                f"the model knows {', '.join(trained.model.labels)}; {', '.join(LABELS)} are needed"
            )
        self._parameters = parameters
        self._features = FeatureExtractor(trained.features)
        self._pick_point = np.array(trained.features.pick_point)
        lag, warning_lag = parameters.lags(trained.features.period)
        self._score = StreamingScore(trained.model, trained.score, lag=lag)
        self._road = WarningRoad(
            StreamingScore(trained.model, trained.score, parameters.warning_weight, warning_lag),
            parameters.warning_threshold,
            parameters.warning_rearm,
        )
        self.reset()

    def reset(self) -> None:
        """Forget person and cubes."""
        self._newest = self._seen = -math.inf
        self._target: Array | None = None
        self._target_seen = -math.inf
        self._features.reset()
        self._forget_hand()

    def on_cubes(self, t: float, cubes: Iterable[Any]) -> None:
        """Take the cubes seen at time t (s), fields as in fabric_msgs/Cube, positions in cell, m.

        Raises ValueError for a position that is not finite; then the cubes before stay.
        """
        self._target = object_of_interest(cubes, self._pick_point)
        self._target_seen = t

    def on_hand(self, t: float, hand: Any | None) -> GesturePercept | None:
        """Take the hand (3,) m in cell seen in the image of time t (s), None when there is none.

        Returns a percept when one is due. Raises ValueError when numbers are not finite or time
        does not go on; then nothing changes. Time that jumps far back begins anew.
        """
        if not math.isfinite(t):
            raise ValueError(f"t is {t} s")
        if self._newest - t > NEW_TIME:
            self.reset()
        if t <= self._newest:
            raise ValueError(f"t is {t} s, not after {self._newest} s")
        fresh = abs(t - self._target_seen) <= self._parameters.cubes_age_limit
        due, frame = self._features.step(t, hand, self._target if fresh else None)
        self._newest = t
        if self._features.seen is not None:
            self._seen = self._features.seen
        return self._percept(t, frame) if due else None

    def on_silence(self, t: float) -> GesturePercept | None:
        """Say at time t (s) that the tracker says nothing: what was recognised is getting old.

        None while it has been heard from lately, or never.
        """
        quiet = t - self._newest
        if not self._parameters.silence <= quiet < math.inf:
            return None
        known = self._features.seen is not None
        posterior = self._score.posterior if known else NOTHING_KNOWN
        return GesturePercept(t, posterior, known, t - self._seen, False)

    def _percept(self, t: float, frame: Array | None) -> GesturePercept:
        age = t - self._seen
        if age > self._parameters.lost_after:
            self._forget_hand()
            return GesturePercept(t, NOTHING_KNOWN, False, age, False)
        return GesturePercept(t, self._score.step(frame), True, age, self._road.step(frame))

    def _forget_hand(self) -> None:
        self._features.forget_hand()
        self._score.reset()
        self._road.reset()


def object_of_interest(cubes: Iterable[Any], pick_point: Array) -> Array | None:
    """Return the place (3,) m of the cube in the person's hand, else of the one on the belt that is
    nearest to the pick point; None without one. Raises ValueError naming a bad cube."""
    places: dict[bool, list[Array]] = {True: [], False: []}
    for cube in cubes:
        if cube.where in (Cube.WHERE_PERSON, Cube.WHERE_PICK_POINT, Cube.WHERE_BELT):
            at = cube.pose.position
            place = np.array([at.x, at.y, at.z], dtype=float)
            if not np.all(np.isfinite(place)):
                raise ValueError(f"cube {cube.id} is at {place.tolist()}")
            places[cube.where == Cube.WHERE_PERSON].append(place)
    near = places[True] or places[False]
    return min(near, key=lambda place: float(np.linalg.norm(place - pick_point)), default=None)
