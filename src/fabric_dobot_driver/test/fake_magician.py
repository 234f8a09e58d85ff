# SPDX-License-Identifier: BSD-3-Clause
"""What the tests of the driver share: an arm in memory as a Link, with a clock of its own."""

import math
import struct
from pathlib import Path

from pydobotlab.alarms import encode_alarms
from pydobotlab.commands import CommandID as Id

from fabric_dobot_driver import ToolPose, inverse, load_limits, units
from fabric_dobot_driver.arm_device import ArmDevice
from fabric_dobot_driver.controller import Controller
from fabric_dobot_driver.conveyor_device import ConveyorDevice
from fabric_dobot_driver.events import ArmResult, ArmState, BeltState, Notice
from fabric_dobot_driver.limits import Goal
from fabric_dobot_driver.link import LinkLost, NoAnswer
from fabric_dobot_driver.settings import DriverSettings
from fabric_msgs.settings import settings_from

LIMITS = load_limits(Path(__file__).resolve().parents[1] / "config" / "magician.yaml")
START = ToolPose(0.220, 0.050, 0.060, 0.0)
EXCHANGE = 0.004  # s on the wire
UNREACHABLE, LOST_STEP, RESET = 0x11, 0x50, 0x00


class FakeMagician:
    """A Link with the arm at its other end. Time passes with every exchange, and by `wait`.

    frames: (time, command, params, write) of all that was heard. silent: answers to lose; missing:
    the port is gone; hurt: answers whose bytes are cut.
    """

    def __init__(self) -> None:
        self.now = 100.0
        self.frames: list[tuple[float, int, bytes, bool]] = []
        self.pose, self.speed = START, 0.1
        self.alarms: set[int] = set()
        self.queue: list[tuple[int, int, bytes]] = []
        self.running, self.index, self.done = False, 40, 40
        self.belt, self.infrared, self.sucks = 0, False, False
        self.home = ToolPose(0.25, 0.0, 0.05, 0.0)
        self.stuck = self.is_open = self.missing = False
        self.silent = self.hurt = self.opened = 0
        self.travelled = 0.0

    # -- the port -------------------------------------------------------------------------------

    def open(self) -> str:
        if self.missing:
            raise LinkLost("no such port")
        self.is_open = True
        self.opened += 1
        return "/dev/fake"

    def close(self) -> None:
        self.is_open = False

    def exchange(self, command: int, params: bytes, write: bool, queued: bool) -> bytes:
        if self.missing or not self.is_open:
            self.is_open = False
            raise LinkLost("the port is gone")
        self.frames.append((self.now, command, params, write))
        self.wait(EXCHANGE)
        answer = self._answer(command, params, write, queued)
        if self.silent > 0:
            self.silent -= 1
            self.wait(0.1)
            raise NoAnswer("silence")
        if self.hurt > 0:
            self.hurt -= 1
            return answer[:-1]
        return answer

    # -- the arm --------------------------------------------------------------------------------

    def wait(self, seconds: float) -> None:
        """Let time pass; the arm goes on with its queue."""
        self.now += seconds
        left = seconds
        while left > 0.0 and self.queue and self.running:
            index, command, params = self.queue[0]
            if self.alarms and command != Id.SET_HOME_CMD:
                return
            left = self._carry_out(command, params, left)
            if left >= 0.0:
                self.queue.pop(0)
                self.done = index

    def _carry_out(self, command: int, params: bytes, left: float) -> float:
        """Time that is left, negative while under way."""
        if command == Id.GET_SET_PTP_COORDINATE_PARAMS:
            self.speed = struct.unpack("<4f", params)[0] * 1e-3
        elif command == Id.GET_SET_HOME_PARAMS:
            self.home = units.pose_from_wire(*struct.unpack("<4f", params))
        elif command == Id.SET_HOME_CMD:
            return self._go(self.home, left)
        elif command == Id.SET_PTP_CMD:
            goal = units.pose_from_wire(*struct.unpack("<4f", params[1:17]))
            if inverse(goal) is None:
                self.alarms.add(UNREACHABLE)
                return left
            return self._go(goal, left)
        return left

    def _go(self, goal: ToolPose, left: float) -> float:
        distance = math.dist(self.pose[:3], goal[:3])
        reach = 0.0 if self.stuck else self.speed * left
        if distance <= reach or self.stuck:
            self.travelled += 0.0 if self.stuck else distance
            self.pose = self.pose if self.stuck else goal
            return left - min(left, distance / self.speed)
        self.travelled += reach
        self.pose = ToolPose(
            *(a + reach / distance * (b - a) for a, b in zip(self.pose, goal, strict=True))
        )
        return -1.0

    def _answer(self, command: int, params: bytes, write: bool, queued: bool) -> bytes:
        if queued:
            self.index += 1
            self.queue.append((self.index, command, params))
            return struct.pack("<Q", self.index)
        if write:
            self._obey(command, params)
            return b""
        return self._tell(command)

    def _obey(self, command: int, params: bytes) -> None:
        if command == Id.SET_QUEUED_CMD_FORCE_STOP_EXEC:
            self.running = False
            if self.queue:
                self.done = self.queue.pop(0)[0]
        elif command == Id.SET_QUEUED_CMD_CLEAR:
            self.queue.clear()
        elif command == Id.SET_QUEUED_CMD_START_EXEC:
            self.running = True
        elif command == Id.CLEAR_ALL_ALARMS_STATE:
            self.alarms.clear()
        elif command == Id.SET_E_MOTOR:
            self.belt = struct.unpack("<BBi", params)[2]
        elif command == Id.GET_SET_END_EFFECTOR_SUCTION_CUP:
            self.sucks = params == b"\x01\x01"

    def _tell(self, command: int) -> bytes:
        if command == Id.GET_POSE:
            joints = units.joints_to_wire(inverse(self.pose))
            return struct.pack("<8f", *units.pose_to_wire(self.pose), *joints)
        if command == Id.GET_ALARMS_STATE:
            return encode_alarms(self.alarms)
        if command == Id.GET_QUEUED_CMD_CURRENT_INDEX:
            return struct.pack("<Q", self.done)
        if command == Id.GET_SET_INFRARED_SENSOR:
            return bytes([self.infrared])
        return b""

    def sent(self, command: int) -> list[float]:
        """When this command was heard."""
        return [time for time, heard, _, _ in self.frames if heard == command]


class Bench:
    """The driver on a fake arm, driven by hand: every exchange, no thread, no waiting."""

    def __init__(self, **settings: float) -> None:
        self.fake = FakeMagician()
        self.settings = settings_from(DriverSettings, settings)
        self.told: list[object] = []
        self.alive = True  # the motion node
        clock, tell = lambda: self.fake.now, self.told.append
        self.arm = ArmDevice(LIMITS, self.settings, clock, tell)
        self.belt = ConveyorDevice(self.settings, clock, tell)
        self.controller = Controller(self.fake, self.arm, self.belt, self.settings, tell, clock)

    @classmethod
    def homed(cls, **settings: float) -> "Bench":
        """A bench whose arm is connected and at home."""
        bench = cls(**settings)
        bench.until(lambda: bench.arm.connected)
        assert bench.arm.home() == ""
        bench.until(lambda: bench.arm.homed)
        return bench

    @property
    def results(self) -> list[ArmResult]:
        return [told for told in self.told if isinstance(told, ArmResult)]

    @property
    def states(self) -> list[ArmState]:
        return [told for told in self.told if isinstance(told, ArmState)]

    @property
    def belts(self) -> list[BeltState]:
        return [told for told in self.told if isinstance(told, BeltState)]

    @property
    def words(self) -> list[str]:
        return [told.text for told in self.told if isinstance(told, Notice)]

    def go(self, x: float, y: float, z: float, number: int = 1, **rest: float) -> None:
        """Send the arm there at 0.1 m/s unless told otherwise."""
        goal = {"speed": 0.1, "settle": 0.0, **rest}
        self.arm.move(number, Goal(ToolPose(x, y, z, 0.0), **goal))

    def step(self) -> None:
        """One exchange, or the wait for the next one; the motion node beats meanwhile."""
        if self.alive:
            self.arm.beat()
        delay = self.controller.step()
        self.fake.wait(min(delay, 0.05))

    def run(self, seconds: float) -> None:
        """Let time pass."""
        end = self.fake.now + seconds
        while self.fake.now < end:
            self.step()

    def until(self, condition, limit: float = 30.0) -> None:
        """Let time pass until it is so."""
        end = self.fake.now + limit
        while not condition():
            assert self.fake.now < end, f"not so within {limit} s; told: {self.words}"
            self.step()

    def end(self, number: int = 1) -> ArmResult:
        """The result of that goal."""
        self.until(lambda: any(result.number == number for result in self.results))
        return next(result for result in self.results if result.number == number)
