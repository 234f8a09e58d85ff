# SPDX-License-Identifier: BSD-3-Clause
"""Who can carry a cube - the person's hand, the robot's cup - and where they have been."""

from collections import deque
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from fabric_msgs.msg import Container
from fabric_perception.tracking.hand import HandTrack
from fabric_perception.tracking.parameters import TrackingParameters

HAND, CUP = "hand", "cup"
OWNER_OF = {HAND: Container.OWNER_PERSON, CUP: Container.OWNER_ROBOT}
UNDER_HAND = np.array([0.0, 0.0, -0.025])  # m; where a hidden cube is supposed to be
NO_SLACK: Mapping[str, float] = {}
FALL = (-0.05, 0.30)  # m, that a cube may lie below the way


class Signals(NamedTuple):
    """What other devices say at the time of a picture; None where nobody says it.

    cup: (3,) m in cell, the end of the suction cup. belt_speed: m/s. at_pick_point: infrared.
    """

    cup: np.ndarray | None = None
    belt_speed: float | None = None
    at_pick_point: bool | None = None


class Carrier:
    """The hand or the cup. grip: (3,) m where it holds a cube's middle; None while not in view."""

    def __init__(self, name: str, reach: float, memory: float) -> None:
        self.name, self.reach, self._memory = name, reach, memory
        self.grip: np.ndarray | None = None
        self.velocity = np.zeros(3)
        self._way: deque[tuple[float, np.ndarray]] = deque()

    def move(self, t: float, grip: np.ndarray | None, velocity: np.ndarray | None = None) -> None:
        """It is at `grip` at time t (s), with `velocity` (3,) m/s if known."""
        if velocity is not None:
            self.velocity = velocity
        elif grip is not None and self._way:
            before, place = self._way[-1]
            self.velocity = (grip - place) / max(t - before, 1e-3)
        self.grip = grip
        if grip is not None:
            self._way.append((t, grip))
        while self._way and t - self._way[0][0] > self._memory:
            self._way.popleft()

    def distance(self, place: np.ndarray) -> float:
        """From where it holds to a place (3,), m; infinite while it is not in view."""
        return float("inf") if self.grip is None else float(np.linalg.norm(place - self.grip))

    def reaches(self, place: np.ndarray, slack: float = 0.0) -> bool:
        """Whether it can hold a cube at a place (3,)."""
        return self.distance(place) <= self.reach + slack

    def way_above(self, place: np.ndarray) -> float:
        """How far beside its way of late a place (3,) lies, if below it; else infinite. m."""
        if not self._way:
            return float("inf")
        way = np.array([point for _, point in self._way]) - place
        beside = np.hypot(way[:, 0], way[:, 1])
        beside[(way[:, 2] < FALL[0]) | (way[:, 2] > FALL[1])] = np.inf
        return float(beside.min())


class Carriers:
    """Both of them."""

    def __init__(self, edge: float, parameters: TrackingParameters) -> None:
        """edge: of a cube, m."""
        self._edge = edge
        self.hand = Carrier(HAND, parameters.hand_reach, parameters.trail)
        self.cup = Carrier(CUP, parameters.cup_reach, parameters.trail)
        self.all = {HAND: self.hand, CUP: self.cup}

    def move(self, t: float, hand: HandTrack | None, signals: Signals) -> None:
        """Take where they are at time t (s)."""
        if hand is not None and hand.visible:
            self.hand.move(t, hand.position + UNDER_HAND, hand.velocity)
        else:
            self.hand.move(t, None)
        down = np.array([0.0, 0.0, -self._edge / 2])
        self.cup.move(t, None if signals.cup is None else signals.cup + down)

    def nearest(self, place: np.ndarray, slack: Mapping[str, float] = NO_SLACK) -> Carrier | None:
        """The one that can hold a cube at a place (3,); the closer by its own measure.

        slack: m more that each may be away, by name.
        """
        able = [c for c in self.all.values() if c.reaches(place, slack.get(c.name, 0.0))]
        return min(able, key=lambda c: c.distance(place) / c.reach, default=None)
