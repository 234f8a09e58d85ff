# SPDX-License-Identifier: BSD-3-Clause
"""Goals are checked before anything moves: finite, speed, boxes, reach, joint limits."""

import math
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from fabric_dobot_driver.kinematics import Joints, Links, ToolPose, inverse


class Fault(Enum):
    """Why a goal is refused."""

    INVALID = "invalid"  # not a number, or a rule of the cell is violated
    UNREACHABLE = "unreachable"  # the arm cannot get there


class Refusal(NamedTuple):
    """A refused goal: the kind of fault, and a sentence for people."""

    fault: Fault
    reason: str


class Goal(NamedTuple):
    """A pose in arm_base_link, the tool's speed in m/s and the time to stand there in s."""

    pose: ToolPose
    speed: float
    settle: float = 0.0


class Span(NamedTuple):
    """A closed interval."""

    low: float
    high: float

    def holds(self, value: float) -> bool:
        """True when the value lies inside, rounding errors forgiven."""
        return self.low - 1e-9 <= value <= self.high + 1e-9


class Box(NamedTuple):
    """An axis-parallel box in arm_base_link, m."""

    name: str
    low: tuple[float, float, float]
    high: tuple[float, float, float]

    def holds(self, x: float, y: float, z: float) -> bool:
        """True when the point lies strictly inside."""
        point = (x, y, z)
        return all(a < p < b for a, p, b in zip(self.low, point, self.high, strict=True))


@dataclass(frozen=True)
class Limits:
    """What the arm can do (links, joints in rad, elbow in rad) and what the cell allows."""

    links: Links
    joints: tuple[Span, Span, Span, Span]
    elbow: Span
    speed: Span
    settle: Span
    allowed: Box
    forbidden: tuple[Box, ...]


def check_goal(goal: Goal, limits: Limits) -> Refusal | None:
    """None when the arm may go there, otherwise why not."""
    return (
        _check_numbers(goal)
        or _check_rules(goal, limits)
        or _check_boxes(goal.pose, limits)
        or check_reach(goal.pose, limits)
    )


def check_path(
    start: ToolPose, end: ToolPose, limits: Limits, step: float = 0.005
) -> Refusal | None:
    """None when the tool can follow the straight line (checked every `step` metres)."""
    length = math.dist(start[:3], end[:3])
    pieces = max(1, math.ceil(length / step))
    for i in range(1, pieces + 1):
        pose = between(start, end, i / pieces)
        refusal = check_reach(pose, limits)
        if refusal is not None:
            return Refusal(refusal.fault, f"the straight line is blocked: {refusal.reason}")
    return None


def between(start: ToolPose, end: ToolPose, fraction: float) -> ToolPose:
    """The pose at this fraction, 0 to 1, of the straight line."""
    return ToolPose(*(a + fraction * (b - a) for a, b in zip(start, end, strict=True)))


def check_reach(pose: ToolPose, limits: Limits) -> Refusal | None:
    """None when inverse kinematics has a solution within the joint limits."""
    joints = inverse(pose, limits.links)
    where = f"({pose.x:.3f}, {pose.y:.3f}, {pose.z:.3f}) m"
    if joints is None:
        return Refusal(Fault.UNREACHABLE, f"{where} is out of the arm's reach")
    name = exceeded_joint(joints, limits)
    if name is not None:
        return Refusal(Fault.UNREACHABLE, f"{where} needs {name}")
    return None


def exceeded_joint(joints: Joints, limits: Limits) -> str | None:
    """The first joint beyond its limits, in words with degrees, or None."""
    rows = list(zip(Joints._fields, joints, limits.joints, strict=True))
    rows.append(("elbow", math.pi / 2 + joints.j2 - joints.j3, limits.elbow))
    for name, angle, span in rows:
        if not span.holds(angle):
            low, high = math.degrees(span.low), math.degrees(span.high)
            return f"{name} at {math.degrees(angle):.1f} deg, limits {low:.1f} to {high:.1f}"
    return None


def _check_numbers(goal: Goal) -> Refusal | None:
    names = (*ToolPose._fields, "speed", "settle")
    for name, value in zip(names, (*goal.pose, goal.speed, goal.settle), strict=True):
        if not math.isfinite(value):
            return Refusal(Fault.INVALID, f"{name} is {value}, want a finite number")
    return None


def _check_rules(goal: Goal, limits: Limits) -> Refusal | None:
    for name, value, span, unit in (
        ("speed", goal.speed, limits.speed, "m/s"),
        ("settle", goal.settle, limits.settle, "s"),
    ):
        if not span.holds(value):
            reason = f"{name} is {value:g} {unit}, allowed {span.low:g} to {span.high:g}"
            return Refusal(Fault.INVALID, reason)
    return None


def _check_boxes(pose: ToolPose, limits: Limits) -> Refusal | None:
    x, y, z, _ = pose
    where = f"({x:.3f}, {y:.3f}, {z:.3f}) m"
    for name, value, low, high in zip(
        "xyz", (x, y, z), limits.allowed.low, limits.allowed.high, strict=True
    ):
        if not low <= value <= high:
            reason = f"{name} is {value:.3f} m, the allowed box has {low:g} to {high:g}"
            return Refusal(Fault.INVALID, reason)
    for box in limits.forbidden:
        if box.holds(x, y, z):
            return Refusal(Fault.INVALID, f"{where} lies in {box.name}")
    return None


def load_limits(path: str | Path) -> Limits:
    """Limits from a YAML file such as config/magician.yaml.

    Raises ValueError naming the file, the entry and its value.
    """
    reader = _Reader(str(path), yaml.safe_load(Path(path).read_text(encoding="utf-8")))
    spans = [reader.span("joints", name) for name in Joints._fields]
    elbow = reader.span("joints", "elbow")
    links = Links(*(reader.number("links", name) for name in Links._fields))
    for name in ("rear_arm", "forearm"):
        if getattr(links, name) <= 0.0:
            reader.fail(f"links.{name}", getattr(links, name), "a positive length")
    return Limits(
        links=links,
        joints=tuple(_radians(span) for span in spans),
        elbow=_radians(elbow),
        speed=reader.low_high("speed"),
        settle=reader.low_high("settle"),
        allowed=reader.box("allowed", reader.get("allowed")),
        forbidden=tuple(
            reader.box(f"forbidden[{i}]", entry) for i, entry in enumerate(reader.get("forbidden"))
        ),
    )


def _radians(span: Span) -> Span:
    return Span(math.radians(span.low), math.radians(span.high))


class _Reader:
    """Reads entries of the file and refuses bad ones by name."""

    def __init__(self, path: str, tree: Any) -> None:
        self._path = path
        self._tree = tree if isinstance(tree, dict) else {}

    def fail(self, entry: str, value: Any, wanted: str) -> None:
        raise ValueError(f"{self._path}: {entry} is {value!r}, want {wanted}")

    def get(self, *keys: str) -> Any:
        tree: Any = self._tree
        for i, key in enumerate(keys):
            if not isinstance(tree, dict) or key not in tree:
                raise ValueError(f"{self._path}: {'.'.join(keys[: i + 1])} is missing")
            tree = tree[key]
        return tree

    def number(self, *keys: str) -> float:
        return self._finite(".".join(keys), self.get(*keys))

    def span(self, *keys: str) -> Span:
        return self._ordered(".".join(keys), self.get(*keys))

    def low_high(self, key: str) -> Span:
        return self._ordered(key, [self.get(key, "min"), self.get(key, "max")])

    def box(self, entry: str, tree: Any) -> Box:
        if not isinstance(tree, dict):
            self.fail(entry, tree, "a box with min and max")
        corners = [self._corner(f"{entry}.{key}", tree.get(key)) for key in ("min", "max")]
        for name, low, high in zip("xyz", *corners, strict=True):
            self._ordered(f"{entry} in {name}", [low, high])
        return Box(str(tree.get("name", entry)), *corners)

    def _corner(self, entry: str, value: Any) -> tuple[float, float, float]:
        if not isinstance(value, list) or len(value) != 3:
            self.fail(entry, value, "three numbers")
        x, y, z = (self._finite(f"{entry}[{i}]", v) for i, v in enumerate(value))
        return x, y, z

    def _ordered(self, entry: str, value: Any) -> Span:
        if not isinstance(value, list) or len(value) != 2:
            self.fail(entry, value, "two numbers")
        low, high = (self._finite(f"{entry}[{i}]", v) for i, v in enumerate(value))
        if low >= high:
            self.fail(entry, value, "the smaller number first")
        return Span(low, high)

    def _finite(self, entry: str, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            self.fail(entry, value, "a number")
        if not math.isfinite(value):
            self.fail(entry, value, "a finite number")
        return float(value)
