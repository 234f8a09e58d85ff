# SPDX-License-Identifier: BSD-3-Clause
"""What arm and belt tell, and the exchanges they ask for."""

from collections.abc import Callable
from typing import NamedTuple

from fabric_dobot_driver.kinematics import Joints, ToolPose
from fabric_dobot_driver.wire import Wire

Act = Callable[[Wire], None]  # one exchange; done when it returns, tried again when it raises


class ArmResult(NamedTuple):
    """The end of a goal."""

    number: int
    outcome: int  # MoveArmResult.*
    reason: str


class ArmState(NamedTuple):
    """A look at the arm. number: of the goal under way, None without one; remaining: m to it."""

    pose: ToolPose
    joints: Joints
    number: int | None
    remaining: float


class Notice(NamedTuple):
    """Something worth a line in the log."""

    text: str
    serious: bool = False


class BeltState(NamedTuple):
    """speed: as the motor was told, m/s. cube: whether something is in the beam."""

    speed: float
    cube: bool
