# SPDX-License-Identifier: BSD-3-Clause
"""What a tick of the cell brought, and what its devices say of it: messages in their order."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from std_msgs.msg import Header

from fabric_msgs.msg import (
    ContainerArray,
    ConveyorState,
    Cube,
    CubeArray,
    GroundTruth,
    HeadState,
    HumanActivity,
)
from fabric_sim import reports
from fabric_sim.arm import ArmResult
from fabric_sim.geometry import Point
from fabric_sim.sensing import Percept
from fabric_sim.stock import CubeState
from fabric_sim.truth import Truth

if TYPE_CHECKING:
    from fabric_sim.cell import Cell


class Moment:
    """What a tick brought. Everything but the arm's results is there when the sensors report.

    t: s. percept: of the person. hidden: the person's true state. sequence: number of the report.
    containers: when a load cell has settled.
    """

    def __init__(
        self,
        t: float,
        arm_results: list[ArmResult],
        percept: Percept | None = None,
        hidden: Truth | None = None,
        sequence: int = 0,
    ) -> None:
        self.t, self.arm_results = t, arm_results
        self.percept, self.hidden, self.sequence = percept, hidden, sequence
        self.containers: ContainerArray | None = None


class Stimulus(NamedTuple):
    """Messages that reach the graph together: pairs of topic and message."""

    messages: tuple[tuple[str, Any], ...]


@dataclass
class CellOutput:
    """What a tick brought; None or empty where it brought nothing."""

    t: float  # s
    truth: GroundTruth | None = None
    arm_results: list[ArmResult] = field(default_factory=list)
    conveyor: ConveyorState | None = None
    cubes: CubeArray | None = None
    containers: ContainerArray | None = None
    warning: Header | None = None
    activity: HumanActivity | None = None
    head: HeadState | None = None

    def stimuli(self) -> list[Stimulus]:
        """The messages in the order of docs/time.md, together what is handed on together."""
        groups = (
            [("truth", self.truth)],
            [("arm/move/result", result) for result in self.arm_results],
            [("conveyor/state", self.conveyor), ("cell/cubes", self.cubes)],
            [("cell/containers", self.containers)],
            [("human/warning", self.warning)],
            [("human/activity", self.activity), ("human/head", self.head)],
        )
        filled = [tuple(pair for pair in group if pair[1] is not None) for group in groups]
        return [Stimulus(messages) for messages in filled if messages]


def output_of(cell: Cell, moment: Moment) -> CellOutput:
    """The messages of the moment that the cell is in."""
    t, percept = moment.t, moment.percept
    output = CellOutput(t, arm_results=moment.arm_results)
    if percept is None:
        return output
    assert moment.hidden is not None
    output.truth = reports.truth(t, moment.sequence, cell.task.task_id, moment.hidden)
    output.conveyor = reports.conveyor(t, cell.stock)
    output.cubes = reports.cubes(t, seen(cell))
    output.containers = moment.containers
    output.warning = reports.header(t) if percept.warning else None
    output.activity = reports.activity(t, percept)
    output.head = reports.head(t, percept, cell.body)
    return output


def seen(cell: Cell) -> list[tuple[CubeState, int, Point]]:
    """Every cube in view, where it is said to be (Cube.WHERE_*), and its middle in the cell, m."""
    lying = _lying(cell)
    return [
        (cube, where, lying[cube.id] if cube.id in lying else _middle(cell, cube, where))
        for cube, where in cell.stock.seen()
    ]


def _middle(cell: Cell, cube: CubeState, where: int) -> Point:
    half = cell.geometry.edge / 2
    if where == Cube.WHERE_PERSON:
        return cell.body.hand
    if where == Cube.WHERE_ROBOT:
        return Point(cell.cup.x, cell.cup.y, cell.cup.z - half)
    x = cell.stock.belt.places[cube.id]
    return cell.geometry.conveyor.to_cell(Point(x, 0.0, half))


def _lying(cell: Cell) -> Mapping[int, Point]:
    """Places of the cubes in containers, m in the cell."""
    places = {}
    for tray in cell.stock.trays:
        inside = [cube.id for cube in cell.stock.cubes.values() if cube.container == tray.id]
        for i, cube in enumerate(inside):
            places[cube] = tray.slot(i, cell.geometry.edge)
    return places
