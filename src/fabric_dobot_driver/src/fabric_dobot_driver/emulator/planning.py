# SPDX-License-Identifier: BSD-3-Clause
"""What the arm makes of a motion command: a motion in time, or an alarm."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from fabric_dobot_driver.emulator import commands
from fabric_dobot_driver.emulator.alarms import Alarm
from fabric_dobot_driver.emulator.arc import arc_through
from fabric_dobot_driver.emulator.geometry import Geometry, Values
from fabric_dobot_driver.emulator.motion import (
    LINE_STEP,
    TURN_STEP,
    JointWay,
    Motion,
    SpaceWay,
    Trapezoid,
    mix,
    overspeed,
)
from fabric_dobot_driver.emulator.settings import Settings

JUMP_XYZ, MOVJ_XYZ, MOVL_XYZ, JUMP_ANGLE, MOVJ_ANGLE, MOVL_ANGLE = range(6)
MOVJ_INC, MOVL_INC, MOVJ_XYZ_INC, JUMP_MOVL_XYZ = range(6, 10)
JUMPS = (JUMP_XYZ, JUMP_ANGLE, JUMP_MOVL_XYZ)
LINES = (MOVL_XYZ, MOVL_ANGLE, MOVL_INC)
ANGLES = (JUMP_ANGLE, MOVJ_ANGLE, MOVL_ANGLE)
HOME_WAY = ((0.2, 10.0, 30.0), (0.4, 10.0, 30.0))  # shares of the time; j2, j3 in deg
LONGEST_CURVE = 5000.0  # mm; none within reach is longer
LARGEST_TURN = 720.0  # deg
HOME_SWITCH = 0.9  # of the limit of j1, where its switch is


class PlanError(Exception):
    """The command cannot be carried out."""

    def __init__(self, alarm: int) -> None:
        super().__init__(f"alarm {alarm:#x}")
        self.alarm = alarm


@dataclass(frozen=True)
class Planner:
    """Plans from the registers as they are when the command gets its turn."""

    settings: Settings
    geometry: Geometry
    registers: Callable[[int], tuple]

    def ptp(self, start: Values, mode: int, values: Values) -> Motion:
        """Motion of a PTP command from these joint angles.

        Raises PlanError when there is none.
        """
        if not 0 <= mode <= JUMP_MOVL_XYZ:
            raise PlanError(Alarm.MOTION_TYPE)
        end = self._goal(start, mode, values)
        if mode in JUMPS:
            return self._jump(start, end, linear=mode == JUMP_MOVL_XYZ)
        if mode in LINES:
            return self.line(start, self.geometry.pose(end))
        return Motion([self._joint_way(start, end)])

    def home(self, start: Values, pose: Values) -> Motion:
        """Up, to the switch of the base, and to the home position: always equally long."""
        end = self._checked(self.geometry.joints(pose))
        switch = HOME_SWITCH * self.geometry.high[0]
        stations = [(start[0], *HOME_WAY[0][1:], start[3]), (switch, *HOME_WAY[1][1:], 0.0), end]
        shares = [share for share, *_ in HOME_WAY]
        shares.append(1.0 - sum(shares))
        ways = []
        for station, share in zip(stations, shares, strict=True):
            ways.append(
                JointWay(start, station, Trapezoid.lasting(share * self.settings.home_time))
            )
            start = station
        return Motion(ways)

    def line(self, start: Values, pose: Values, speed: float | None = None) -> Motion:
        """A straight line of the tool, at the PTP coordinate speed or another one in mm/s."""
        begin = self.geometry.pose(start)
        limits = self._coordinate_limits() if speed is None else self._path_limits(speed)
        length = math.dist(begin[:3], pose[:3])
        profile = Trapezoid.over((length, pose[3] - begin[3]), *limits)
        return self.curve(lambda s: mix(begin, pose, s), length, profile, Alarm.LINE_OUT_OF_SPACE)

    def continuous(
        self, start: Values, absolute: int, place: Values, speed: float | None = None
    ) -> Motion:
        """One segment of a continuous path, from rest to rest; corners are not rounded."""
        x, y, z, r = self.geometry.pose(start)
        if not absolute:
            place = _add((x, y, z), place)
        return self.line(start, (*place, r), speed or self.registers(commands.CP_PARAMS)[1])

    def arc(self, start: Values, via: Values, end: Values) -> Motion:
        """An arc of a circle over `via` to `end`, both x, y, z, r."""
        found = arc_through(self.geometry.pose(start), via, end)
        if found is None:
            raise PlanError(Alarm.ARC_PARAMETERS)
        pose, length, turn = found
        values = self.registers(commands.ARC_PARAMS)
        speed, acceleration = self._ratio()
        speeds = tuple(speed * value for value in values[:2])
        accelerations = tuple(acceleration * value for value in values[2:])
        _check_speeds((1.0, 1.0), speeds, accelerations)
        profile = Trapezoid.over((length, turn), speeds, accelerations)
        return self.curve(pose, length, profile, Alarm.ARC_OUT_OF_SPACE)

    @staticmethod
    def prolonged(motion: Motion, duration: float) -> Motion:
        """The motion, and standing at its end until this many s have passed."""
        rest = duration - motion.duration
        if rest <= 0.0 or motion.alarm is not None:
            return motion
        end = motion.at(math.inf)
        return motion._replace(ways=[*motion.ways, JointWay(end, end, Trapezoid.lasting(rest))])

    def curve(
        self, pose: Callable[[float], Values], length: float, profile: Trapezoid, alarm: Alarm
    ) -> Motion:
        """The tool along a curve of this length in mm; `alarm` when it leaves the space."""
        self._checked(self.geometry.joints(pose(1.0)))
        turn = abs(pose(1.0)[3] - pose(0.0)[3])
        if length > LONGEST_CURVE or turn > LARGEST_TURN:
            raise PlanError(alarm)
        steps = max(2, math.ceil(max(length / LINE_STEP, turn / TURN_STEP)))
        points = [self.geometry.joints(pose(i / steps)) for i in range(steps + 1)]
        if any(self.geometry.fault(point) is not None for point in points[1:]):
            raise PlanError(alarm)
        way = SpaceWay(pose, self.geometry, profile)
        trip = overspeed(way, points, self.settings.fastest_joint)
        if trip is None:
            return Motion([way])
        return Motion([way], Alarm.OVERSPEED + trip[1], trip[0])

    def _goal(self, start: Values, mode: int, values: Values) -> Values:
        if mode in ANGLES:
            return self._checked(values)
        if mode == MOVJ_INC:
            return self._checked(_add(start, values))
        if mode in (MOVL_INC, MOVJ_XYZ_INC):
            values = _add(self.geometry.pose(start), values)
        return self._checked(self.geometry.joints(values))

    def _checked(self, joints: Values | None) -> Values:
        fault = self.geometry.fault(joints)
        if fault is not None:
            raise PlanError(fault)
        return joints

    def _jump(self, start: Values, end: Values, linear: bool) -> Motion:
        """Up by the jump height over the higher end, level, down."""
        height, highest = self.registers(commands.PTP_JUMP)
        begin, goal = self.geometry.pose(start), self.geometry.pose(end)
        top = min(max(begin[2], goal[2]) + height, highest)
        if height < 0.0 or top < max(begin[2], goal[2]):
            raise PlanError(Alarm.JUMP_PARAMETERS)
        above = (*goal[:2], top, goal[3])
        up = self.line(start, (*begin[:2], top, begin[3]))
        lifted = up.at(math.inf)
        if linear:
            level = self.line(lifted, above)
        else:
            level = Motion([self._joint_way(lifted, self._checked(self.geometry.joints(above)))])
        down = self.line(level.at(math.inf), goal)
        return _chain(up, level, down)

    def _joint_way(self, start: Values, end: Values) -> JointWay:
        values = self.registers(commands.PTP_JOINT)
        speed, acceleration = self._ratio()
        fastest = self.settings.fastest_joint
        speeds = tuple(min(v * speed, most) for v, most in zip(values[:4], fastest, strict=True))
        strongest = self.settings.strongest_joint
        accelerations = tuple(min(a * acceleration, strongest) for a in values[4:])
        lengths = tuple(b - a for a, b in zip(start, end, strict=True))
        _check_speeds(lengths, speeds, accelerations)
        return JointWay(start, end, Trapezoid.over(lengths, speeds, accelerations))

    def _coordinate_limits(self) -> tuple[Values, Values]:
        line_speed, turn_speed, line_acceleration, turn_acceleration = self.registers(
            commands.PTP_COORDINATE
        )
        speed, acceleration = self._ratio()
        s = self.settings
        speeds = (min(speed * line_speed, s.fastest_line), speed * turn_speed)
        accelerations = (
            min(acceleration * line_acceleration, s.strongest_line),
            min(acceleration * turn_acceleration, s.strongest_joint),
        )
        _check_speeds((1.0, 1.0), speeds, accelerations)
        return speeds, accelerations

    def _path_limits(self, speed: float) -> tuple[Values, Values]:
        acceleration = self.registers(commands.CP_PARAMS)[0]
        _check_speeds((1.0,), (speed,), (acceleration,))
        line = min(speed, self.settings.fastest_line)
        return (line, line), (acceleration, acceleration)

    def _ratio(self) -> tuple[float, float]:
        speed, acceleration = self.registers(commands.PTP_RATIO)
        return min(speed, 100.0) / 100.0, min(acceleration, 100.0) / 100.0


def _add(values: Values, change: Values) -> Values:
    return tuple(a + b for a, b in zip(values, change, strict=True))


def _check_speeds(lengths: Values, speeds: Values, accelerations: Values) -> None:
    for length, speed, acceleration in zip(lengths, speeds, accelerations, strict=True):
        if length and not (speed > 0.0 and acceleration > 0.0):
            raise PlanError(Alarm.SPEED_PARAMETERS)


def _chain(*motions: Motion) -> Motion:
    """One after the other, up to the first that an alarm cuts short."""
    ways, passed = [], 0.0
    for motion in motions:
        ways += motion.ways
        if motion.alarm is not None:
            return Motion(ways, motion.alarm, passed + motion.alarm_after)
        passed += motion.duration
    return Motion(ways)
