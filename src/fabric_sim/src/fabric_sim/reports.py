# SPDX-License-Identifier: BSD-3-Clause
"""The cell's messages: what the devices report, as data. Poses in the frame cell."""

import math
from collections.abc import Iterable, Mapping

import genpy
import numpy as np
from geometry_msgs.msg import Point as PointMsg
from geometry_msgs.msg import Pose, Quaternion
from std_msgs.msg import Header

from fabric_msgs.msg import (
    Container,
    ContainerArray,
    ConveyorState,
    Cube,
    CubeArray,
    GroundTruth,
    HeadState,
    HumanActivity,
)
from fabric_sim.body import BodyMotion
from fabric_sim.geometry import Point
from fabric_sim.sensing import Percept
from fabric_sim.stock import CubeState, Stock
from fabric_sim.truth import Truth

FRAME = "cell"


def header(t: float, frame: str = FRAME) -> Header:
    """A header stamped t seconds, to the nanosecond."""
    nanos = round(1e9 * t)
    message, stamp = Header.__new__(Header), genpy.Time.__new__(genpy.Time)  # every field is set
    stamp.secs, stamp.nsecs = nanos // 10**9, nanos % 10**9
    message.seq, message.stamp, message.frame_id = 0, stamp, frame
    return message


def single(value: float) -> float:
    """The value as a float32 field brings it over: with and without a network the same."""
    return float(np.float32(value))


def pose(point: Point, yaw: float = 0.0) -> Pose:
    """A pose turned by yaw rad about z."""
    turn = Quaternion(0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
    return Pose(PointMsg(*point), turn)


def conveyor(t: float, stock: Stock) -> ConveyorState:
    """State of the belt and its infrared sensor."""
    return ConveyorState(header(t), single(stock.belt.speed), stock.at_pick_point is not None)


def cubes(t: float, seen: Iterable[tuple[CubeState, int, Point]]) -> CubeArray:
    """Every cube in view: (cube, Cube.WHERE_*, its middle)."""
    return CubeArray(
        header(t),
        [Cube(c.id, c.perceived, where, pose(at), single(c.confidence)) for c, where, at in seen],
    )


def containers(
    t: float, sequence: int, stock: Stock, contents: Mapping[int, list[int]]
) -> ContainerArray:
    """Containers with the cubes the load cells report: ids by container id."""
    rows = []
    for tray in stock.trays:
        ids = contents.get(tray.id, [])
        colours = bytes(stock.cubes[i].colour for i in ids)
        row = Container.__new__(Container)  # every field is set here
        row.id, row.owner, row.label = tray.id, tray.owner, tray.label
        row.cube_ids, row.cube_colours = list(ids), colours
        rows.append(row)
    message = ContainerArray.__new__(ContainerArray)
    message.header, message.sequence, message.containers = header(t), sequence, rows
    return message


def activity(t: float, percept: Percept) -> HumanActivity:
    """The recogniser's posterior over gestures."""
    posterior = [single(p) for p in percept.posterior]
    age = single(percept.evidence_age)
    return HumanActivity(header(t), posterior, percept.behaviour.present, age)


def head(t: float, percept: Percept, body: BodyMotion) -> HeadState:
    """Head pose; the identity when it is not visible."""
    visible = percept.behaviour.present
    at = pose(body.head, math.pi + body.turned) if visible else pose(Point(0.0, 0.0, 0.0))
    return HeadState(header(t), visible, visible and percept.behaviour.looking_around, at)


def truth(t: float, sequence: int, task_id: int, hidden: Truth) -> GroundTruth:
    """The person's hidden state, from the fields of fabric_sim.truth.Truth."""
    message = GroundTruth(header=header(t), sequence=sequence, task_id=task_id)
    for name in hidden._fields:
        value = getattr(hidden, name)
        setattr(message, name, single(value) if isinstance(value, float) else value)
    return message
