# SPDX-License-Identifier: BSD-3-Clause
"""The command table: what may be written and read under each id, and what registers hold at first.

Where the printed protocol and code that drives real arms disagree, the code wins: alarms are
cleared by writing id 20, the extension stepper takes whole pulses a second, sensors are read
with their port as parameter.
"""

import math
import struct
from enum import Enum
from typing import NamedTuple


class Kind(Enum):
    """What a write does."""

    NOTHING = "cannot be written"
    REGISTER = "is stored and read back"
    ACT = "acts at once and is done"
    MOVE = "moves the arm"
    WAIT = "holds the queue"
    CONTROL = "controls the queue or the alarms; never queued itself"


class Command(NamedTuple):
    """One row: floats f, integers B H I i of `struct`, little-endian."""

    name: str
    kind: Kind
    layout: str = ""  # parameters of a write
    least: int | None = None  # bytes that are enough: the rest is 0
    readable: bool = True
    address: int = 0  # leading bytes of a read that say which one
    start: tuple[float, ...] = ()  # what a register holds at power-up

    @property
    def size(self) -> int:
        """Bytes of a write."""
        return struct.calcsize("<" + self.layout)

    def is_write(self, control: int) -> bool:
        """True for the write or queued bit; what has no read form is always written."""
        return self.kind is not Kind.NOTHING and (bool(control & 0b11) or not self.readable)

    def unpack(self, params: bytes) -> tuple | None:
        """Values of a write; None when bytes are missing or a float is no finite number."""
        least = self.size if self.least is None else self.least
        if len(params) < least:
            return None
        values = struct.unpack_from("<" + self.layout, params.ljust(self.size, b"\0"))
        return values if all(map(math.isfinite, values)) else None

    def pack(self, values: tuple) -> bytes:
        """Parameters that say these values."""
        return struct.pack("<" + self.layout, *values)


def _only_read(name: str, address: int = 0) -> Command:
    return Command(name, Kind.NOTHING, address=address)


def _register(name: str, layout: str, *start: float, address: int = 0, **more: int) -> Command:
    return Command(name, Kind.REGISTER, layout, start=start, address=address, **more)


def _do(name: str, kind: Kind, layout: str = "", **more: int) -> Command:
    return Command(name, kind, layout, readable=False, **more)


DEVICE_SN, DEVICE_NAME, DEVICE_VERSION, RAIL, DEVICE_TIME, DEVICE_ID = range(6)
POSE, RESET_POSE, RAIL_POSE = 10, 11, 13
ALARMS, ALARMS_AS_PRINTED = 20, 21
HOME_PARAMS, HOME = 30, 31
TOOL, LASER, SUCTION, GRIPPER = 60, 61, 62, 63
JOG_JOINT, JOG_COORDINATE, JOG_RATIO, JOG = 70, 71, 72, 73
PTP_JOINT, PTP_COORDINATE, PTP_JUMP, PTP_RATIO, PTP, PTP_RAIL_PARAMS, PTP_RAIL = range(80, 87)
CP_PARAMS, CP, CP_LASER = 90, 91, 92
ARC_PARAMS, ARC = 100, 101
WAIT, TRIGGER = 110, 120
MULTIPLEX, DIGITAL_OUT, PWM, DIGITAL_IN, ANALOG_IN = range(130, 135)
STEPPER, STEPPER_DISTANCE, COLOUR, INFRARED = range(135, 139)
LOST_STEP_PARAMS, LOST_STEP = 170, 171
START, STOP, FORCE_STOP, DOWNLOAD_START, DOWNLOAD_STOP, CLEAR, INDEX, SPACE = range(240, 248)

TABLE: dict[int, Command] = {
    DEVICE_SN: _only_read("device serial number"),
    DEVICE_NAME: Command("device name", Kind.ACT, "", least=0),
    DEVICE_VERSION: _only_read("device version"),
    RAIL: _register("rail fitted", "BB", 0, 0, least=1),
    DEVICE_TIME: _only_read("device time"),
    DEVICE_ID: _only_read("device id"),
    POSE: _only_read("pose"),
    RESET_POSE: _do("reset pose", Kind.ACT, "Bff"),
    RAIL_POSE: _only_read("rail pose"),
    ALARMS: Command("alarms", Kind.CONTROL),
    ALARMS_AS_PRINTED: _do("clear alarms as printed", Kind.CONTROL),
    HOME_PARAMS: _register("home position", "4f", 259.1041, 0.0, -8.4853, 0.0),
    HOME: _do("home", Kind.MOVE, "I", least=0),
    40: _register("hand-hold trigger mode", "B", 0),
    41: _register("hand-hold trigger enabled", "B", 0),
    42: _only_read("hand-hold trigger"),
    50: _register("arm orientation", "B", 0),
    TOOL: _register("tool offset", "3f", 59.7, 0.0, 0.0),
    LASER: _register("laser", "BB", 0, 0),
    SUCTION: _register("suction cup", "BB", 0, 0),
    GRIPPER: _register("gripper", "BB", 0, 0),
    JOG_JOINT: _register("jog joint params", "8f", *[30.0] * 4, *[100.0] * 4),
    JOG_COORDINATE: _register("jog coordinate params", "8f", *[60.0] * 4, *[100.0] * 4),
    JOG_RATIO: _register("jog ratio", "2f", 50.0, 50.0),
    JOG: _do("jog", Kind.ACT, "BB"),
    74: _register("jog rail params", "2f", 60.0, 60.0),
    PTP_JOINT: _register("PTP joint params", "8f", *[200.0] * 8),
    PTP_COORDINATE: _register("PTP coordinate params", "4f", *[200.0] * 4),
    PTP_JUMP: _register("PTP jump params", "2f", 20.0, 100.0),
    PTP_RATIO: _register("PTP ratio", "2f", 50.0, 50.0),
    PTP: _do("PTP", Kind.MOVE, "B4f"),
    PTP_RAIL_PARAMS: _register("PTP rail params", "2f", 60.0, 60.0),
    PTP_RAIL: _do("PTP with rail", Kind.MOVE, "B5f"),
    87: _register("PTP jump 2 params", "3f", 20.0, 20.0, 100.0),
    CP_PARAMS: _register("CP params", "3fB", 100.0, 50.0, 100.0, 0),
    CP: _do("CP", Kind.MOVE, "B4f", least=14),
    CP_LASER: _do("CP with laser", Kind.MOVE, "B4f"),
    ARC_PARAMS: _register("arc params", "4f", *[200.0] * 4),
    ARC: _do("arc", Kind.MOVE, "8f"),
    WAIT: _do("wait", Kind.WAIT, "I"),
    TRIGGER: _do("wait for a trigger", Kind.WAIT, "BBBH"),
    MULTIPLEX: _register("I/O multiplex", "BB", 0, address=1),
    DIGITAL_OUT: _register("digital output", "BB", 0, address=1),
    PWM: _register("PWM", "Bff", 0.0, 0.0, address=1),
    DIGITAL_IN: _only_read("digital input", address=1),
    ANALOG_IN: _only_read("analog input", address=1),
    STEPPER: _do("stepper", Kind.ACT, "BBi"),
    STEPPER_DISTANCE: _do("stepper by distance", Kind.ACT, "BBiI"),
    COLOUR: Command("colour sensor", Kind.ACT, "BBB", least=2),
    INFRARED: Command("infrared sensor", Kind.ACT, "BBB", least=2, address=1),
    LOST_STEP_PARAMS: _register("lost-step threshold", "f", 5.0),
    LOST_STEP: _do("lost-step check", Kind.ACT),
    START: _do("queue start", Kind.CONTROL),
    STOP: _do("queue stop", Kind.CONTROL),
    FORCE_STOP: _do("queue force stop", Kind.CONTROL),
    DOWNLOAD_START: _do("download start", Kind.CONTROL, "II", least=0),
    DOWNLOAD_STOP: _do("download stop", Kind.CONTROL),
    CLEAR: _do("queue clear", Kind.CONTROL),
    INDEX: _only_read("queue index"),
    SPACE: _only_read("queue left space"),
}


def name_of(command_id: int) -> str:
    """Name of a command, for logs."""
    return TABLE[command_id].name if command_id in TABLE else f"unknown {command_id}"
