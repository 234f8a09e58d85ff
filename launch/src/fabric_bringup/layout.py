# SPDX-License-Identifier: BSD-3-Clause
"""Where the things that are drawn stand, read from cell.yaml; metres and radians, frame `world`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from fabric_bringup.draw import Vector


@dataclass(frozen=True)
class Tray:
    """A container: the middle of its floor and its extents along x and y."""

    id: int
    owner: str
    label: str
    floor: Vector
    size: tuple[float, float]


@dataclass(frozen=True)
class Layout:
    """What the markers need of the cell; x points from the arm to the person."""

    arm: Vector
    pick: Vector
    belt_yaw: float
    belt_from: float
    belt_to: float
    belt_width: float
    person: Vector
    person_yaw: float
    joints: dict[str, Vector]  # of the person, in the frame person
    edge: float
    table: tuple[float, float, float, float]  # x, y of the middle, extents along x and y
    trays: dict[str, tuple[Tray, ...]]

    def of_person(self, joint: str | Vector) -> Vector:
        """A joint, or a point of the frame person, in the world."""
        x, y, z = self.joints[joint] if isinstance(joint, str) else joint
        return moved(self.person, self.person_yaw, (x, y, z))

    def on_belt(self, along: float, across: float = 0.0, up: float = 0.0) -> Vector:
        """A point of the frame conveyor in the world: `along` the belt, 0 at the pick point."""
        return moved(self.pick, self.belt_yaw, (along, across, up))


def moved(origin: Vector, yaw: float, point: Vector) -> Vector:
    """A point of a frame at `origin`, turned by `yaw`, in the frame around it."""
    c, s = math.cos(yaw), math.sin(yaw)
    return (
        origin[0] + c * point[0] - s * point[1],
        origin[1] + s * point[0] + c * point[1],
        origin[2] + point[2],
    )


def from_cell(cell: dict[str, Any]) -> Layout:
    """The layout in the content of cell.yaml; KeyError names what is missing."""
    frames, belt = cell["frames"], cell["belt"]
    joints = {name: _vector(entry) for name, entry in cell["person"].items()}
    return Layout(
        arm=_vector(frames["arm_base_link"]),
        pick=_vector(frames["conveyor"]),
        belt_yaw=frames["conveyor"]["yaw"],
        belt_from=belt["feeder"],
        belt_to=belt["end"],
        belt_width=belt["width"],
        person=_vector(frames["person"]),
        person_yaw=frames["person"]["yaw"],
        joints=joints,
        edge=cell["cube"]["edge"],
        table=(cell["table"]["x"], cell["table"]["y"], *cell["table"]["size"][:2]),
        trays={
            name: tuple(_tray(entry) for entry in scenario["containers"])
            for name, scenario in cell["scenarios"].items()
        },
    )


def load(path: str | Path) -> Layout:
    """The layout of a cell.yaml."""
    return from_cell(yaml.safe_load(Path(path).read_text()))


def _vector(entry: dict[str, float]) -> Vector:
    return (entry["x"], entry["y"], entry["z"])


def _tray(entry: dict[str, Any]) -> Tray:
    width, depth = entry["size"]
    return Tray(entry["id"], entry["owner"], entry["label"], _vector(entry), (width, depth))
