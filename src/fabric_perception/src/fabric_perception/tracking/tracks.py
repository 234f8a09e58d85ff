# SPDX-License-Identifier: BSD-3-Clause
"""One cube over time."""

import math

import numpy as np

from fabric_msgs.msg import Cube
from fabric_perception.tracking.carriers import CUP, HAND, Carrier, Signals
from fabric_perception.tracking.kalman import PointFilter
from fabric_perception.tracking.measuring import Detection
from fabric_perception.tracking.parameters import TrackingParameters
from fabric_perception.tracking.workspace import LAYERS, Tray, Workspace

HELD_BY = {HAND: Cube.WHERE_PERSON, CUP: Cube.WHERE_ROBOT}
AT_SENSOR = (-0.6, 1.1)  # edges along the belt, in which a cube stands before the infrared sensor
LEARNING = 0.2  # weight of a new picture in the purity of a colour, and in a place that is known
SWIFT = 0.1  # m/s, of a carried cube whose place is taken from its carrier
BLUR = 0.03  # m, standard deviation of a place taken from a carrier


class CubeTrack:
    """A cube that is followed; frame cell, m, s.

    number: its id, 0 as long as it has none. seen: when it was last measured. carrier: name of
    who holds it. held: name and time of who held it last. container: in which it counts.
    missing: since when its place is seen empty. lying: pictures in a row in which it lay still.
    contacts: when a carrier could last have taken it, by name. at_sensor: whether the infrared
    sensor saw it where it stands. unsensed: pictures in a row in which it no longer does.
    """

    def __init__(
        self, t: float, cube: Detection, workspace: Workspace, parameters: TrackingParameters
    ) -> None:
        self.number = 0
        self.colour = cube.colour
        self.filter = PointFilter(t, cube.position, cube.sigma, parameters.cube_push)
        self.purity = cube.purity
        self.born = self.seen = t
        self.measured = True  # in the present picture
        self.pictures = 1  # in a row
        self.lying = 0
        self.carrier: str | None = None
        self.held: tuple[str, float] | None = None
        self.offset = np.zeros(3)
        self.container: Tray | None = None
        self.missing: float | None = None
        self.contacts: dict[str, float] = {}
        self.at_sensor, self.unsensed = False, 0
        self._last = self.position
        self._workspace, self._parameters = workspace, parameters

    @property
    def position(self) -> np.ndarray:
        """(3,) of its middle."""
        return self.filter.position

    # -- one picture ----------------------------------------------------------------------------

    def predict(self, t: float, carrier: Carrier | None, signals: Signals) -> np.ndarray:
        """Go on to time t; return where it is expected, (3,)."""
        self._last = self.position
        if self.container is not None:
            self.filter.t = t
        elif carrier is not None and carrier.grip is not None:
            self.filter.reset(t, carrier.grip + self.offset, BLUR, carrier.velocity)
        elif self.carrier is not None:
            self.filter.t = t
        else:
            if not self.measured:
                self._let_ride(signals)
            self.filter.predict(t)
        self.measured = False
        return self.position

    def take(self, t: float, cube: Detection, carrier: Carrier | None) -> None:
        """It is seen at time t."""
        if self.carrier is not None:
            cube = cube.near(self.position)
        if self.container is not None:
            place = self.position + LEARNING * (cube.position - self.position)
            self.filter.reset(t, place, cube.sigma, np.zeros(3))
        else:
            self.filter.correct(cube.position, cube.sigma)
        if carrier is not None and carrier.grip is not None:
            self.offset = cube.position - carrier.grip
        self.purity += LEARNING * (cube.purity - self.purity)
        self._count_lying(t, cube.position)
        if self.carrier is not None and cube.sight is not None:
            self.lying = 0  # nobody saw how high it is
        self.seen, self.missing, self.measured = t, None, True
        self.pictures += 1

    def overlook(self) -> None:
        """It is not seen in the present picture."""
        self.pictures = 0
        self.lying = 0

    def attach(self, carrier: Carrier, seen_there: bool) -> None:
        """It is in the hand, or at the cup."""
        self.carrier, self.container, self.missing, self.lying = carrier.name, None, None, 0
        self.offset, self.at_sensor, self.unsensed = np.zeros(3), False, 0
        if carrier.grip is not None:
            if seen_there:
                self.offset = self.position - carrier.grip
            self.filter.reset(self.filter.t, carrier.grip + self.offset, BLUR, carrier.velocity)

    def release(self, t: float) -> None:
        """Nobody holds it any more."""
        if self.carrier is not None:
            self.held = (self.carrier, t)
        self.carrier = None
        self.filter.stop()

    def move_to(self, other: "CubeTrack") -> None:
        """It turned up where `other`, a track without a number, was begun."""
        self.filter, self.seen, self.missing = other.filter, other.seen, None
        self.pictures, self.lying, self.measured = other.pictures, other.lying, other.measured
        self._last = other._last

    def place_in(self, t: float, tray: Tray) -> None:
        """It lies in a container, out of view."""
        place = np.array(tray.floor) + (0.0, 0.0, self._workspace.edge / 2)
        if tray.over(self.position[0], self.position[1]):
            place[:2] = self.position[:2]
        self.filter.reset(t, place, self._workspace.edge, np.zeros(3))

    # -- what it does ---------------------------------------------------------------------------

    @property
    def lifted(self) -> bool:
        """Whether it is above what is under it; in a container cubes lie on cubes."""
        x, y, z = self.position
        layers = 1 if self._workspace.tray_over(x, y) is None else LAYERS
        middle = self._workspace.support(x, y) + (layers - 0.5) * self._workspace.edge
        return bool(z > middle + self._parameters.lift * self._workspace.edge)

    @property
    def rests(self) -> bool:
        """Whether it has been seen lying on the belt or in a container for a few pictures."""
        return self.lying >= self._parameters.rest_pictures

    @property
    def tray(self) -> Tray | None:
        """The container it lies in or is held over."""
        return self._workspace.tray_over(self.position[0], self.position[1])

    def where(self, signals: Signals) -> int | None:
        """Cube.WHERE_*; None where no camera should say: on the table, or lost."""
        if self.carrier is not None:
            return HELD_BY[self.carrier]
        x, y, _ = self.position
        if self.container is not None:
            return Cube.WHERE_CONTAINER
        if self._workspace.over_belt(x, y, self._workspace.edge):
            return Cube.WHERE_PICK_POINT if self._stands_at_sensor(signals) else Cube.WHERE_BELT
        return Cube.WHERE_CONTAINER if self.tray is not None else None

    def confidence(self, t: float) -> float:
        """Probability of the colour at time t; it fades while the cube is out of view."""
        known = 1.0 if self.container is not None else math.exp(-self.age(t) / self._doubt)
        return float(np.clip(1.0 / 3.0 + (self.purity - 1.0 / 3.0) * known, 0.0, 1.0))

    def age(self, t: float) -> float:
        """Time since it was seen, s."""
        return max(0.0, t - self.seen)

    @property
    def _doubt(self) -> float:
        return self._parameters.doubt_time

    def _stands_at_sensor(self, signals: Signals) -> bool:
        along = self._workspace.along(self.position)[0] / self._workspace.edge
        if not AT_SENSOR[0] <= along <= AT_SENSOR[1]:
            return False
        if signals.belt_speed is not None:
            return signals.belt_speed == 0.0
        return float(np.linalg.norm(self.filter.velocity)) < self._parameters.rest_speed / 2

    def _let_ride(self, signals: Signals) -> None:
        """Out of view a cube on the belt goes with the belt, any other stays."""
        x, y, _ = self.position
        along = np.zeros(3)
        if signals.belt_speed is not None and self._workspace.over_belt(x, y):
            yaw = self._workspace.conveyor.yaw
            along = signals.belt_speed * np.array([math.cos(yaw), math.sin(yaw), 0.0])
        elif signals.belt_speed is None and self._workspace.over_belt(x, y):
            return
        self.filter.reset(self.filter.t, self.position, self.filter.spread, along)

    def _count_lying(self, t: float, place: np.ndarray) -> None:
        elapsed = max(t - self.seen, 1e-3)
        slow = np.linalg.norm(place - self._last) <= self._parameters.rest_speed * elapsed + 0.004
        self.lying = self.lying + 1 if slow and not self.lifted else 0
