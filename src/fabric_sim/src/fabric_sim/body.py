# SPDX-License-Identifier: BSD-3-Clause
"""Where the simulated person's head and hand are: for the eye, no decision rests on it."""

from fabric_msgs.msg import HumanActivity
from fabric_sim.geometry import CellGeometry, Point, Tray
from fabric_sim.sensing import Behaviour

HAND_SPEED = 0.60  # m/s
WALK_SPEED = 1.20  # m/s
TURN = 1.1  # rad, of the head when looking around


class BodyMotion:
    """Head and working hand, moved evenly towards where the behaviour wants them."""

    def __init__(self, geometry: CellGeometry) -> None:
        self._geometry = geometry
        self._body = geometry.body
        self._offset = Point(0.0, 0.0, 0.0)
        self._hand = self._body.rest
        self._tray: Tray | None = None
        self.turned = 0.0

    def reset(self) -> None:
        """Back to the place of work."""
        self._offset, self._hand, self.turned = Point(0.0, 0.0, 0.0), self._body.rest, 0.0

    @property
    def base(self) -> Point:
        """Under the person's chest, m in the cell."""
        return self._geometry.person.to_cell(self._offset)

    @property
    def head(self) -> Point:
        """Middle of the head, m in the cell."""
        return self._geometry.person.to_cell(_plus(self._offset, self._body.head))

    @property
    def hand(self) -> Point:
        """The working hand, m in the cell."""
        return self._geometry.person.to_cell(_plus(self._offset, self._hand))

    def step(self, dt: float, behaviour: Behaviour, walking: bool, tray: Tray | None) -> None:
        """Move for dt seconds; `tray` is where a cube in the hand goes, None with empty hands."""
        away = walking or not behaviour.present
        target = self._body.away if away else Point(0.0, 0.0, 0.0)
        self._offset = _approach(self._offset, target, WALK_SPEED * dt)
        self._hand = _approach(self._hand, self._aim(behaviour, tray), HAND_SPEED * dt)
        self.turned = TURN if behaviour.looking_around else 0.0

    def _aim(self, behaviour: Behaviour, tray: Tray | None) -> Point:
        if behaviour.activity == HumanActivity.WARN:
            return self._body.stop
        if behaviour.activity != HumanActivity.GRASP:
            return self._body.rest
        if tray is not None:
            goal = _plus(tray.floor, Point(0.0, 0.0, 3 * self._geometry.edge))
        else:
            goal = self._geometry.conveyor.to_cell(Point(0.0, 0.0, 1.5 * self._geometry.edge))
        return self._geometry.person.from_cell(goal)


def _plus(a: Point, b: Point) -> Point:
    return Point(*(p + q for p, q in zip(a, b, strict=True)))


def _approach(at: Point, target: Point, step: float) -> Point:
    way = sum((b - a) ** 2 for a, b in zip(at, target, strict=True)) ** 0.5
    return target if way <= step else at.towards(target, step / way)
