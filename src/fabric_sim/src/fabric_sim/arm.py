# SPDX-License-Identifier: BSD-3-Clause
"""The simulated Magician: straight lines of the tool with a trapezoid of speed, and suction."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from typing import NamedTuple

from mypy_extensions import mypyc_attr

from fabric_dobot_driver import Goal, Joints, Limits, ToolPose, check_goal, inverse
from fabric_dobot_driver.limits import Fault, Refusal, between, check_path
from fabric_msgs.clock import micro
from fabric_msgs.msg import MoveArmResult
from fabric_sim.entries import Entries

OUTCOMES = {
    Fault.INVALID: MoveArmResult.INVALID,
    Fault.UNREACHABLE: MoveArmResult.UNREACHABLE,
}
JOINT_NAMES = Joints._fields
CHECKS_KEPT = 4096  # pairs of start and goal
SLACK = 1e-9  # s; forgives rounding when times are compared


def goal_of(place: tuple[float, ...], yaw: float, speed: float, settle: float) -> Goal:
    """The goal at place (x, y, z) in m of arm_base_link, rad, m/s, s.

    Numbers are rounded, so that a goal is the same whether or not it went through float32.
    """
    x, y, z = place
    return Goal(ToolPose(x, y, z, round(yaw, 9)), micro(speed), micro(settle))


class ArmResult(NamedTuple):
    """The end of a move."""

    number: int
    outcome: int  # MoveArmResult.*
    reason: str


@mypyc_attr(native_class=False)  # travels between processes
@dataclass(frozen=True)
class ArmParameters:
    """How the simulated arm moves: m, rad, s; poses in arm_base_link."""

    home: ToolPose
    home_speed: float
    acceleration: float
    yaw_speed: float
    suction_lateral: float
    suction_vertical: float
    floor_time: float


class Trapezoid:
    """A way of `length` m, driven with at most `speed` m/s and `acceleration` m/s^2."""

    def __init__(self, length: float, speed: float, acceleration: float) -> None:
        self._length = length
        self._acceleration = acceleration
        self._peak = min(speed, math.sqrt(length * acceleration))
        self._ramp = self._peak / acceleration
        cruise = length - self._peak * self._ramp
        self.duration = 2.0 * self._ramp + (cruise / self._peak if self._peak > 0.0 else 0.0)

    def fraction(self, t: float) -> float:
        """Part of the way done after t seconds, 0 to 1."""
        if t >= self.duration or self._length == 0.0:
            return 1.0
        if t > self.duration - self._ramp:
            return 1.0 - self._on_ramp(self.duration - t)
        if t > self._ramp:
            return self._on_ramp(self._ramp) + self._peak * (t - self._ramp) / self._length
        return self._on_ramp(t)

    def _on_ramp(self, t: float) -> float:
        return 0.5 * self._acceleration * t * t / self._length


class _Move:
    """A goal under way.

    turn: s the tool servo needs. elapsed: s. duration: from the start until the goal counts as
    reached, s.
    """

    def __init__(
        self, number: int, start: ToolPose, goal: Goal, profile: Trapezoid, turn: float
    ) -> None:
        self.number = number
        self.start, self.end = start, goal.pose
        self.profile, self.turn = profile, turn
        self.elapsed = 0.0
        self.duration = max(profile.duration, turn) + goal.settle

    def pose(self) -> ToolPose:
        """Pose at the elapsed time; the servo turns evenly beside the straight line."""
        if self.elapsed >= max(self.profile.duration, self.turn):
            return self.end
        along = between(self.start, self.end, self.profile.fraction(self.elapsed))
        turned = min(1.0, self.elapsed / self.turn) if self.turn > 0.0 else 1.0
        return along._replace(yaw=self.start.yaw + turned * (self.end.yaw - self.start.yaw))


class Arm:
    """Executes one goal at a time; a new goal replaces the running one."""

    def __init__(self, parameters: ArmParameters, limits: Limits) -> None:
        self._parameters = parameters
        self._limits = limits
        self.suction = False
        self._pose = parameters.home  # where the last move ended or was stopped
        self._move: _Move | None = None
        self._refusal = _checks(limits)

    @property
    def pose(self) -> ToolPose:
        """Where the tool is."""
        return self._move.pose() if self._move else self._pose

    @property
    def number(self) -> int | None:
        """Number of the running goal."""
        return self._move.number if self._move else None

    @property
    def remaining(self) -> float:
        """Way to the running goal, m; 0 without one."""
        return math.dist(self.pose[:3], self._move.end[:3]) if self._move else 0.0

    @property
    def joints(self) -> Joints:
        """Joint angles, rad."""
        joints = inverse(self.pose, self._limits.links)
        assert joints is not None, f"the tool stands out of reach at {self.pose}"
        return joints

    def start(self, number: int, goal: Goal) -> list[ArmResult]:
        """Take on a goal. Return what ends with it: a displaced goal, or itself when refused."""
        start = self.pose
        refusal = self._refusal(start, goal)
        if refusal is not None:
            return [ArmResult(number, OUTCOMES[refusal.fault], refusal.reason)]
        ended = self.stop(f"goal {number} came")
        self._move = self._plan(number, start, goal)
        return ended

    def home(self) -> list[ArmResult]:
        """Drive to the home pose (goal 0, without a result of its own)."""
        return self.start(0, Goal(self._parameters.home, self._parameters.home_speed))

    def stop(self, reason: str = "cancelled") -> list[ArmResult]:
        """Stop at once; return the result of the goal that ran, if any."""
        self._pose = self.pose
        move, self._move = self._move, None
        if move is None or move.number == 0:
            return []
        return [ArmResult(move.number, MoveArmResult.PRE_EMPTED, reason)]

    @property
    def rest(self) -> float:
        """Time until the running goal is reached, s; infinite without one."""
        return self._move.duration - self._move.elapsed if self._move else math.inf

    def skip(self, dt: float) -> None:
        """Move for dt seconds, less than `rest`."""
        if self._move:
            self._move.elapsed = micro(self._move.elapsed + dt)

    def step(self, dt: float) -> list[ArmResult]:
        """Move for dt seconds; return the result of a goal that is reached."""
        move = self._move
        if move is None:
            return []
        move.elapsed = micro(move.elapsed + dt)
        if move.elapsed < move.duration - SLACK:
            return []
        self._pose, self._move = move.pose(), None
        return [ArmResult(move.number, MoveArmResult.REACHED, "")] if move.number else []

    def _plan(self, number: int, start: ToolPose, goal: Goal) -> _Move:
        p = self._parameters
        length = math.dist(start[:3], goal.pose[:3])
        profile = Trapezoid(length, goal.speed, p.acceleration)
        turn = abs(goal.pose.yaw - start.yaw) / p.yaw_speed
        return _Move(number, start, goal, profile, turn)


@lru_cache
def _checks(limits: Limits) -> Callable[[ToolPose, Goal], Refusal | None]:
    """What checks a move from a pose to a goal; it remembers, as the check of a line takes long and
    every arm under the same limits is asked for the same few moves.
    """
    return lru_cache(CHECKS_KEPT)(partial(_check, limits))


def _check(limits: Limits, start: ToolPose, goal: Goal) -> Refusal | None:
    return check_goal(goal, limits) or check_path(start, goal.pose, limits)


def load_arm(path: str | Path) -> ArmParameters:
    """Read config/arm.yaml. Raises ConfigError naming the file, the entry and its value."""
    entries = Entries.read(path)
    home = entries.branch("home")
    suction = entries.branch("suction")
    return ArmParameters(
        home=ToolPose(*(home.number(key) for key in ToolPose._fields)),
        home_speed=entries.positive("home_speed"),
        acceleration=entries.positive("acceleration"),
        yaw_speed=entries.positive("yaw_speed"),
        suction_lateral=suction.positive("lateral"),
        suction_vertical=suction.positive("vertical"),
        floor_time=entries.number("floor_time", 0.0),
    )
