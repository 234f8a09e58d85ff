# SPDX-License-Identifier: BSD-3-Clause
"""The things in the cell: person, belt, cubes, trays, the robot's label, the warning."""

from __future__ import annotations

import math
from collections.abc import Iterator

from visualization_msgs.msg import Marker

from fabric_bringup import draw
from fabric_bringup.draw import Vector
from fabric_bringup.layout import Layout, Tray
from fabric_msgs.msg import (
    ContainerArray,
    ConveyorState,
    Cube,
    CubeArray,
    HeadState,
    HumanActivity,
    RobotActionState,
)

CUBE_COLOURS = {
    Cube.COLOUR_RED: (0.83, 0.18, 0.18, 1.0),
    Cube.COLOUR_GREEN: (0.16, 0.62, 0.30, 1.0),
    Cube.COLOUR_BLUE: (0.16, 0.36, 0.80, 1.0),
}
COLOUR_LABELS = ("red", "green", "blue")
CARDBOARD = (0.76, 0.60, 0.42, 1.0)
LABEL_COLOURS = {
    "red": CUBE_COLOURS[Cube.COLOUR_RED],
    "green": CUBE_COLOURS[Cube.COLOUR_GREEN],
    "blue": CUBE_COLOURS[Cube.COLOUR_BLUE],
    "inspected": draw.GOOD,
}
ACTIVITIES = ("idle", "grasping", "STOP gesture", "something else")
ACTIONS = ("idle", "planning a grasp", "pointing", "grasping", "cancelling")
NEXT = ("idle", "plan", "point", "grasp", "cancel")
PHASES = ("at rest", "approaching", "at the cube", "carrying", "retreating")
HAND_STEP = 0.06  # m a frame: 0.6 m/s at 10 Hz
WALL = 0.006  # m
STRIPE_PITCH = 0.055  # m
BLINKS = 2.5  # Hz


class Person:
    """What the activity and head messages say of the person; the hand follows smoothly."""

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        self._hand = layout.of_person("rest")

    def markers(
        self, activity: HumanActivity | None, head: HeadState | None, reach: Vector
    ) -> Iterator[Marker]:
        """Body, arm, head with gaze and a label; `reach` is where a grasping hand goes."""
        seen = activity is not None and activity.detected
        alpha = 1.0 if seen else 0.25
        doing = most_likely(activity) if seen else HumanActivity.IDLE
        self._hand = draw.towards(self._hand, self._goal(doing, reach), HAND_STEP)
        yield from self._body(alpha)
        yield from self._arms(alpha, doing)
        yield from self._head(head, alpha)
        yield self._label(activity, head, doing, seen)

    def _goal(self, doing: int, reach: Vector) -> Vector:
        if doing == HumanActivity.GRASP:
            return reach
        if doing == HumanActivity.WARN:
            return self._layout.of_person("stop")
        if doing == HumanActivity.OTHER:
            x, y, z = self._layout.joints["head"]
            return self._layout.of_person((x + 0.10, y - 0.08, z - 0.10))
        return self._layout.of_person("rest")

    def _body(self, alpha: float) -> Iterator[Marker]:
        shoulder = self._layout.joints["shoulder"]
        high = shoulder[2]
        shirt = draw.faded(draw.PERSON, alpha)
        width = 2 * abs(shoulder[1])
        chest = self._layout.of_person((0.0, 0.0, high / 2 - 0.05))
        size = (0.18, width - 0.06, high + 0.16)
        yield draw.solid(("person", 0), Marker.CYLINDER, chest, size, shirt)
        yoke = self._layout.of_person((0.0, 0.0, high + 0.03))
        yield draw.solid(("person", 1), Marker.SPHERE, yoke, (0.18, width - 0.06, 0.12), shirt)
        neck = self._layout.of_person((0.02, 0.0, high + 0.08))
        skin = draw.faded(draw.SKIN, alpha)
        yield draw.solid(("person", 2), Marker.CYLINDER, neck, (0.07, 0.07, 0.10), skin)

    def _arms(self, alpha: float, doing: int) -> Iterator[Marker]:
        x, y, z = self._layout.joints["shoulder"]
        rest = self._layout.joints["rest"]
        other = self._layout.of_person((rest[0], -rest[1], rest[2]))
        warning = doing == HumanActivity.WARN
        hand_colour = draw.ALARM if warning else draw.faded(draw.SKIN, alpha)
        sleeve = draw.faded(draw.PERSON, alpha)
        sides = ((y, self._hand, hand_colour), (-y, other, draw.faded(draw.SKIN, alpha)))
        for number, (side, hand, colour) in enumerate(sides):
            shoulder = self._layout.of_person((x, side, z - 0.02))
            middle = [(a + b) / 2 for a, b in zip(shoulder, hand, strict=True)]
            elbow = (middle[0], middle[1], middle[2] - 0.07)
            yield draw.line(("person", 10 + number), (shoulder, elbow, hand), 0.05, sleeve)
            yield draw.ball(("person", 20 + number), hand, 0.065, colour)

    def _head(self, head: HeadState | None, alpha: float) -> Iterator[Marker]:
        at = self._layout.of_person("head")
        yield draw.ball(("person", 30), at, 0.17, draw.faded(draw.SKIN, alpha))
        if head is None or not head.visible:
            return
        turn = math.radians(75) if head.looking_around else 0.0
        drop = -0.10 if head.looking_around else -0.45
        yaw = self._layout.person_yaw - turn
        ahead = (math.cos(yaw), math.sin(yaw), drop)
        start = (at[0] + 0.08 * ahead[0], at[1] + 0.08 * ahead[1], at[2] + 0.02)
        tip = tuple(a + 0.20 * b for a, b in zip(start, ahead, strict=True))
        colour = draw.ALARM if head.looking_around else draw.ROBOT
        yield draw.arrow(("person", 31), start, tip, 0.014, colour)

    def _label(
        self, activity: HumanActivity | None, head: HeadState | None, doing: int, seen: bool
    ) -> Marker:
        words = "PERSON as seen\n"
        words += f"{ACTIVITIES[doing]} ({activity.posterior[doing]:.0%})" if seen else "not in view"
        if head is not None and head.visible:
            words += "\nlooking around" if head.looking_around else "\nlooking at the work"
        x, y, z = self._layout.of_person("head")
        return draw.text(("person", 40), (x + 0.02, y, z + 0.22), 0.046, words, draw.INK)


def most_likely(activity: HumanActivity) -> int:
    """Index of the likeliest activity."""
    return max(range(len(activity.posterior)), key=lambda index: activity.posterior[index])


class Belt:
    """The moving surface, its speed as stripes, and the sensor at the pick point."""

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        self._phase = 0.0
        self._last = None

    def markers(self, state: ConveyorState | None) -> Iterator[Marker]:
        """Surface, stripes, sensor, label."""
        layout = self._layout
        speed = state.speed if state else 0.0
        if state is not None:
            stamp = state.header.stamp.to_sec()
            if self._last is not None and 0.0 < stamp - self._last < 1.0:
                self._phase = (self._phase + speed * (stamp - self._last)) % STRIPE_PITCH
            self._last = stamp
        length = layout.belt_to - layout.belt_from
        middle = (layout.belt_to + layout.belt_from) / 2
        size = (length, layout.belt_width, 0.004)
        at = layout.on_belt(middle, up=-0.002)
        yield draw.box(("belt", 0), at, size, draw.BELT, layout.belt_yaw)
        for number in range(int(length / STRIPE_PITCH)):
            along = layout.belt_from + self._phase + number * STRIPE_PITCH
            at = layout.on_belt(along, up=0.0005)
            size = (0.006, layout.belt_width, 0.001)
            yield draw.box(("belt", 1 + number), at, size, draw.STRIPE, layout.belt_yaw)
        waiting = state is not None and state.cube_at_pick_point
        lamp = draw.GOOD if waiting else draw.FAINT
        at = layout.on_belt(0.0, -layout.belt_width / 2 - 0.012, 0.012)
        yield draw.box(("belt", 100), at, (0.02, 0.02, 0.024), lamp, layout.belt_yaw)
        words = "belt stopped" if speed == 0.0 else f"belt {100 * speed:.0f} cm/s"
        at = layout.on_belt(layout.belt_from - 0.06, up=-0.06)
        yield draw.text(("belt", 101), at, 0.030, words, draw.INK)


def cube_markers(cubes: CubeArray | None, layout: Layout, scenario: str) -> Iterator[Marker]:
    """Every perceived cube by its id; packages are brown."""
    for cube in cubes.cubes if cubes else ():
        colour = CUBE_COLOURS.get(cube.colour, CARDBOARD)
        colour = CARDBOARD if scenario == "inspection" else colour
        at = (cube.pose.position.x, cube.pose.position.y, cube.pose.position.z)
        marker = draw.box(("cubes", cube.id), at, (layout.edge,) * 3, colour)
        marker.pose.orientation = cube.pose.orientation
        yield marker


def tray_markers(trays: tuple[Tray, ...], containers: ContainerArray | None) -> Iterator[Marker]:
    """Floor and walls of every tray in the colour of its label, with owner and count above."""
    inside = {box.id: len(box.cube_ids) for box in containers.containers} if containers else {}
    for tray in trays:
        colour = draw.faded(LABEL_COLOURS.get(tray.label, draw.FAINT), 0.9)
        x, y, z = tray.floor
        wide, deep = tray.size
        yield draw.box(("trays", 10 * tray.id), (x, y, z - 0.002), (wide, deep, 0.004), colour)
        for side, (dx, dy) in enumerate(((1, 0), (-1, 0), (0, 1), (0, -1)), 1):
            at = (x + dx * wide / 2, y + dy * deep / 2, z + 0.012)
            size = (WALL if dx else wide, WALL if dy else deep, 0.03)
            yield draw.box(("trays", 10 * tray.id + side), at, size, colour)
        yield tray_count(tray, inside.get(tray.id, 0))


def tray_count(tray: Tray, count: int) -> Marker:
    """How many lie inside; the colour says what belongs there, other labels are spelled out."""
    x, y, z = tray.floor
    key = ("trays", 10 * tray.id + 5)
    if tray.owner == "belt":
        return draw.text(key, (x, y + 0.10, z + 0.14), 0.032, f"missed: {count}", draw.INK)
    words = str(count) if tray.label in COLOUR_LABELS else f"{tray.label}: {count}"
    return draw.text(key, (x, y, z + 0.05), 0.042, words, draw.WHITE)


def table_top(layout: Layout) -> Iterator[Marker]:
    """The table's face, and whose trays are where."""
    x, y, wide, deep = layout.table
    left, right, near, far = x - wide / 2, x + wide / 2, y - deep / 2, y + deep / 2
    corners = ((left, near, 0.001), (right, near, 0.001), (right, far, 0.001), (left, far, 0.001))
    yield draw.flat(("table", 0), corners, draw.TABLE)
    yield draw.text(("table", 1), (0.06, -0.40, 0.02), 0.032, "robot's trays", draw.INK)
    yield draw.text(("table", 2), (0.50, -0.19, 0.02), 0.032, "person's trays", draw.INK)


def robot_label(state: RobotActionState | None, layout: Layout) -> Iterator[Marker]:
    """What the motion node does, above the arm."""
    words = "ROBOT\n"
    if state is None or state.current >= len(ACTIONS):
        words += "no action"
    else:
        words += f"{ACTIONS[state.current]}\n{PHASES[state.phase]}"
        if state.queued < len(ACTIONS):
            words += f"\nthen {NEXT[state.queued]}"
    x, y, z = layout.arm
    yield draw.text(("robot", 0), (x - 0.05, y, z + 0.36), 0.046, words, draw.ROBOT)


def warning_markers(age: float | None, layout: Layout) -> Iterator[Marker]:
    """A flash around the person; `age` is the time since the warning in s, None for none."""
    if age is None or int(2 * BLINKS * age) % 2:
        return
    chest = layout.of_person((0.0, 0.0, 0.28))
    yield draw.ball(("warning", 0), chest, 0.75, draw.faded(draw.ALARM, 0.25))
    at = layout.of_person((0.42, 0.0, 0.42))
    yield draw.text(("warning", 1), at, 0.09, "STOP!", draw.ALARM)
