# SPDX-License-Identifier: BSD-3-Clause
"""The arm's firmware: answers frames, runs the queue, raises alarms.

Time is an argument of whatever depends on it, in s, and must not run backwards.
"""

import math
import struct
from collections.abc import Callable

from fabric_dobot_driver.emulator import commands
from fabric_dobot_driver.emulator.alarms import check, to_wire
from fabric_dobot_driver.emulator.arm import Arm
from fabric_dobot_driver.emulator.commands import TABLE, Command, Kind
from fabric_dobot_driver.emulator.extension import Extension
from fabric_dobot_driver.emulator.frames import Frame
from fabric_dobot_driver.emulator.geometry import Geometry, Values
from fabric_dobot_driver.emulator.jog import Jog
from fabric_dobot_driver.emulator.motion import Motion
from fabric_dobot_driver.emulator.planning import PlanError, Planner
from fabric_dobot_driver.emulator.queue import Entry, Queue
from fabric_dobot_driver.emulator.settings import Settings
from fabric_dobot_driver.limits import load_limits

Tell = Callable[..., None]
QUEUED_ANSWER = struct.Struct("<Q")
LARGEST_FLOAT = 3.4e38
LONGEST_NAME = 64


class Controller:
    """One virtual Magician. `tell` is called with a word and details of what happens."""

    def __init__(self, settings: Settings | None = None, tell: Tell | None = None) -> None:
        self.settings = settings or Settings()
        self._limits = load_limits(self.settings.limits_file)
        self._tell = tell or (lambda event, **details: None)
        self.time = 0.0
        self.extension = Extension(self.settings)
        self._acts = {
            commands.RESET_POSE: self._reset_pose,
            commands.JOG: self._jog,
            commands.STEPPER: self._stepper,
            commands.STEPPER_DISTANCE: self._stepper,
            commands.COLOUR: self._switch_colour,
            commands.INFRARED: self._switch_infrared,
            commands.LOST_STEP: lambda: None,
        }
        self.power_up()

    def power_up(self) -> None:
        """Everything as after switching on: it has forgotten all of before."""
        links = self._limits.links
        self._start_time = self.time
        self.alarms: set[int] = set()
        self.arm = Arm(self.settings.power_up)
        self.queue = Queue(self.settings.queue_length)
        self.extension = self.extension.switched_on(self.time)
        self.homed = False
        self.device_name = b"Magician"
        self._homing = False
        self._wait_end = math.inf
        self._seen = False
        self._registers: dict[tuple[int, int], tuple] = {}
        tool = tuple(1e3 * offset for offset in (links.tool_x, links.tool_y, links.tool_z))
        self._store(commands.TOOL, tool)

    # --- time ---

    def advance(self, now: float) -> None:
        """Lets everything happen that happens up to this time."""
        while (event := min(self.arm.end, self._wait_end)) <= now:
            self._pass(max(event, self.time))
        self._pass(now)

    @property
    def busy(self) -> bool:
        """True while anything moves or waits by itself."""
        turning = any(stepper.speed for stepper in self.extension.steppers)
        return self.arm.moving or turning or self.queue.executing is not None

    def _pass(self, now: float) -> None:
        self.time = now
        self.extension.advance(now)
        moved = self.arm.moving
        alarm = self.arm.advance(now)
        if alarm is not None:
            self.raise_alarm(alarm)
        if moved and not self.arm.moving:
            self._stands(arrived=alarm is None)
        if now >= self._wait_end:
            self._wait_end = math.inf
        self._finish()
        self._run_queue()
        if self.extension.seen() != self._seen:
            self._seen = not self._seen
            self._tell("infrared", seen=self._seen)

    def _stands(self, arrived: bool) -> None:
        if self._homing and arrived:
            self.homed = True
        self._homing = False
        self._tell("stands", joints=self.joints, pose=self.pose)

    # --- state ---

    @property
    def joints(self) -> Values:
        """Joint angles in deg."""
        return self.arm.joints(self.time)

    @property
    def pose(self) -> Values:
        """x, y, z in mm and r in deg."""
        return self.geometry.pose(self.joints)

    def register(self, command_id: int, address: int = 0) -> tuple:
        """What a register holds."""
        return self._registers.get((command_id, address), TABLE[command_id].start)

    def raise_alarm(self, code: int) -> None:
        """Sets the alarm and stops the arm, unless it is homing.

        Raises ValueError when the arm has no such alarm.
        """
        self.alarms.add(check(code))
        self._tell("alarm", code=int(code))
        if not self._homing:
            self._halt()

    # --- frames ---

    def handle(self, frame: Frame, now: float) -> Frame | None:
        """The answer; None to what the arm does not know or what is malformed."""
        self.advance(now)
        command = TABLE.get(frame.id)
        if command is None:
            return None
        if command.is_write(frame.control):
            params = self._write(command, frame)
        else:
            params = self._read(frame.id, frame.params)
        return None if params is None else Frame(frame.id, frame.control, params)

    def _write(self, command: Command, frame: Frame) -> bytes | None:
        if command.kind is Kind.CONTROL:
            self._control(frame.id)
            return b""
        if command.unpack(frame.params) is None:
            return None
        if frame.queued:
            index = self.queue.push(frame.id, frame.params)
            self._run_queue()
            return None if index is None else QUEUED_ANSWER.pack(index)
        self._execute_at_once(command, frame)
        return b""

    def _read(self, command_id: int, params: bytes) -> bytes | None:
        command = TABLE[command_id]
        if len(params) < command.address:
            return None
        address = params[0] if command.address else 0
        if command.kind is Kind.REGISTER:
            values = self.register(command_id, address)
            if command.address:
                values = (address, *values)
            return command.pack(values)[: 1 if command_id == commands.RAIL else None]
        return self._report(command_id, address)

    def _report(self, command_id: int, address: int) -> bytes:
        outside = self.extension
        match command_id:
            case commands.POSE:
                return _floats(*self.pose, *self.joints)
            case commands.ALARMS:
                return to_wire(self.alarms)
            case commands.INDEX:
                return QUEUED_ANSWER.pack(self.queue.finished)
            case commands.SPACE:
                return struct.pack("<I", self.queue.space)
            case commands.INFRARED:
                return bytes((outside.infrared(address),))
            case commands.COLOUR:
                return bytes(outside.colour())
            case commands.DIGITAL_IN:
                return bytes((address, outside.levels.get(address, 0)))
            case commands.ANALOG_IN:
                return struct.pack("<BH", address, outside.voltages.get(address, 0))
            case commands.RAIL_POSE:
                return _floats(outside.rail.at(self.time))
            case commands.DEVICE_SN:
                return self.settings.serial_number.encode() + b"\0"
            case commands.DEVICE_NAME:
                return self.device_name + b"\0"
            case commands.DEVICE_VERSION:
                return bytes(self.settings.version)
            case commands.DEVICE_TIME:
                return struct.pack("<I", int(1e3 * (self.time - self._start_time)) & 0xFFFFFFFF)
            case commands.DEVICE_ID:
                return struct.pack("<3I", 0, 0, 1)
            case _:
                return b"\0"

    # --- queue ---

    def _control(self, command_id: int) -> None:
        match command_id:
            case commands.START:
                self.queue.running = True
            case commands.STOP:
                self.queue.running = False
            case commands.FORCE_STOP:
                self.queue.running = False
                self._halt()
                self.queue.finish()
                self._wait_end = math.inf
            case commands.CLEAR:
                self.queue.clear()
            case commands.ALARMS | commands.ALARMS_AS_PRINTED:
                self.alarms.clear()
        self._run_queue()

    def _run_queue(self) -> None:
        while self._may_begin():
            entry = self.queue.begin()
            self._execute(TABLE[entry.id], entry.id, entry.params)
            self._finish()

    def _may_begin(self) -> bool:
        queue, head = self.queue, self.queue.head()
        if not queue.running or queue.executing is not None or head is None:
            return False
        if self.alarms and head.id != commands.HOME:
            return False
        return TABLE[head.id].kind is not Kind.MOVE or not self.arm.moving

    def _finish(self) -> None:
        """Marks the entry in execution as finished when it is."""
        entry = self.queue.executing
        if entry is None:
            return
        kind = TABLE[entry.id].kind
        under_way = kind is Kind.MOVE and self.arm.moving
        waiting = kind is Kind.WAIT and not self._waited(entry)
        if not under_way and not waiting:
            self.queue.finish()

    def _waited(self, entry: Entry) -> bool:
        if entry.id == commands.WAIT:
            return math.isinf(self._wait_end)
        address, analogue, condition, threshold = TABLE[entry.id].unpack(entry.params)
        if analogue:
            value = self.extension.voltages.get(address, 0)
            tests = (value < threshold, value <= threshold, value >= threshold, value > threshold)
            return condition < len(tests) and tests[condition]
        return (self.extension.levels.get(address, 0) != threshold) == bool(condition)

    # --- execution ---

    def _execute_at_once(self, command: Command, frame: Frame) -> None:
        if command.kind is Kind.MOVE:
            self._halt()
            self._finish()
        if command.kind is not Kind.WAIT:
            self._execute(command, frame.id, frame.params)

    def _execute(self, command: Command, command_id: int, params: bytes) -> None:
        values = command.unpack(params)
        match command.kind:
            case Kind.REGISTER:
                self._store(command_id, values)
            case Kind.MOVE:
                self._move(command_id, values)
            case Kind.WAIT if command_id == commands.WAIT:
                self._wait_end = self.time + 1e-3 * values[0]
            case Kind.ACT if command_id == commands.DEVICE_NAME:
                self.device_name = params[:LONGEST_NAME].rstrip(b"\0")
            case Kind.ACT:
                self._acts[command_id](*values)

    def _store(self, command_id: int, values: tuple) -> None:
        address = values[0] if TABLE[command_id].address else 0
        self._registers[command_id, address] = values[TABLE[command_id].address :]
        if command_id == commands.TOOL:
            self.geometry = Geometry.of(self._limits).with_tool(*values)
        if command_id in (commands.SUCTION, commands.GRIPPER):
            self._tell(TABLE[command_id].name, on=values == (1, 1), pose=self.pose)

    def _move(self, command_id: int, values: tuple) -> None:
        planner = Planner(self.settings, self.geometry, self.register)
        try:
            motion = self._plan(planner, command_id, values)
        except PlanError as error:
            self.raise_alarm(error.alarm)
            return
        self.arm.start(motion, self.time)
        self._homing = command_id == commands.HOME
        self._tell("moves", command=TABLE[command_id].name, duration=round(motion.duration, 6))

    def _plan(self, planner: Planner, command_id: int, values: tuple) -> Motion:
        start = self.joints
        match command_id:
            case commands.HOME:
                return planner.home(start, self.register(commands.HOME_PARAMS))
            case commands.PTP:
                return planner.ptp(start, values[0], values[1:])
            case commands.PTP_RAIL:
                motion = planner.ptp(start, values[0], values[1:5])
                speed, acceleration = self.register(commands.PTP_RAIL_PARAMS)
                end = self.extension.rail.drive(values[5], speed, acceleration, self.time)
                return planner.prolonged(motion, end - self.time)
            case commands.ARC:
                return planner.arc(start, values[:4], values[4:])
            case commands.CP:
                return planner.continuous(start, values[0], values[1:4], values[4])
            case _:
                return planner.continuous(start, values[0], values[1:4])

    def _halt(self) -> None:
        if self.arm.moving:
            self.arm.halt(self.time)
            self.extension.rail.halt(self.time)
            self._stands(arrived=False)

    def _jog(self, joint: int, command: int) -> None:
        if command == 0:
            if self.arm.jog is not None:
                self.arm.jog.stop()
            return
        if command > 8 or (self.arm.moving and self.arm.jog is None):
            return
        place = (command - 1) // 2
        values = self.register(commands.JOG_JOINT if joint else commands.JOG_COORDINATE)
        ratios = self.register(commands.JOG_RATIO)
        speed, acceleration = (0.01 * min(ratio, 100.0) for ratio in ratios)
        jog = Jog(self.time, self.joints, command, bool(joint), self.geometry)
        jog.drive(max(0.0, values[place] * speed), max(0.0, values[4 + place] * acceleration))
        self.arm.start_jog(jog, self.time)

    def _reset_pose(self, manual: int, rear: float, front: float) -> None:
        if manual and not self.arm.moving:
            j1, _, _, j4 = self.joints
            if self.geometry.fault((j1, rear, front, j4)) is None:
                self.arm.set_joints((j1, rear, front, j4))

    def _stepper(self, index: int, enable: int, speed: int, distance: float = math.inf) -> None:
        if index < len(self.extension.steppers):
            wanted = speed if enable else 0
            self.extension.steppers[index].drive(wanted, self.time, distance)
            self._tell("stepper", index=index, speed=wanted)

    def _switch_colour(self, enable: int, port: int, _version: int) -> None:
        _switch(self.extension.colour_on, port, enable)

    def _switch_infrared(self, enable: int, port: int, _version: int) -> None:
        _switch(self.extension.infrared_on, port, enable)


def _switch(ports: set[int], port: int, enable: int) -> None:
    (ports.add if enable else ports.discard)(port)


def _floats(*values: float) -> bytes:
    """As the wire has them; a tool longer than any number on it shows as the largest one."""
    cut = (max(-LARGEST_FLOAT, min(LARGEST_FLOAT, value)) for value in values)
    return struct.pack(f"<{len(values)}f", *cut)
