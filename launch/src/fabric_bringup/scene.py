# SPDX-License-Identifier: BSD-3-Clause
"""The whole picture: the last message of each topic, drawn as markers with stable ids.

Drawn is only what the robot perceives; the simulation's truth is not among the inputs.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from visualization_msgs.msg import Marker

from fabric_bringup import draw, figures, panels
from fabric_bringup.layout import Layout, Tray
from fabric_msgs.msg import (
    ContainerArray,
    ConveyorState,
    Cube,
    CubeArray,
    Decision,
    HeadState,
    HumanActivity,
    ModelInfo,
    PolicyChoice,
    RobotActionState,
    TaskState,
    TypeBelief,
)

WARNING_SHOWN = 2.0  # s

TOPICS: dict[str, type] = {
    "human/activity": HumanActivity,
    "human/head": HeadState,
    "cell/cubes": CubeArray,
    "cell/containers": ContainerArray,
    "conveyor/state": ConveyorState,
    "model_info": ModelInfo,
    "decision": Decision,
    "robot/state": RobotActionState,
    "task/state": TaskState,
    "abps/type_belief": TypeBelief,
    "abps/policy": PolicyChoice,
}


class Scene:
    """Keeps the last message of each topic of TOPICS and draws them."""

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        self._person = figures.Person(layout)
        self._belt = figures.Belt(layout)
        self._last: dict[str, Any] = {}
        self._warned: float | None = None
        self._shown: set[tuple[str, int]] = set()

    def take(self, topic: str, message: Any) -> None:
        """Take note of a message of a topic in TOPICS."""
        self._last[topic] = message

    def warn(self, now: float) -> None:
        """The person gave the stop sign at `now` (s, the clock of `markers`)."""
        self._warned = now

    def markers(self, now: float) -> list[Marker]:
        """Every marker at `now` (s, any steady clock), and a deletion for each that is gone."""
        drawn = list(self._things(now)) + list(self._panels())
        keys = {(marker.ns, marker.id) for marker in drawn}
        gone = [draw.deletion(key) for key in sorted(self._shown - keys)]
        self._shown = keys
        return drawn + gone

    def _things(self, now: float) -> Iterator[Marker]:
        last, layout = self._last.get, self._layout
        yield from figures.table_top(layout)
        activity, head = last("human/activity"), last("human/head")
        yield from self._person.markers(activity, head, self._reach())
        yield from self._belt.markers(last("conveyor/state"))
        yield from figures.tray_markers(self._trays(), last("cell/containers"))
        yield from figures.cube_markers(last("cell/cubes"), layout, self._scenario())
        yield from figures.robot_label(last("robot/state"), layout)
        age = None if self._warned is None else now - self._warned
        shown = age if age is not None and age < WARNING_SHOWN else None
        yield from figures.warning_markers(shown, layout)

    def _panels(self) -> Iterator[Marker]:
        last = self._last.get
        yield from panels.task_panel(last("task/state"))
        yield from panels.belief_panel(last("model_info"), last("decision"))
        yield from panels.decision_panel(last("model_info"), last("decision"))
        yield from panels.type_panel(last("abps/type_belief"), last("abps/policy"))

    def _scenario(self) -> str:
        state = self._last.get("task/state")
        return state.scenario if state is not None else ""

    def _trays(self) -> tuple[Tray, ...]:
        return self._layout.trays.get(self._scenario(), ())

    def _reach(self) -> draw.Vector:
        """Where a grasping hand goes: with a held cube, or to the pick point."""
        cubes = self._last.get("cell/cubes")
        for cube in cubes.cubes if cubes else ():
            if cube.where == Cube.WHERE_PERSON:
                at = cube.pose.position
                return (at.x, at.y, at.z + 0.04)
        return self._layout.on_belt(0.0, up=0.06)
