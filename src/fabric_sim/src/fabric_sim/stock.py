# SPDX-License-Identifier: BSD-3-Clause
"""The cubes of a task: each is in exactly one place, and only the methods here move it."""

import math
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from fabric_msgs.msg import Container, Cube
from fabric_sim.belt import Belt, Changes
from fabric_sim.geometry import CellGeometry, Point, Tray


class Place(Enum):
    """Where a cube can be."""

    FEEDER = "feeder"
    BELT = "belt"
    PERSON = "person"
    ROBOT = "robot"
    CONTAINER = "container"
    FLOOR = "floor"


WHERE = {
    Place.BELT: Cube.WHERE_BELT,
    Place.PERSON: Cube.WHERE_PERSON,
    Place.ROBOT: Cube.WHERE_ROBOT,
    Place.CONTAINER: Cube.WHERE_CONTAINER,
}


@dataclass
class CubeState:
    """A cube: what it is, how it is perceived, where it is."""

    id: int
    colour: int  # Cube.COLOUR_*
    perceived: int
    confidence: float
    place: Place = Place.FEEDER
    container: int | None = None  # id, when in one
    where: int | None = None  # Cube.WHERE_* of the place; None where no camera looks


class Deposit(NamedTuple):
    """A cube came to lie in a container."""

    cube: CubeState
    tray: Tray


class Stock:
    """Belt, hand, suction cup, containers and floor, and the cubes among them."""

    def __init__(self, geometry: CellGeometry, floor_time: float) -> None:
        """floor_time: s until a cube on the floor is put into the belt box: it counts as lost,
        and a task does not wait for it for ever."""
        self._geometry = geometry
        self._floor_time = floor_time
        self.changes = Changes()
        self.belt = Belt(geometry.belt, self.changes)
        self.trays: tuple[Tray, ...] = ()
        self.cubes: dict[int, CubeState] = {}
        self.held_by_person: CubeState | None = None  # in the hand
        self.held_by_robot: CubeState | None = None  # at the suction cup
        self._turn: tuple[int, CubeState | None] = (-1, None)  # valid at this count
        self._floor: list[tuple[float, int]] = []
        self._deposits: list[Deposit] = []

    def load(self, trays: tuple[Tray, ...], cubes: list[CubeState]) -> None:
        """Take everything away and fill the feeder with new cubes."""
        self.trays = trays
        self.cubes = {cube.id: cube for cube in cubes}
        self.changes.count += 1
        self.held_by_person = self.held_by_robot = None
        self._floor = []
        self._deposits = []
        self.belt.load([cube.id for cube in cubes])

    # -- who has what ---------------------------------------------------------------------------

    @property
    def at_pick_point(self) -> CubeState | None:
        """The cube in front of the infrared sensor."""
        cube = self.belt.at_pick_point
        return None if cube is None else self.cubes[cube]

    @property
    def in_play(self) -> CubeState | None:
        """The cube whose turn it is: in a hand, at the pick point, next on the belt or to come."""
        changes = self.changes.count
        if self._turn[0] != changes:
            self._turn = (changes, self._find_in_play())
        return self._turn[1]

    def _find_in_play(self) -> CubeState | None:
        held = self.held_by_person or self.held_by_robot or self.at_pick_point
        if held is not None:
            return held
        coming = [(x, cube) for cube, x in self.belt.carried.items() if x < 0.0]
        if coming:
            return self.cubes[max(coming)[1]]
        following = self.belt.following
        return None if following is None else self.cubes[following]

    def seen(self) -> list[tuple[CubeState, int]]:
        """Every cube in view and where a camera would say it is, Cube.WHERE_*."""
        stands = self.at_pick_point if self.belt.speed == 0.0 else None
        return [
            (cube, Cube.WHERE_PICK_POINT if cube is stands else cube.where)
            for cube in self.cubes.values()
            if cube.where is not None
        ]

    # -- what moves them ------------------------------------------------------------------------

    def run(self, t: float, dt: float) -> None:
        """Run the belt for dt seconds up to time t; tidy the floor."""
        if self.belt.speed != 0.0:
            self._run_belt(dt)
        if self._floor:
            self._tidy(t)

    @property
    def tidy_at(self) -> float:
        """When the next cube is taken off the floor, s; infinite without one."""
        if not self._floor:
            return math.inf
        return min(fell for fell, _ in self._floor) + self._floor_time

    def _run_belt(self, dt: float) -> None:
        for cube in self.belt.step(dt):
            self._deposit(self.cubes[cube], self._belt_box())
        for cube in self.belt.carried:
            self._move(self.cubes[cube], Place.BELT)

    def _tidy(self, t: float) -> None:
        due = [cube for fell, cube in self._floor if t - fell >= self._floor_time]
        self._floor = [(fell, cube) for fell, cube in self._floor if cube not in due]
        for cube in due:
            self._deposit(self.cubes[cube], self._belt_box())

    def person_takes(self) -> bool:
        """The cube at the pick point goes into the person's hand, if there is one and room."""
        return self._take(self.at_pick_point, Place.PERSON)

    def person_places(self, label: str) -> bool:
        """The cube in the hand goes into the person's tray of that label.

        Raises ValueError when the person has no such tray.
        """
        owned = [t for t in self.trays if t.owner == Container.OWNER_PERSON]
        tray = next((t for t in owned if t.label == label), None)
        if tray is None:
            labels = ", ".join(t.label for t in owned)
            raise ValueError(f"the person has no tray {label!r}; there are: {labels}")
        cube = self.held_by_person
        if cube is not None:
            self._deposit(cube, tray)
        return cube is not None

    def person_releases(self, t: float) -> bool:
        """The cube in the hand goes back to the pick point."""
        cube = self.held_by_person
        if cube is not None:
            self._put_on_belt(t, cube, 0.0)
        return cube is not None

    def cup_takes(self, cup: Point, lateral: float, vertical: float) -> bool:
        """A sucking cup at this place (m, cell) takes the cube under it, if one is close enough."""
        below = self._geometry.conveyor.from_cell(cup)
        if abs(below.z - self._geometry.edge) > vertical:
            return False
        for cube, x in self.belt.carried.items():
            if (below.x - x) ** 2 + below.y**2 <= lateral**2:
                return self._take(self.cubes[cube], Place.ROBOT)
        return False

    def cup_drops(self, t: float, cup: Point) -> bool:
        """The cube at the cup falls from this place (m, cell) into what is below."""
        cube = self.held_by_robot
        if cube is None:
            return False
        tray = next((tray for tray in self.trays if tray.holds(cup)), None)
        below = self._geometry.conveyor.from_cell(cup)
        if tray is not None:
            self._deposit(cube, tray)
        elif self._on_belt(below):
            self._put_on_belt(t, cube, below.x)
        else:
            self._to_floor(t, cube)
        return True

    def take_deposits(self) -> list[Deposit]:
        """What came into containers since the last call, in order; each deposit once."""
        if not self._deposits:
            return []
        deposits, self._deposits = self._deposits, []
        return deposits

    def _move(self, cube: CubeState, place: Place) -> None:
        if cube.place is place:
            return
        if cube is self.held_by_person:
            self.held_by_person = None
        elif cube is self.held_by_robot:
            self.held_by_robot = None
        if place is Place.PERSON:
            self.held_by_person = cube
        elif place is Place.ROBOT:
            self.held_by_robot = cube
        cube.place, cube.where = place, WHERE.get(place)
        self.changes.count += 1

    def _take(self, cube: CubeState | None, place: Place) -> bool:
        held = self.held_by_person if place is Place.PERSON else self.held_by_robot
        if cube is None or held is not None:
            return False
        self.belt.take(cube.id)
        self._move(cube, place)
        return True

    def _put_on_belt(self, t: float, cube: CubeState, x: float) -> None:
        if self.belt.put(cube.id, x):
            self._move(cube, Place.BELT)
        else:
            self._to_floor(t, cube)

    def _to_floor(self, t: float, cube: CubeState) -> None:
        self._move(cube, Place.FLOOR)
        self._floor.append((t, cube.id))

    def _deposit(self, cube: CubeState, tray: Tray) -> None:
        self._move(cube, Place.CONTAINER)
        cube.container = tray.id
        self._deposits.append(Deposit(cube, tray))

    def _belt_box(self) -> Tray:
        return next(tray for tray in self.trays if tray.owner == Container.OWNER_BELT)

    def _on_belt(self, below: Point) -> bool:
        shape = self._geometry.belt
        return shape.feeder <= below.x <= shape.end and abs(below.y) <= shape.width / 2
