# SPDX-License-Identifier: BSD-3-Clause
"""pydobotplus against the emulator."""

import session
from pydobotplus import Dobot
from pydobotplus.dobotplus import MODE_PTP
from pydobotplus.message import Message
from session import Session, check, until

FORCE_STOP = 242
DISTANCE_PULSES_PER_MM = 16000 / (3.141592653589793 * 34.0)  # what the client takes for 136
FULL_SPEED = 50.0  # mm/s
MODES = (MODE_PTP.JUMP_XYZ, MODE_PTP.MOVJ_XYZ, MODE_PTP.MOVL_XYZ)


def force_stop(arm: Dobot) -> None:
    """The client has no method of its own for it."""
    message = Message()
    message.id = FORCE_STOP
    message.ctrl = 0x01
    arm._send_command(message)


def main() -> None:
    """Every step in turn."""
    run = Session()
    with run.step("connect"):
        arm = Dobot(run.link)
    with run.step("home"):
        arm.wait_for_cmd(arm.home())
        run.check_at(arm.get_pose().position, session.HOME)
    with run.step("20 moves"):
        for i, goal in enumerate(session.MOVES):
            arm.move_to(*goal, mode=MODES[i % 3])
            run.check_at(arm.get_pose().position, goal)
    with run.step("suction"):
        for on in (True, False):
            arm.wait_for_cmd(arm.suck(on))
            check(run.state()["suction"] == on, f"suction is not {on}")
    with run.step("belt"):
        begin = run.state()["belt"][0]
        arm.conveyor_belt_distance(40.0, 50.0)
        until(lambda: run.state()["belt_speed"][0] == 0.0, "the belt's end")
        pulses = (run.state()["belt"][0] - begin) * session.PULSES_PER_MM
        check(abs(pulses - 50.0 * DISTANCE_PULSES_PER_MM) < 2.0, f"belt moved {pulses} pulses")
        arm.conveyor_belt(0.4)
        until(lambda: run.state()["belt"][0] > begin + 40.0, "the belt's motion")
        arm.conveyor_belt(0.0)
        check(run.state()["belt_speed"][0] == 0.0, "the belt does not stop")
    with run.step("infrared edge"):
        arm.set_ir(True, session.INFRARED_PORT)
        run.tell(f"cube {session.CUBE_AHEAD}")
        check(not arm.get_ir(session.INFRARED_PORT), "a cube is seen too early")
        arm.conveyor_belt(session.SLOW_BELT / FULL_SPEED)
        for seen in (True, False):
            until(lambda seen=seen: arm.get_ir(session.INFRARED_PORT) == seen, f"edge to {seen}")
        arm.conveyor_belt(0.0)
    with run.step("alarm"):
        arm.move_to(*session.BEYOND_REACH)
        codes = [int(alarm) for alarm in arm.get_alarms()]
        check(codes == [session.ALARM_BEYOND_REACH], f"alarms {codes}")
        arm.clear_alarms()
        check(not arm.get_alarms(), "alarms are not cleared")
        arm.move_to(*session.AFTER_ALARM)
        run.check_at(arm.get_pose().position, session.AFTER_ALARM)
    with run.step("force stop"):
        arm.move_to(*session.LEFT)
        arm.speed(10, 100)
        arm.move_to(*session.RIGHT, wait=False)
        until(run.on_its_way, "the move")
        force_stop(arm)
        run.check_between(session.LEFT, session.RIGHT)
        arm._set_queued_cmd_clear()
        arm._set_queued_cmd_start_exec()
        arm.speed(100, 100)
        arm.move_to(*session.LEFT)
        run.check_at(arm.get_pose().position, session.LEFT)
    arm.close()


if __name__ == "__main__":
    main()
