# SPDX-License-Identifier: BSD-3-Clause
"""The arm's state machine over a fake link: goals, refusals, stops, lease, alarms, lost answers."""

import math

import pytest
from fake_magician import LOST_STEP, RESET, START, UNREACHABLE, Bench
from pydobotlab.commands import CommandID as Id

from fabric_msgs.msg import MoveArmResult

STOP, CLEAR, RUN = Id.SET_QUEUED_CMD_FORCE_STOP_EXEC, Id.SET_QUEUED_CMD_CLEAR, 240
FAR = (0.197, -0.200, 0.060)


def commands(bench: Bench, since: int = 0) -> list[int]:
    return [command for _, command, _, _ in bench.fake.frames[since:]]


def moved(bench: Bench) -> bool:
    return bench.fake.pose != START


# -- goals ----------------------------------------------------------------------------------------


def test_a_goal_is_reached_and_told_once():
    bench = Bench.homed()
    bench.go(0.24, 0.05, 0.10, speed=0.2)
    assert bench.end().outcome == MoveArmResult.REACHED
    assert bench.fake.pose[:3] == pytest.approx((0.24, 0.05, 0.10), abs=1e-6)
    bench.run(1.0)
    assert len(bench.results) == 1


def test_the_speed_on_the_wire_is_in_millimetres_and_told_when_it_changes():
    bench = Bench.homed()
    for number, x in enumerate((0.20, 0.21, 0.22), start=1):
        bench.go(x, 0.05, 0.10, number, speed=0.2)
        bench.end(number)
    assert bench.fake.speed == pytest.approx(0.2)
    assert len(bench.fake.sent(Id.GET_SET_PTP_COORDINATE_PARAMS)) == 1


def test_feedback_says_how_far_it_is():
    bench = Bench.homed()
    bench.go(*FAR)
    bench.end()
    way = [state.remaining for state in bench.states if state.number == 1]
    assert way[0] > 0.15
    assert all(a >= b for a, b in zip(way, way[1:], strict=False))
    assert way[-1] < 0.01


def test_settling_counts_from_the_arrival():
    bench = Bench.homed()
    bench.go(0.24, 0.05, 0.10, settle=0.5)
    bench.until(lambda: bench.fake.pose.z == pytest.approx(0.10))
    arrived = bench.fake.now
    assert bench.end().outcome == MoveArmResult.REACHED
    assert 0.5 <= bench.fake.now - arrived < 0.6


def test_a_new_goal_displaces_the_running_one_after_a_stop():
    bench = Bench.homed()
    bench.go(*FAR)
    bench.until(lambda: bench.arm.moving == 1)
    bench.run(0.5)
    since = len(bench.fake.frames)
    bench.go(0.24, 0.05, 0.10, number=2)
    assert bench.end(2).outcome == MoveArmResult.REACHED
    assert bench.results[0] == (1, MoveArmResult.PRE_EMPTED, "goal 2 came")
    assert commands(bench, since)[:4] == [STOP, CLEAR, Id.GET_POSE, RUN]


@pytest.mark.parametrize(
    ("place", "rest", "outcome", "words"),
    [
        ((math.nan, 0.0, 0.1), {}, MoveArmResult.INVALID, "x is nan"),
        ((0.24, 0.0, 0.1), {"speed": math.inf}, MoveArmResult.INVALID, "speed is inf"),
        ((0.24, 0.0, 0.1), {"speed": 9.0}, MoveArmResult.INVALID, "speed is 9 m/s"),
        ((0.24, 0.0, 0.1), {"settle": -1.0}, MoveArmResult.INVALID, "settle is -1 s"),
        ((0.9, 0.0, 0.1), {}, MoveArmResult.INVALID, "allowed box"),
        ((0.28, 0.0, -0.05), {}, MoveArmResult.INVALID, "the belt's body"),
        ((0.34, 0.0, 0.24), {}, MoveArmResult.UNREACHABLE, "out of the arm's reach"),
        ((-0.15, 0.2, 0.1), {}, MoveArmResult.UNREACHABLE, "deg, limits"),
    ],
)
def test_a_bad_goal_is_refused_before_the_wire(place, rest, outcome, words):
    bench = Bench.homed()
    bench.go(*place, **rest)
    result = bench.end()
    assert result.outcome == outcome
    assert words in result.reason
    assert not bench.fake.sent(Id.SET_PTP_CMD)


def test_a_line_that_leaves_the_reach_is_refused():
    bench = Bench.homed()
    bench.go(0.0, -0.28, 0.06, number=1)
    bench.end(1)
    bench.go(0.0, 0.28, 0.06, number=2)
    assert "the straight line is blocked" in bench.end(2).reason


# -- homing ---------------------------------------------------------------------------------------


def test_nothing_moves_before_homing():
    bench = Bench()
    bench.until(lambda: bench.arm.connected)
    bench.go(0.24, 0.05, 0.10)
    result = bench.end()
    assert result.outcome == MoveArmResult.ARM_FAULT
    assert "call arm/home" in result.reason
    assert not moved(bench)


def test_the_first_frame_on_an_opened_port_stops_the_arm():
    bench = Bench()
    bench.until(lambda: bench.arm.connected)
    assert commands(bench)[:2] == [STOP, CLEAR]


def test_homing_ends_at_the_home_pose_of_the_cell():
    bench = Bench.homed()
    assert bench.fake.pose[:3] == pytest.approx((0.197, -0.001, 0.035), abs=1e-6)
    assert "the arm is homed" in bench.words


def test_goals_are_refused_while_homing():
    bench = Bench()
    bench.until(lambda: bench.arm.connected)
    bench.arm.home()
    bench.until(lambda: bench.arm.moving == 0)
    bench.go(0.24, 0.05, 0.10)
    assert bench.end().reason == "the arm is homing"
    bench.until(lambda: bench.arm.homed)


def test_homing_clears_the_alarms_that_it_cures():
    bench = Bench()
    bench.fake.alarms = {RESET}
    bench.until(lambda: bench.arm.connected)
    bench.arm.home()
    bench.until(lambda: bench.arm.homed)
    assert not bench.fake.alarms


def test_a_stopped_homing_leaves_the_arm_unhomed():
    bench = Bench()
    bench.until(lambda: bench.arm.connected)
    bench.arm.home()
    bench.until(lambda: bench.arm.moving == 0 and moved(bench))
    bench.arm.halt("somebody pressed stop")
    bench.run(0.2)
    assert not bench.arm.homed
    assert bench.arm.moving is None
    assert any("homing was stopped: somebody pressed stop" in text for text in bench.words)


# -- stops ----------------------------------------------------------------------------------------


def test_a_cancelled_goal_stops_at_once_and_the_pose_is_read_anew():
    bench = Bench.homed()
    bench.go(*FAR)
    bench.until(lambda: bench.arm.moving == 1)
    bench.run(0.5)
    since, asked = len(bench.fake.frames), bench.fake.now
    bench.arm.cancel(1)
    assert bench.end() == (1, MoveArmResult.PRE_EMPTED, "cancelled")
    assert commands(bench, since)[:4] == [STOP, CLEAR, Id.GET_POSE, RUN]
    assert bench.fake.sent(STOP)[-1] - asked <= 0.004
    stands = bench.fake.pose
    bench.run(2.0)
    assert bench.fake.pose == stands
    assert bench.states[-1].pose[:3] == pytest.approx(stands[:3], abs=1e-6)


def test_a_stop_waits_for_one_exchange_at_most_whatever_else_is_due():
    bench = Bench.homed(pose_rate=100.0, alarm_rate=50.0, infrared_rate=100.0, index_rate=100.0)
    bench.go(*FAR)
    bench.until(lambda: bench.arm.moving == 1)
    bench.run(0.3)
    bench.belt.run(0.05, False)
    bench.arm.cancel(1)
    since = len(bench.fake.frames)
    bench.step()
    assert commands(bench, since) == [STOP]


def test_a_lost_answer_to_the_stop_is_asked_again():
    bench = Bench.homed()
    bench.go(*FAR)
    bench.until(lambda: bench.arm.moving == 1)
    bench.run(0.3)
    bench.fake.silent = 1
    since = len(bench.fake.frames)
    bench.arm.cancel(1)
    assert bench.end().outcome == MoveArmResult.PRE_EMPTED
    assert commands(bench, since)[:3] == [STOP, STOP, CLEAR]


def test_a_goal_cancelled_before_it_began_never_moves():
    bench = Bench.homed()
    before = bench.fake.pose
    bench.go(*FAR)
    bench.arm.cancel(1)
    assert bench.end() == (1, MoveArmResult.PRE_EMPTED, "cancelled")
    bench.run(1.0)
    assert bench.fake.pose == before


def test_a_late_cancellation_does_not_touch_the_next_goal():
    bench = Bench.homed()
    bench.go(*FAR)
    bench.until(lambda: bench.arm.moving == 1)
    bench.go(0.24, 0.05, 0.10, number=2)
    bench.until(lambda: bench.arm.moving == 2)
    bench.arm.cancel(1)
    assert bench.end(2).outcome == MoveArmResult.REACHED


# -- lease ----------------------------------------------------------------------------------------


def test_the_arm_holds_by_itself_when_the_heartbeat_lapses():
    bench = Bench.homed()
    bench.go(*FAR)
    bench.until(lambda: bench.arm.moving == 1)
    bench.run(0.3)
    bench.alive, silent_since = False, bench.fake.now
    result = bench.end()
    assert result.outcome == MoveArmResult.ARM_FAULT
    assert "no heartbeat of the motion node for more than 0.3 s" in result.reason
    assert 0.25 < bench.fake.sent(STOP)[-1] - silent_since < 0.35


def test_nothing_moves_after_a_lapse_until_heartbeat_and_a_new_goal():
    bench = Bench.homed()
    bench.go(*FAR)
    bench.until(lambda: bench.arm.moving == 1)
    bench.run(0.3)
    bench.alive = False
    bench.end()
    stands = bench.fake.pose
    bench.go(*FAR, number=2)
    assert bench.end(2).reason == "no heartbeat of the motion node"
    bench.alive = True
    bench.run(2.0)
    assert bench.fake.pose == stands
    bench.go(*FAR, number=3)
    assert bench.end(3).outcome == MoveArmResult.REACHED


# -- alarms ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("code", "outcome", "name"),
    [
        (UNREACHABLE, MoveArmResult.UNREACHABLE, "PLAN_INVERSE_CALCULATION"),
        (0x30, MoveArmResult.ARM_FAULT, "OVERSPEED_J1"),
        (0x4A, MoveArmResult.ARM_FAULT, "LIMIT_0x4A"),
    ],
)
def test_an_alarm_ends_the_goal_by_name(code, outcome, name):
    bench = Bench.homed()
    bench.go(*FAR)
    bench.until(lambda: bench.arm.moving == 1)
    bench.run(0.3)
    bench.fake.alarms = {code}
    result = bench.end()
    assert (result.outcome, result.reason) == (outcome, f"alarm {name}")


def test_nothing_moves_while_an_alarm_is_set_nor_by_itself_when_it_is_cleared():
    bench = Bench.homed()
    bench.go(*FAR)
    bench.until(lambda: bench.arm.moving == 1)
    bench.run(0.3)
    bench.fake.alarms = {UNREACHABLE}
    bench.end()
    stands = bench.fake.pose
    bench.go(*FAR, number=2)
    assert "call arm/clear_alarms" in bench.end(2).reason
    cleared = bench.controller.ask(bench.arm.clear_alarms)
    bench.until(cleared.done)
    bench.run(2.0)
    assert bench.fake.pose == stands
    bench.go(*FAR, number=3)
    assert bench.end(3).outcome == MoveArmResult.REACHED


def test_lost_steps_cost_the_reference():
    bench = Bench.homed()
    bench.fake.alarms = {LOST_STEP}
    bench.run(0.3)
    bench.until(bench.controller.ask(bench.arm.clear_alarms).done)
    bench.go(*FAR)
    assert "call arm/home" in bench.end().reason


def test_an_arm_that_stands_before_the_goal_has_not_reached_it():
    bench = Bench.homed()
    bench.fake.stuck = True
    bench.go(*FAR)
    result = bench.end()
    assert result.outcome == MoveArmResult.ARM_FAULT
    assert "mm before the goal" in result.reason


def test_a_queue_index_beyond_all_issued_is_not_taken_for_done():
    bench = Bench.homed()
    bench.go(*FAR)
    bench.until(lambda: bench.arm.moving == 1)
    bench.fake.done = 2**64 - 1
    bench.run(0.5)
    assert not bench.results
    assert bench.end().outcome == MoveArmResult.REACHED


# -- a bad line -----------------------------------------------------------------------------------


def test_a_lost_answer_is_asked_for_again():
    bench = Bench.homed()
    bench.go(*FAR)
    for _ in range(10):
        bench.fake.silent = 2
        bench.run(0.4)
    assert bench.arm.connected
    assert bench.controller.answers_lost == 20
    assert bench.end().outcome == MoveArmResult.REACHED


def test_damaged_answers_are_not_believed():
    bench = Bench.homed()
    bench.go(*FAR)
    for _ in range(20):
        bench.fake.hurt = 2
        bench.run(0.1)
    assert bench.end().outcome == MoveArmResult.REACHED


def test_an_arm_that_falls_silent_is_reported_within_a_second():
    bench = Bench.homed()
    bench.go(*FAR)
    bench.until(lambda: bench.arm.moving == 1)
    bench.fake.silent, since = 10**6, bench.fake.now
    result = bench.end()
    assert bench.fake.now - since < 1.0
    assert result.outcome == MoveArmResult.ARM_FAULT
    assert "does not answer" in result.reason


def test_an_unplugged_arm_is_reported_and_nothing_moves_when_it_is_back():
    bench = Bench.homed()
    bench.go(*FAR)
    bench.until(lambda: bench.arm.moving == 1)
    bench.run(0.3)
    bench.fake.missing, since = True, bench.fake.now
    result = bench.end()
    assert bench.fake.now - since < 0.1
    assert result == (1, MoveArmResult.ARM_FAULT, "the port is gone")
    bench.run(0.5)
    bench.go(*FAR, number=2)
    assert bench.end(2).reason == "the arm is not connected"
    bench.fake.missing = False
    bench.until(lambda: bench.arm.connected)
    stands = bench.fake.travelled
    bench.go(*FAR, number=3)
    assert "call arm/home" in bench.end(3).reason
    bench.run(3.0)
    assert bench.fake.travelled == stands
    bench.arm.home()
    bench.until(lambda: bench.arm.homed)
    bench.go(*FAR, number=4)
    assert bench.end(4).outcome == MoveArmResult.REACHED


def test_a_missing_port_is_tried_again_without_a_storm():
    bench = Bench(reconnect=1.0)
    bench.fake.missing = True
    bench.run(5.0)
    assert bench.controller.trouble == "no such port"
    assert bench.words == ["no such port"]
    bench.fake.missing = False
    bench.until(lambda: bench.arm.connected, limit=1.5)


def test_a_command_to_an_arm_that_is_gone_is_refused_at_once():
    bench = Bench()
    bench.fake.missing = True
    bench.run(0.1)
    assert bench.arm.home() == "the arm is not connected"
    assert bench.controller.ask(lambda wire: wire.suction(True)).result(0) == (
        "the arm is not connected"
    )


# -- suction --------------------------------------------------------------------------------------


def test_suction_acts_at_once_while_the_arm_moves():
    bench = Bench.homed()
    bench.go(*FAR)
    bench.until(lambda: bench.arm.moving == 1)
    asked = bench.controller.ask(lambda wire: wire.suction(True))
    bench.step()
    bench.until(asked.done, limit=0.1)
    assert asked.result() == ""
    assert bench.fake.sucks
    assert bench.arm.moving == 1


def test_a_command_that_nobody_waits_for_any_more_does_not_happen():
    bench = Bench.homed()
    asked = bench.controller.ask(lambda wire: wire.suction(True))
    assert asked.cancel()
    bench.run(0.5)
    assert not bench.fake.sucks


def test_commands_under_way_are_answered_when_the_arm_goes():
    bench = Bench.homed()
    bench.fake.missing = True
    asked = [bench.controller.ask(lambda wire: wire.suction(True)) for _ in range(3)]
    asked[1].cancel()
    bench.until(asked[2].done)
    assert asked[0].result() == asked[2].result() == "the port is gone"
    bench.fake.missing = False
    bench.until(lambda: bench.arm.connected)
    bench.run(0.5)
    assert not bench.fake.sucks
