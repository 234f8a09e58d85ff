# SPDX-License-Identifier: BSD-3-Clause
"""The requests that the cell needs, in SI units; every answer is checked before it is believed."""

import math
import struct

from pydobotlab.commands import CommandID
from pydobotlab.protocol import CTRL_RW, PTPMode, pack, pack_floats, pack_u8, pack_u32

from fabric_dobot_driver import units
from fabric_dobot_driver.alarms import AlarmSet, decode_alarms
from fabric_dobot_driver.kinematics import Joints, ToolPose
from fabric_dobot_driver.link import Link, NoAnswer

FULL = 100.0  # percent of the speeds that are set
CLOSE = 1000.0  # mm; the arm is nowhere farther out than that
JUMP = 1000  # indices; a queue does not skip more of them


class Wire:
    """Requests to the arm's controller over a Link. All raise NoAnswer and LinkLost.

    last_index: of the newest queued command since the queue was cleared, None without one.
    """

    def __init__(self, link: Link) -> None:
        self._link = link
        self.last_index: int | None = None

    # -- looks ----------------------------------------------------------------------------------

    def pose(self) -> tuple[ToolPose, Joints]:
        """Where the tool is, m and rad in arm_base_link, and the joints, rad."""
        values = struct.unpack("<8f", self._read(CommandID.GET_POSE, 32))
        if not all(math.isfinite(value) and abs(value) < CLOSE for value in values):
            raise NoAnswer(f"the pose is told as {values}")
        return units.pose_from_wire(*values[:4]), units.joints_from_wire(*values[4:])

    def alarms(self) -> AlarmSet:
        """The alarms that are set."""
        return decode_alarms(self._read(CommandID.GET_ALARMS_STATE, 16))

    def current_index(self) -> int:
        """Index of the queued command that was finished last, or is under way."""
        (index,) = struct.unpack("<Q", self._read(CommandID.GET_QUEUED_CMD_CURRENT_INDEX, 8))
        return index

    def finished(self, index: int) -> bool:
        """Whether the queued command of that index is done.

        An arm that has finished nothing yet may tell a number beyond all that were issued.
        """
        return self.last_index is not None and index <= self.current_index() <= self.last_index

    def infrared(self, port: int) -> bool:
        """Whether something stands in front of the sensor."""
        return self._read(CommandID.GET_SET_INFRARED_SENSOR, 1, pack_u8(port))[0] != 0

    # -- at once --------------------------------------------------------------------------------

    def force_stop(self) -> None:
        """Abort the motion; the queue is not executed any more."""
        self._write(CommandID.SET_QUEUED_CMD_FORCE_STOP_EXEC)

    def clear_queue(self) -> None:
        """Forget what is queued."""
        self._write(CommandID.SET_QUEUED_CMD_CLEAR)
        self.last_index = None

    def start_queue(self) -> None:
        """Execute what is queued."""
        self._write(CommandID.SET_QUEUED_CMD_START_EXEC)

    def clear_alarms(self) -> None:
        """Clear the alarms whose cause is gone."""
        self._write(CommandID.CLEAR_ALL_ALARMS_STATE)

    def suction(self, on: bool) -> None:
        """Suck, or let go."""
        self._write(CommandID.GET_SET_END_EFFECTOR_SUCTION_CUP, pack_u8(1, int(on)))

    def belt(self, stepper: int, pulses: int) -> None:
        """Run the belt's motor at so many pulses a second."""
        self._write(CommandID.SET_E_MOTOR, _belt(stepper, pulses))

    def enable_infrared(self, port: int, version: int) -> None:
        """Switch the sensor on."""
        self._write(CommandID.GET_SET_INFRARED_SENSOR, pack_u8(1, port, version))

    def tool(self, x: float, y: float, z: float) -> None:
        """Tell the arm where its tool is, m from the wrist."""
        params = pack_floats(1e3 * x, 1e3 * y, 1e3 * z)
        self._write(CommandID.GET_SET_END_EFFECTOR_PARAMS, params)

    # -- queued: each returns its index ---------------------------------------------------------

    def full_ratio(self) -> int:
        """Let speeds and accelerations count as they are set."""
        return self._queue(CommandID.GET_SET_PTP_COMMON_PARAMS, pack_floats(FULL, FULL))

    def profile(
        self, speed: float, acceleration: float, yaw_speed: float, yaw_acceleration: float
    ) -> int:
        """Speeds of the moves that follow: m/s, m/s^2, rad/s, rad/s^2."""
        line, turn = 1e3 * speed, math.degrees(yaw_speed)
        ramp, turn_ramp = 1e3 * acceleration, math.degrees(yaw_acceleration)
        params = pack_floats(line, turn, ramp, turn_ramp)
        return self._queue(CommandID.GET_SET_PTP_COORDINATE_PARAMS, params)

    def move(self, pose: ToolPose) -> int:
        """Move the tool along a straight line."""
        params = pack_u8(PTPMode.MOVL_XYZ) + pack_floats(*units.pose_to_wire(pose))
        return self._queue(CommandID.SET_PTP_CMD, params)

    def home_pose(self, pose: ToolPose) -> int:
        """Tell the arm where homing is to end."""
        params = pack_floats(*units.pose_to_wire(pose))
        return self._queue(CommandID.GET_SET_HOME_PARAMS, params)

    def home(self) -> int:
        """Find the reference of every joint, then go to the home pose."""
        return self._queue(CommandID.SET_HOME_CMD, pack_u32(0))

    # -- bytes ----------------------------------------------------------------------------------

    def _read(self, command: CommandID, size: int, params: bytes = b"") -> bytes:
        answer = self._link.exchange(command, params, write=False, queued=False)
        if len(answer) < size:
            raise NoAnswer(f"{command.name} is answered with {len(answer)} of {size} bytes")
        return answer[:size]

    def _write(self, command: CommandID, params: bytes = b"") -> None:
        self._link.exchange(command, params, write=True, queued=False)

    def _queue(self, command: CommandID, params: bytes) -> int:
        answer = self._link.exchange(command, params, write=True, queued=True)
        if len(answer) < 8:
            raise NoAnswer(f"{command.name} is answered with {len(answer)} of 8 bytes")
        (index,) = struct.unpack("<Q", answer[:8])
        last = self.last_index
        if last is not None and not last < index <= last + JUMP:
            raise NoAnswer(f"{command.name} got index {index} after {last}")
        self.last_index = index
        return index


def hold_frames(stepper: int) -> bytes:
    """Frames for whoever cannot wait for answers: arm holds, queue empty, belt stands.

    The suction stays as it is: what hangs at the cup is not to fall.
    """
    return (
        pack(CommandID.SET_QUEUED_CMD_FORCE_STOP_EXEC, CTRL_RW)
        + pack(CommandID.SET_E_MOTOR, CTRL_RW, _belt(stepper, 0))
        + pack(CommandID.SET_QUEUED_CMD_CLEAR, CTRL_RW)
    )


def _belt(stepper: int, pulses: int) -> bytes:
    return struct.pack("<BBi", stepper, int(pulses != 0), pulses)
