# SPDX-License-Identifier: BSD-3-Clause
"""What goes in and out of a simulated worker: what the person sees, and what the person does."""

from __future__ import annotations

import enum
from typing import Any, NamedTuple

# Numbers of fabric_msgs/Decision and fabric_msgs/RobotActionState; a test compares them.
ROBOT_IDLE, ROBOT_PLANNING, ROBOT_POINT, ROBOT_GRASP, ROBOT_CANCEL = range(5)
ROBOT_NONE = 255
PHASE_REST, PHASE_APPROACH, PHASE_CONTACT, PHASE_CARRY, PHASE_RETREAT = range(5)

HELD_BY_NOBODY, HELD_BY_PERSON, HELD_BY_ROBOT = range(3)


class RobotView(NamedTuple):
    """What the person sees of the robot; a RobotActionState message serves as well."""

    current: int = ROBOT_IDLE
    phase: int = PHASE_REST


class WorldView(NamedTuple):
    """What the person sees of the cube: is it at the pick point, and who holds it."""

    cube_at_pick_point: bool = True
    held_by: int = HELD_BY_NOBODY


class EventKind(enum.Enum):
    """What a worker can do to the world."""

    STARTED_ACTION = "started_action"  # `action` says which
    PICKED_CUBE = "picked_cube"  # the cube leaves the pick point in the person's hand
    PLACED_CUBE = "placed_cube"  # into the person's tray `container`; `correct` by the rules
    RELEASED = "released"  # lets go of the cube: it goes back to the pick point
    WARNED = "warned"  # begins a stop gesture
    CALLED = "called"  # raises a hand for help, which looks the same
    LEFT = "left"  # is out of sight from now on
    RETURNED = "returned"  # is in sight again


class WorkerEvent(NamedTuple):
    """One event; `t` in s, `state` is the worker's state when it happened."""

    t: float
    kind: EventKind
    state: str
    action: str
    container: str | None = None
    correct: bool | None = None
    item: Any = None  # of the rules, that the cube falls under
