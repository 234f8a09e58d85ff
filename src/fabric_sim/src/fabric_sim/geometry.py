# SPDX-License-Identifier: BSD-3-Clause
"""Where things are in the cell. Metres and radians; one file feeds simulation, markers and rviz."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from fabric_msgs.msg import Container
from fabric_sim.entries import ConfigError, Entries

OWNERS = {
    "person": Container.OWNER_PERSON,
    "robot": Container.OWNER_ROBOT,
    "belt": Container.OWNER_BELT,
}


class Point(NamedTuple):
    """A point, m."""

    x: float
    y: float
    z: float

    def towards(self, other: "Point", fraction: float) -> "Point":
        """The point at this fraction, 0 to 1, of the way to the other."""
        return Point(*(a + fraction * (b - a) for a, b in zip(self, other, strict=True)))


class Frame(NamedTuple):
    """A frame fixed in the cell: origin in m, yaw about z in rad."""

    x: float
    y: float
    z: float
    yaw: float

    def to_cell(self, point: Point) -> Point:
        """The same point in the frame cell."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return Point(
            self.x + c * point.x - s * point.y, self.y + s * point.x + c * point.y, self.z + point.z
        )

    def from_cell(self, point: Point) -> Point:
        """The same point in this frame."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        dx, dy = point.x - self.x, point.y - self.y
        return Point(c * dx + s * dy, -s * dx + c * dy, point.z - self.z)


class BeltShape(NamedTuple):
    """The belt along x of the frame conveyor, whose origin is the pick point; m."""

    feeder: float
    end: float
    width: float
    spacing: float
    gap: float
    edge: float  # of a cube


class Tray(NamedTuple):
    """A container: middle of its floor in the cell, sizes along x and y; m."""

    id: int
    owner: int  # Container.OWNER_*
    label: str
    floor: Point
    size: tuple[float, float]

    def holds(self, point: Point) -> bool:
        """True when the point is above or in the container."""
        dx, dy = abs(point.x - self.floor.x), abs(point.y - self.floor.y)
        return dx <= self.size[0] / 2 and dy <= self.size[1] / 2

    def slot(self, index: int, edge: float) -> Point:
        """Middle of the index-th cube (from 0), rows of cubes in layers; m in the cell."""
        pitch = edge * 1.15
        columns = max(1, int(self.size[0] / pitch))
        rows = max(1, int(self.size[1] / pitch))
        layer, place = divmod(index, columns * rows)
        row, column = divmod(place, columns)
        return Point(
            self.floor.x + (column - (columns - 1) / 2) * pitch,
            self.floor.y + (row - (rows - 1) / 2) * pitch,
            self.floor.z + edge * (layer + 0.5),
        )


class Body(NamedTuple):
    """The person's joints in the frame person; m."""

    head: Point
    shoulder: Point
    rest: Point
    stop: Point
    away: Point


class Table(NamedTuple):
    """The table's top face: middle in the cell, extents; m."""

    x: float
    y: float
    size: tuple[float, ...]


@dataclass(frozen=True)
class CellGeometry:
    """Everything of cell.yaml."""

    arm: Frame
    conveyor: Frame
    person: Frame
    table: Table
    edge: float  # of a cube
    belt: BeltShape
    body: Body
    scenarios: dict[str, tuple[Tray, ...]]

    def trays(self, scenario: str) -> tuple[Tray, ...]:
        """Containers of a scenario. Raises ValueError naming the allowed ones."""
        if scenario not in self.scenarios:
            allowed = ", ".join(self.scenarios)
            raise ValueError(f"scenario is {scenario!r}; allowed: {allowed}")
        return self.scenarios[scenario]


def load_geometry(path: str | Path) -> CellGeometry:
    """Read cell.yaml. Raises ConfigError naming the file, the entry and its value."""
    entries = Entries.read(path)
    frames = entries.branch("frames")
    edge = entries.branch("cube").positive("edge")
    scenarios = entries.branch("scenarios")
    return CellGeometry(
        arm=_frame(frames.branch("arm_base_link")),
        conveyor=_frame(frames.branch("conveyor")),
        person=_frame(frames.branch("person")),
        table=_table(entries.branch("table")),
        edge=edge,
        belt=_belt(entries.branch("belt"), edge),
        body=_body(entries.branch("person")),
        scenarios={name: _trays(scenarios.branch(name)) for name in scenarios.names()},
    )


def _frame(entries: Entries) -> Frame:
    return Frame(*(entries.number(key) for key in Frame._fields))


def _point(entries: Entries) -> Point:
    return Point(*(entries.number(key) for key in Point._fields))


def _table(entries: Entries) -> Table:
    return Table(entries.number("x"), entries.number("y"), entries.numbers("size", 3, 0.0))


def _body(entries: Entries) -> Body:
    return Body(*(_point(entries.branch(key)) for key in Body._fields))


def _belt(entries: Entries, edge: float) -> BeltShape:
    shape = BeltShape(
        entries.number("feeder"),
        entries.positive("end"),
        entries.positive("width"),
        entries.positive("spacing"),
        entries.number("gap", 0.0),
        edge,
    )
    if shape.feeder >= 0.0:
        raise entries.error("feeder", "a negative number: before the pick point")
    if shape.spacing <= shape.end:
        raise entries.error("spacing", "more than belt.end: one cube falls before the next arrives")
    return shape


def _trays(entries: Entries) -> tuple[Tray, ...]:
    trays = tuple(_tray(item) for item in entries.branches("containers"))
    if len({tray.id for tray in trays}) != len(trays):
        raise entries.error("containers", "ids that differ")
    if sum(tray.owner == Container.OWNER_BELT for tray in trays) != 1:
        raise entries.error("containers", "exactly one box of the belt")
    return trays


def _tray(entries: Entries) -> Tray:
    size = entries.numbers("size", 2, 0.0)
    return Tray(
        entries.whole("id", 1),
        OWNERS[entries.word("owner", list(OWNERS))],
        entries.word("label"),
        _point(entries),
        (size[0], size[1]),
    )


__all__ = [
    "BeltShape",
    "Body",
    "CellGeometry",
    "ConfigError",
    "Frame",
    "Point",
    "Table",
    "Tray",
    "load_geometry",
]
