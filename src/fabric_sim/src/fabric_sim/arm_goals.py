# SPDX-License-Identifier: BSD-3-Clause
"""Goals of `arm/move` as the simulated arm takes them, checked as the driver's are."""

from collections.abc import Container
from typing import Any

from fabric_dobot_driver import Goal, Limits, Refusal
from fabric_dobot_driver.goals import asked
from fabric_msgs.msg import MoveArmResult
from fabric_sim.arm import OUTCOMES, ArmResult, goal_of


def taken(message: Any, limits: Limits, in_use: Container[int]) -> Goal | ArmResult:
    """The goal of a MoveArmGoal, or its end when it is refused. in_use: numbers of other goals."""
    number = message.number
    if number == 0 or number in in_use:
        state = "in use" if number else "not allowed"
        return ArmResult(number, MoveArmResult.INVALID, f"goal number {number} is {state}")
    wanted = asked(message, limits)
    if isinstance(wanted, Refusal):
        return ArmResult(number, OUTCOMES[wanted.fault], wanted.reason)
    (*place, yaw), speed, settle = wanted
    return goal_of(tuple(place), yaw, speed, settle)
