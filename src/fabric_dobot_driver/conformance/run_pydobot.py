# SPDX-License-Identifier: BSD-3-Clause
"""pydobot against the emulator.

It computes checksums modulo 255: frames whose bytes add up to 0 or 1 modulo 256 are wrong, and
are dropped by the emulator as by the arm. Every frame is looked at before it is sent.
"""

import struct

import session
from pydobot import Dobot
from pydobot.enums.CommunicationProtocolIDs import CommunicationProtocolIDs as Ids
from pydobot.message import Message
from session import Session, check, until

CLEAR_ALARMS, STEPPER, STEPPER_DISTANCE, INFRARED, FORCE_STOP = 20, 135, 136, 138, 242
READ, WRITE, QUEUED = 0, 1, 3


class Checked(Dobot):
    """The client, refusing its own wrong frames by name."""

    def _send_message(self, msg) -> None:
        frame = msg.bytes()
        check(sum(frame[3:]) % 256 == 0, f"the client spoils the checksum of {frame.hex()}")
        super()._send_message(msg)

    def _read_message(self):
        # The client gives an answer 0.1 s and takes None otherwise. That is enough for an arm,
        # and not always for an emulator on a busy machine.
        until(lambda: self.ser.in_waiting > 0, "an answer")
        return super()._read_message()

    def ask(self, command: int, control: int, params: bytes = b"") -> bytes:
        """Parameters of the answer; for what the client has no method of its own."""
        message = Message()
        message.id, message.ctrl, message.params = command, control, bytearray(params)
        return bytes(self._send_command(message).params)

    def belt(self, speed: float, distance: float | None = None) -> None:
        """Drives at mm/s, for so many mm or on and on."""
        pulses = round(speed * session.PULSES_PER_MM)
        if distance is None:
            self.ask(STEPPER, QUEUED, struct.pack("<BBi", 0, 1, pulses))
        else:
            count = round(distance * session.PULSES_PER_MM)
            self.ask(STEPPER_DISTANCE, QUEUED, struct.pack("<BBiI", 0, 1, pulses, count))

    def seen(self) -> int:
        """What the infrared sensor says."""
        return self.ask(INFRARED, READ, bytes((session.INFRARED_PORT,)))[0]

    def alarms(self) -> list[int]:
        """Codes of the alarms that are set."""
        bits = int.from_bytes(self.ask(Ids.GET_ALARMS_STATE.value, READ), "little")
        return [code for code in range(128) if bits >> code & 1]


def main() -> None:
    """Every step in turn."""
    run = Session()
    with run.step("connect"):
        arm = Checked(run.link)
    with run.step("home"):
        (index,) = struct.unpack("<Q", arm.ask(Ids.SET_HOME_CMD.value, QUEUED, bytes(4)))
        until(lambda: arm._get_queued_cmd_current_index() == index, "the end of homing")
        run.check_at(arm.pose(), session.HOME)
    with run.step("20 moves"):
        for goal in session.MOVES:
            arm.move_to(*goal, wait=True)
            run.check_at(arm.pose(), goal)
    with run.step("suction"):
        for on in (True, False):
            arm.suck(on)
            check(run.state()["suction"] == on, f"suction is not {on}")
    with run.step("belt"):
        begin = run.state()["belt"][0]
        arm.belt(40.0, 50.0)
        until(lambda: run.state()["belt_speed"][0] == 0.0, "the belt's end")
        moved = run.state()["belt"][0] - begin
        check(abs(moved - 50.0) < 0.01, f"belt moved {moved} mm")
        arm.belt(20.0)
        until(lambda: run.state()["belt"][0] > begin + 60.0, "the belt's motion")
        arm.belt(0.0)
        check(run.state()["belt_speed"][0] == 0.0, "the belt does not stop")
    with run.step("infrared edge"):
        arm.ask(INFRARED, QUEUED, bytes((1, session.INFRARED_PORT, 1)))
        run.tell(f"cube {session.CUBE_AHEAD}")
        check(arm.seen() == 0, "a cube is seen too early")
        arm.belt(session.SLOW_BELT)
        for seen in (1, 0):
            until(lambda seen=seen: arm.seen() == seen, f"edge to {seen}")
        arm.belt(0.0)
    with run.step("alarm"):
        arm.move_to(*session.BEYOND_REACH, wait=True)
        check(arm.alarms() == [session.ALARM_BEYOND_REACH], f"alarms {arm.alarms()}")
        arm.ask(CLEAR_ALARMS, WRITE)
        check(not arm.alarms(), "alarms are not cleared")
        arm.move_to(*session.AFTER_ALARM, wait=True)
        run.check_at(arm.pose(), session.AFTER_ALARM)
    with run.step("force stop"):
        arm.move_to(*session.LEFT, wait=True)
        arm.speed(10, 100)
        arm.move_to(*session.RIGHT)
        until(run.on_its_way, "the move")
        arm.ask(FORCE_STOP, WRITE)
        run.check_between(session.LEFT, session.RIGHT)
        arm._set_queued_cmd_clear()
        arm._set_queued_cmd_start_exec()
        arm.speed(100, 100)
        arm.move_to(*session.LEFT, wait=True)
        run.check_at(arm.pose(), session.LEFT)
    arm.close()


if __name__ == "__main__":
    main()
