# SPDX-License-Identifier: BSD-3-Clause
"""pydobotlab against the emulator."""

import struct

import session
from pydobotlab import Magician
from pydobotlab.commands import CommandID
from pydobotlab.errors import DobotAlarmError
from session import Session, check, until

BELT = 0  # Stepper1
MOVL = 2


def belt_by_distance(arm: Magician, speed: float, distance: float) -> None:
    """Drives so many mm at mm/s; the client has no method of its own for it."""
    pulses = [round(value * session.PULSES_PER_MM) for value in (speed, distance)]
    arm.execute_command(CommandID.SET_E_MOTOR_S, struct.pack("<BBiI", BELT, 1, *pulses))


def main() -> None:
    """Every step in turn."""
    run = Session()
    arm = Magician(run.link, require_panel=False, via_broker=False, verbose=False)
    with run.step("connect"):
        arm.connect()
    with run.step("home"):
        arm.set_home()
        run.check_at(arm.get_pose().as_xyzr(), session.HOME)
    arm.motion_params = 100, 100
    with run.step("20 moves"):
        for i, goal in enumerate(session.MOVES):
            arm.ptp(i % 3, *goal)
            run.check_at(arm.get_pose().as_xyzr(), goal)
    with run.step("suction"):
        for on in (True, False):
            arm.set_endeffector_suctioncup(True, on)
            check(run.state()["suction"] == on, f"suction is not {on}")
    with run.step("belt"):
        begin = run.state()["belt"][0]
        belt_by_distance(arm, 40.0, 50.0)
        until(lambda: run.state()["belt_speed"][0] == 0.0, "the belt's end")
        moved = run.state()["belt"][0] - begin
        check(abs(moved - 50.0) < 0.01, f"belt moved {moved} mm")
        arm.set_converyor(BELT, True, 20.0 * session.PULSES_PER_MM)
        until(lambda: run.state()["belt"][0] > begin + 60.0, "the belt's motion")
        arm.set_converyor(BELT, False, 0)
        check(run.state()["belt_speed"][0] == 0.0, "the belt does not stop")
    with run.step("infrared edge"):
        arm.set_infrared_sensor(session.INFRARED_PORT, True)
        run.tell(f"cube {session.CUBE_AHEAD}")
        check(arm.get_infrared_sensor(session.INFRARED_PORT) == 0, "a cube is seen too early")
        arm.set_converyor(BELT, True, session.SLOW_BELT * session.PULSES_PER_MM)
        for seen in (1, 0):
            until(
                lambda seen=seen: arm.get_infrared_sensor(session.INFRARED_PORT) == seen,
                f"edge to {seen}",
            )
        arm.set_converyor(BELT, False, 0)
    with run.step("alarm"):
        try:
            arm.ptp(MOVL, *session.BEYOND_REACH)
            raise AssertionError("no alarm")
        except DobotAlarmError:
            check(session.ALARM_BEYOND_REACH in run.state()["alarms"], "another alarm")
        arm.clear_alarm()
        arm.ptp(MOVL, *session.AFTER_ALARM)
        run.check_at(arm.get_pose().as_xyzr(), session.AFTER_ALARM)
    with run.step("force stop"):
        arm.ptp(MOVL, *session.LEFT)
        arm.motion_params = 5, 100
        arm.move_to(*session.RIGHT, wait=False)
        until(run.on_its_way, "the move")
        arm.force_stop_queue()
        run.check_between(session.LEFT, session.RIGHT)
        arm.clear_queue()
        arm.start_queue()
        arm.motion_params = 100, 100
        arm.ptp(MOVL, *session.LEFT)
        run.check_at(arm.get_pose().as_xyzr(), session.LEFT)
    arm.disconnect()


if __name__ == "__main__":
    main()
