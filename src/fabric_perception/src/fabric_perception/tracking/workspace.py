# SPDX-License-Identifier: BSD-3-Clause
"""Where belt and containers are, from cell.yaml; metres in frame cell."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fabric_msgs.msg import Container
from fabric_perception.camera import Camera
from fabric_perception.tracking.settings import Settings

OWNERS = {
    "person": Container.OWNER_PERSON,
    "robot": Container.OWNER_ROBOT,
    "belt": Container.OWNER_BELT,
}
LAYERS = 3  # cubes that may lie on one another in a container


class Tray(NamedTuple):
    """A container: middle of its inner floor and its extents along x and y."""

    id: int
    owner: int  # Container.OWNER_*
    label: str
    floor: tuple[float, float, float]
    size: tuple[float, float]

    def over(self, x: float, y: float, margin: float = 0.0) -> bool:
        """Whether a place lies over the container, or at most `margin` beside it."""
        within_x = abs(x - self.floor[0]) <= self.size[0] / 2 + margin
        return within_x and abs(y - self.floor[1]) <= self.size[1] / 2 + margin


class Frame(NamedTuple):
    """A frame fixed in the cell, turned by yaw (rad) about z."""

    x: float
    y: float
    z: float
    yaw: float

    def to_cell(self, point: np.ndarray) -> np.ndarray:
        """Points (..., 3) of this frame in the cell."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        x, y, z = np.moveaxis(np.asarray(point, dtype=float), -1, 0)
        return np.stack([self.x + c * x - s * y, self.y + s * x + c * y, self.z + z], axis=-1)

    def from_cell(self, point: np.ndarray) -> np.ndarray:
        """Points (..., 3) of the cell in this frame."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        dx, dy = point[..., 0] - self.x, point[..., 1] - self.y
        return np.stack([c * dx + s * dy, c * dy - s * dx, point[..., 2] - self.z], axis=-1)


@dataclass(frozen=True)
class Workspace:
    """The belt along x of the frame conveyor, whose origin is the pick point, and containers."""

    edge: float  # of a cube
    conveyor: Frame
    arm: Frame
    feeder: float  # along the belt, as `end`
    end: float
    width: float
    scenarios: dict[str, tuple[Tray, ...]]
    scenario: str

    @classmethod
    def load(cls, path: str | Path, scenario: str = "") -> "Workspace":
        """Read cell.yaml, for a scenario or the first. Raises SettingsError naming file, entry and
        value."""
        file = Settings.read(path)
        frames, belt, scenarios = (file.branch(n) for n in ("frames", "belt", "scenarios"))
        scenario = scenario or scenarios.names()[0]
        scenarios.branch(scenario)
        return cls(
            file.branch("cube").number("edge", 0.005, 0.2),
            _frame(frames.branch("conveyor")),
            _frame(frames.branch("arm_base_link")),
            belt.number("feeder"),
            belt.number("end"),
            belt.number("width", 0.01),
            {name: _trays(scenarios.branch(name)) for name in scenarios.names()},
            scenario,
        )

    @property
    def trays(self) -> tuple[Tray, ...]:
        """The containers of the present scenario."""
        return self.scenarios[self.scenario]

    def along(self, point: Sequence[float] | np.ndarray) -> tuple[float, float]:
        """How far along and across the belt a point x, y of the cell is, m."""
        c, s = math.cos(self.conveyor.yaw), math.sin(self.conveyor.yaw)
        dx, dy = float(point[0]) - self.conveyor.x, float(point[1]) - self.conveyor.y
        return c * dx + s * dy, c * dy - s * dx

    def over_belt(self, x: float, y: float, margin: float = 0.0) -> bool:
        """Whether a place lies over the belt, or at most `margin` beside it."""
        along, across = self.along((x, y))
        within = self.feeder - self.edge - margin <= along <= self.end + self.edge / 2 + margin
        return within and abs(across) <= self.width / 2 + margin

    def tray_over(self, x: float, y: float, margin: float = 0.0) -> Tray | None:
        """The container under a place, if there is one."""
        return next((tray for tray in self.trays if tray.over(x, y, margin)), None)

    def support(self, x: float, y: float) -> float:
        """Height of what is under a place: belt, floor of a container, or table."""
        if self.over_belt(x, y):
            return self.conveyor.z
        tray = self.tray_over(x, y)
        return 0.0 if tray is None else tray.floor[2]

    def surfaces(self) -> list[tuple[float, np.ndarray]]:
        """Height and corners (4, 2) in the cell of the belt and of each container's floor."""
        along = (self.feeder - self.edge, self.end + self.edge / 2)
        across = self.width / 2
        belt = np.array(
            [[x, y, 0.0] for x, y in zip((*along, *along[::-1]), _ring(across), strict=True)]
        )
        found = [(self.conveyor.z, self.conveyor.to_cell(belt)[:, :2])]
        for tray in self.trays:
            half = np.array(tray.size) / 2
            corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * half + tray.floor[:2]
            found.append((tray.floor[2], corners))
        return found


def _ring(across: float) -> tuple[float, ...]:
    return -across, -across, across, across


def ground_under(
    workspace: Workspace, origin: np.ndarray, ray: np.ndarray, above: float
) -> np.ndarray:
    """Return the point (3,) at which a ray from `origin` is `above` m over what it meets first."""
    best = _meet(ray[None], origin, above)[0]
    for height, corners in workspace.surfaces():
        depth = _meet(ray[None], origin, height + above)
        if depth[0] < best and _inside(corners, (origin + ray * depth)[None, :2])[0]:
            best = depth[0]
    return origin + ray * best


def flat_depth(workspace: Workspace, camera: Camera, above: float) -> np.ndarray:
    """Return (H, W) float32: depth in m at which a pixel's ray is `above` m over what it meets.

    Deeper pixels show the empty belt, table or container, whatever their colour. A ray that meets
    nothing gets infinity.
    """
    v, u = np.mgrid[0 : camera.height, 0 : camera.width]
    rays = camera.rays(np.column_stack([u.ravel(), v.ravel()])) @ camera.pose_in_cell[:3, :3].T
    origin = camera.position
    nearest = _meet(rays, origin, above)
    for height, corners in workspace.surfaces():
        depth = _meet(rays, origin, height + above)
        inside = _inside(corners, origin[:2] + rays[:, :2] * depth[:, None])
        nearest = np.where(inside, np.minimum(nearest, depth), nearest)
    return nearest.reshape(camera.height, camera.width).astype(np.float32)


def _meet(rays: np.ndarray, origin: np.ndarray, height: float) -> np.ndarray:
    """Depth (N,) where rays with z = 1 in the optical frame meet a height; infinity for none."""
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = (height - origin[2]) / rays[:, 2]
    return np.where(depth > 0.0, depth, np.inf)


def _inside(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Whether points (N, 2) lie in a convex ring of corners (4, 2)."""
    sides = np.roll(corners, -1, axis=0) - corners
    with np.errstate(invalid="ignore"):
        turns = [
            side[0] * (points[:, 1] - corner[1]) - side[1] * (points[:, 0] - corner[0])
            for corner, side in zip(corners, sides, strict=True)
        ]
        return (np.array(turns) >= 0.0).all(axis=0)


def _frame(entries: Settings) -> Frame:
    return Frame(*(entries.number(name) for name in Frame._fields))


def _trays(entries: Settings) -> tuple[Tray, ...]:
    return tuple(_tray(item) for item in entries.branches("containers"))


def _tray(entries: Settings) -> Tray:
    size = entries.numbers("size", 2, 0.0)
    floor = (entries.number("x"), entries.number("y"), entries.number("z"))
    owner = OWNERS[entries.word("owner", list(OWNERS))]
    label = entries.word("label")
    return Tray(int(entries.number("id", 1)), owner, label, floor, (size[0], size[1]))
