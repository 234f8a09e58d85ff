# SPDX-License-Identifier: BSD-3-Clause
"""The emulated firmware: queue, alarms, homing, jog, ports; all in virtual time."""

import math
import struct

import pytest
from virtual_arm import QUEUED, READ, WRITE, VirtualArm

from fabric_dobot_driver.emulator import commands
from fabric_dobot_driver.emulator.commands import Kind
from fabric_dobot_driver.emulator.planning import MOVJ_ANGLE, MOVJ_XYZ, MOVL_XYZ
from fabric_dobot_driver.emulator.settings import Settings

HERE, THERE = (200.0, 80.0, 30.0, 0.0), (200.0, -80.0, 30.0, 0.0)
BEYOND_REACH = (500.0, 0.0, 0.0, 0.0)
BELT, PORT = 0, 2
PER_MM = 282.94


@pytest.fixture
def arm() -> VirtualArm:
    """Stands at HERE."""
    arm = VirtualArm()
    arm.ptp(MOVJ_XYZ, *HERE)
    arm.run(10.0)
    assert arm.is_at(*HERE)
    return arm


# --- queue ---


def test_indices_are_counted_and_commands_run_one_after_the_other(arm):
    first = arm.ptp(MOVL_XYZ, *THERE)
    assert [arm.ptp(MOVL_XYZ, *goal) for goal in (HERE, THERE)] == [first + 1, first + 2]
    assert arm.index == first - 1
    seen = set()
    while arm.index < first + 2:
        seen.add(arm.index)
        arm.run(0.05)
    assert seen == {first - 1, first, first + 1}
    assert arm.is_at(*THERE)


def test_a_stopped_queue_ends_its_command_and_begins_no_other(arm):
    first = arm.ptp(MOVL_XYZ, *THERE)
    arm.ptp(MOVL_XYZ, *HERE)
    arm.run(0.3)
    arm.control(commands.STOP)
    arm.run(20.0)
    assert arm.index == first
    assert arm.is_at(*THERE)
    arm.control(commands.START)
    arm.run(20.0)
    assert arm.is_at(*HERE)


def test_force_stop_stands_at_once_finishes_its_command_and_holds_the_queue(arm):
    first = arm.ptp(MOVL_XYZ, *THERE)
    arm.ptp(MOVL_XYZ, *HERE)
    arm.run(0.7)
    before = arm.pose
    arm.control(commands.FORCE_STOP)
    assert arm.pose == before
    assert arm.index == first
    arm.run(20.0)
    assert arm.pose == before
    assert THERE[1] + 1.0 < before[1] < HERE[1] - 1.0
    arm.control(commands.CLEAR)
    arm.control(commands.START)
    arm.run(20.0)
    assert arm.pose == before


def test_force_stop_ends_a_wait_and_a_jog(arm):
    arm.put(commands.WAIT, 60000)
    arm.put(commands.JOG, 0, 3, control=WRITE)
    arm.run(0.5)
    arm.control(commands.FORCE_STOP)
    before = arm.pose
    arm.run(5.0)
    assert arm.pose == before
    assert arm.index == 2


def test_clear_drops_what_waits_and_never_turns_the_index_back(arm):
    first = arm.ptp(MOVL_XYZ, *THERE)
    arm.ptp(MOVL_XYZ, *HERE)
    arm.control(commands.CLEAR)
    arm.run(20.0)
    assert arm.is_at(*THERE)
    assert arm.index == first
    assert arm.ptp(MOVL_XYZ, *HERE) == first + 2


def test_the_index_stays_readable_until_the_next_command_is_done(arm):
    index = arm.put(commands.SUCTION, 1, 1)
    for _ in range(3):
        arm.run(1.0)
        assert arm.index == index


def test_a_full_queue_takes_nothing_more_and_does_not_answer():
    arm = VirtualArm(Settings(queue_length=3))
    arm.control(commands.STOP)
    for left in (3, 2, 1):
        assert arm.space == left
        arm.put(commands.WAIT, 1000)
    assert arm.space == 0
    assert arm.ask(commands.WAIT, QUEUED, struct.pack("<I", 5)) is None
    arm.control(commands.START)
    arm.run(1.5)
    assert arm.space == 1


def test_a_wait_holds_the_queue_for_its_time(arm):
    arm.put(commands.WAIT, 2500)
    index = arm.put(commands.SUCTION, 1, 1)
    arm.run(2.4)
    assert arm.index < index
    arm.run(0.2)
    assert arm.index == index


@pytest.mark.parametrize(
    ("trigger", "before", "after"),
    [
        ((5, 0, 0, 1), ("levels", 0), ("levels", 1)),
        ((5, 0, 1, 0), ("levels", 0), ("levels", 1)),
        ((5, 1, 0, 100), ("voltages", 100), ("voltages", 99)),
        ((5, 1, 3, 100), ("voltages", 100), ("voltages", 101)),
    ],
)
def test_a_trigger_holds_the_queue_until_its_input_changes(arm, trigger, before, after):
    outside = arm.controller.extension
    getattr(outside, before[0])[5] = before[1]
    index = arm.put(commands.TRIGGER, *trigger)
    arm.run(5.0)
    assert arm.index < index
    getattr(outside, after[0])[5] = after[1]
    arm.run(0.01)
    assert arm.index == index


def test_writes_at_once_overtake_the_queue_even_when_it_is_stopped(arm):
    arm.control(commands.STOP)
    arm.put(commands.SUCTION, 0, 0)
    assert arm.put(commands.SUCTION, 1, 1, control=WRITE) is None
    assert arm.ask(commands.SUCTION, READ) == b"\x01\x01"


def test_a_motion_at_once_replaces_the_one_under_way(arm):
    index = arm.ptp(MOVL_XYZ, *THERE)
    arm.run(0.5)
    assert arm.put(commands.PTP, MOVL_XYZ, *HERE, control=WRITE) is None
    assert arm.index == index
    arm.run(10.0)
    assert arm.is_at(*HERE)


# --- alarms and homing ---


@pytest.mark.parametrize(
    ("mode", "values", "alarm"),
    [
        (MOVL_XYZ, BEYOND_REACH, 0x11),
        (MOVJ_XYZ, (200.0, 0.0, 30.0, 170.0), 0x12),
        (MOVJ_ANGLE, (0.0, -20.0, 40.0, 0.0), 0x12),
        (MOVJ_ANGLE, (0.0, 0.0, 80.0, 0.0), 0x12),
        (10, HERE, 0x19),
    ],
)
def test_what_cannot_be_reached_is_an_alarm_without_motion(arm, mode, values, alarm):
    index = arm.ptp(mode, *values)
    arm.run(0.0)
    assert arm.alarms == {alarm}
    assert arm.index == index
    assert arm.is_at(*HERE)


def test_a_line_that_leaves_the_space_between_its_ends_is_an_alarm(arm):
    arm.ptp(MOVJ_ANGLE, 110.0, 40.0, 50.0, 0.0)
    arm.run(10.0)
    goal = arm.controller.geometry.pose((-110.0, 40.0, 50.0, 0.0))
    arm.ptp(MOVL_XYZ, *goal)
    arm.run(10.0)
    assert arm.alarms == {0x17}
    assert arm.joints[0] == pytest.approx(110.0, abs=1e-4)


def test_a_jump_that_would_have_to_go_down_first_is_an_alarm(arm):
    arm.put(commands.PTP_JUMP, 20.0, 10.0)
    arm.ptp(0, *THERE)
    arm.run(1.0)
    assert arm.alarms == {0x15}


@pytest.mark.parametrize("speed", [0.0, -5.0])
def test_speeds_that_are_none_are_an_alarm(arm, speed):
    arm.put(commands.PTP_COORDINATE, speed, 100.0, 100.0, 100.0)
    arm.ptp(MOVL_XYZ, *THERE)
    arm.run(1.0)
    assert arm.alarms == {0x1A}


def test_the_queue_does_not_run_while_there_is_an_alarm(arm):
    arm.ptp(MOVL_XYZ, *BEYOND_REACH)
    blocked = arm.put(commands.SUCTION, 1, 1)
    arm.run(10.0)
    assert arm.index == blocked - 1
    arm.control(commands.ALARMS)
    assert arm.alarms == set()
    assert arm.index == blocked


@pytest.mark.parametrize("command", [commands.ALARMS, commands.ALARMS_AS_PRINTED])
def test_alarms_are_cleared_by_the_id_that_works_and_by_the_printed_one(arm, command):
    arm.ptp(MOVL_XYZ, *BEYOND_REACH)
    arm.control(command)
    assert arm.alarms == set()


def test_an_alarm_stops_the_arm(arm):
    index = arm.ptp(MOVL_XYZ, *THERE)
    arm.run(0.7)
    arm.controller.raise_alarm(0x50)
    before = arm.pose
    arm.run(5.0)
    assert arm.pose == before
    assert arm.index == index
    with pytest.raises(ValueError, match="0x80"):
        arm.controller.raise_alarm(128)


def test_homing_takes_its_time_under_an_alarm_too_and_leaves_it_set(arm):
    arm.ptp(MOVL_XYZ, *BEYOND_REACH)
    index = arm.put(commands.HOME, 0)
    arm.run(4.9)
    assert arm.index < index
    assert not arm.controller.homed
    arm.run(0.2)
    assert arm.index == index
    assert arm.controller.homed
    assert arm.is_at(259.1041, 0.0, -8.4853)
    assert arm.alarms == {0x11}


def test_homing_that_is_stopped_is_no_homing(arm):
    arm.put(commands.HOME, 0)
    arm.run(2.0)
    arm.control(commands.FORCE_STOP)
    arm.run(10.0)
    assert not arm.controller.homed


@pytest.mark.parametrize("params", [b"", bytes(4)])
def test_home_may_come_without_its_reserved_number(arm, params):
    assert arm.ask(commands.HOME, QUEUED, params) is not None
    arm.run(6.0)
    assert arm.controller.homed


def test_the_home_position_can_be_moved(arm):
    arm.put(commands.HOME_PARAMS, 220.0, 10.0, 20.0, 5.0)
    arm.put(commands.HOME, 0)
    arm.run(6.0)
    assert arm.is_at(220.0, 10.0, 20.0, 5.0)


def test_switched_off_and_on_it_has_forgotten_everything(arm):
    arm.ptp(MOVL_XYZ, *BEYOND_REACH)
    arm.put(commands.SUCTION, 1, 1, control=WRITE)
    arm.put(commands.STEPPER, BELT, 1, round(10.0 * PER_MM), control=WRITE)
    arm.controller.extension.put(50.0, "blue")
    arm.run(1.0)
    arm.controller.power_up()
    assert (arm.alarms, arm.index, arm.space) == (set(), 0, 32)
    assert arm.ask(commands.SUCTION, READ) == b"\0\0"
    assert not arm.controller.homed
    arm.run(1.0)
    (cube,) = arm.controller.extension.cubes
    assert (arm.controller.extension.belt, cube.place) == (0.0, pytest.approx(40.0, abs=0.01))


# --- jog ---


@pytest.mark.parametrize(("command", "direction"), [(3, 1.0), (4, -1.0)])
def test_a_jog_moves_one_axis_until_it_is_stopped(arm, command, direction):
    arm.put(commands.JOG, 0, command, control=WRITE)
    arm.run(1.0)
    x, y, z, r = arm.pose
    assert (x, z, r) == pytest.approx((200.0, 30.0, 0.0), abs=1e-3)
    assert direction * (y - 80.0) > 10.0
    arm.put(commands.JOG, 0, 0, control=WRITE)
    arm.run(2.0)
    braked = arm.pose
    assert 0.0 < direction * (braked[1] - y) < 30.0
    arm.run(2.0)
    assert arm.pose == braked


def test_a_queued_jog_is_stopped_by_a_queued_stop(arm):
    arm.put(commands.JOG, 1, 1)
    arm.run(0.5)
    stop = arm.put(commands.JOG, 1, 0)
    arm.run(1.0)
    assert arm.index == stop
    assert not arm.controller.arm.moving


def test_under_an_alarm_only_a_stop_at_once_stops_a_jog(arm):
    arm.put(commands.JOG, 1, 2, control=WRITE)
    arm.controller.alarms.add(0x50)
    arm.put(commands.JOG, 1, 0)
    arm.run(0.5)
    assert arm.controller.arm.moving
    arm.put(commands.JOG, 1, 0, control=WRITE)
    arm.run(1.0)
    assert not arm.controller.arm.moving


@pytest.mark.parametrize(
    ("command", "alarm"), [(1, 0x40), (2, 0x41), (3, 0x42), (6, 0x45), (7, 0x46), (8, 0x47)]
)
def test_a_jog_stops_at_the_limit_with_the_alarm_of_that_axis(command, alarm):
    arm = VirtualArm()
    arm.ptp(MOVJ_ANGLE, 0.0, 40.0, 20.0, 0.0)
    arm.run(5.0)
    arm.put(commands.JOG_RATIO, 100.0, 100.0, control=WRITE)
    arm.put(commands.JOG, 1, command, control=WRITE)
    arm.run(30.0)
    assert (arm.alarms & {alarm}) or arm.alarms <= {0x48, 0x49}
    assert arm.alarms
    assert not arm.controller.arm.moving
    assert arm.controller.geometry.exceeded(arm.controller.joints) is None


# --- ports ---


def test_the_belt_moves_by_speed_and_time_both_ways(arm):
    arm.put(commands.STEPPER, BELT, 1, round(50.0 * PER_MM))
    arm.run(2.0)
    assert arm.controller.extension.belt == pytest.approx(100.0, abs=0.01)
    arm.put(commands.STEPPER, BELT, 1, -round(20.0 * PER_MM))
    arm.run(1.0)
    arm.put(commands.STEPPER, BELT, 0, round(20.0 * PER_MM))
    arm.run(5.0)
    assert arm.controller.extension.belt == pytest.approx(80.0, abs=0.02)


def test_the_belt_stops_by_itself_after_its_distance(arm):
    arm.put(commands.STEPPER_DISTANCE, BELT, 1, -5000, 12345)
    arm.run(2.0)
    assert arm.controller.extension.steppers[0].pulses == -10000.0
    arm.run(2.0)
    assert arm.controller.extension.steppers[0].pulses == -12345.0
    assert arm.controller.extension.steppers[0].speed == 0.0


def test_a_cube_that_the_belt_brings_gives_both_edges(arm):
    arm.put(commands.INFRARED, 1, PORT, 1)
    arm.controller.extension.put(50.0, "blue")
    arm.put(commands.STEPPER, BELT, 1, round(10.0 * PER_MM))
    seen = []
    for _ in range(80):
        seen.append(arm.ask(commands.INFRARED, READ, bytes((PORT,)))[0])
        arm.run(0.1)
    first, last = seen.index(1), len(seen) - 1 - seen[::-1].index(1)
    assert (first, last) == (38, 62)
    assert seen == [int(first <= i <= last) for i in range(80)]


def test_sensors_see_nothing_until_they_are_switched_on_at_their_port(arm):
    arm.controller.extension.put(0.0, "red")
    assert arm.ask(commands.INFRARED, READ, bytes((PORT,))) == b"\0"
    arm.put(commands.INFRARED, 1, PORT + 1, 1)
    assert arm.ask(commands.INFRARED, READ, bytes((PORT + 1,))) == b"\0"
    assert arm.ask(commands.COLOUR, READ) == b"\0\0\0"
    arm.ask(commands.INFRARED, 0b10, bytes((1, PORT)))
    assert arm.ask(commands.INFRARED, READ, bytes((PORT,))) == b"\x01"
    arm.put(commands.COLOUR, 1, 1, 1)
    red, green, blue = arm.ask(commands.COLOUR, READ)
    assert red > 2 * max(green, blue)
    arm.controller.extension.take()
    assert arm.ask(commands.INFRARED, READ, bytes((PORT,))) == b"\0"
    assert arm.ask(commands.INFRARED, READ) is None


@pytest.mark.parametrize(("distance", "colour"), [(math.nan, "red"), (1.0, "pink")])
def test_cubes_that_there_are_not_are_refused(arm, distance, colour):
    with pytest.raises(ValueError, match="cube"):
        arm.controller.extension.put(distance, colour)


def test_inputs_and_outputs_are_addressed(arm):
    arm.controller.extension.levels[7] = 1
    arm.controller.extension.voltages[8] = 4095
    assert arm.ask(commands.DIGITAL_IN, READ, b"\x07") == b"\x07\x01"
    assert arm.ask(commands.ANALOG_IN, READ, b"\x08") == b"\x08\xff\x0f"
    arm.put(commands.DIGITAL_OUT, 10, 1)
    assert arm.ask(commands.DIGITAL_OUT, READ, b"\x0a") == b"\x0a\x01"
    assert arm.ask(commands.DIGITAL_OUT, READ, b"\x0b") == b"\x0b\x00"
    assert arm.ask(commands.DIGITAL_OUT, READ) is None


# --- table ---

REGISTERS = [key for key, row in commands.TABLE.items() if row.kind is Kind.REGISTER]


@pytest.mark.parametrize("command", [key for key in REGISTERS if key != commands.RAIL])
@pytest.mark.parametrize("control", [WRITE, QUEUED, 0b10])
def test_registers_read_back_what_was_written(command, control):
    arm, row = VirtualArm(), commands.TABLE[command]
    params = row.pack(tuple(range(1, 1 + len(struct.unpack("<" + row.layout, bytes(row.size))))))
    arm.ask(command, control, params)
    assert arm.ask(command, READ, params[: row.address]) == params


@pytest.mark.parametrize("command", [key for key, row in commands.TABLE.items() if row.size])
def test_writes_with_bytes_missing_or_numbers_that_are_none_are_not_answered(command):
    arm, row = VirtualArm(), commands.TABLE[command]
    least = row.size if row.least is None else row.least
    if least:
        assert arm.ask(command, WRITE, bytes(least - 1)) is None
    zeros = struct.unpack("<" + row.layout, bytes(row.size))
    if any(isinstance(zero, float) for zero in zeros):
        params = row.pack(tuple(math.nan if isinstance(z, float) else z for z in zeros))
        assert arm.ask(command, WRITE, params) is None
    assert arm.space == 32


def test_set_only_commands_work_without_the_write_bit(arm):
    assert (
        arm.ask(commands.STEPPER, READ, commands.TABLE[commands.STEPPER].pack((0, 1, 500))) == b""
    )
    assert arm.controller.extension.steppers[0].speed == 500.0


def test_unknown_commands_are_not_answered(arm):
    for command in set(range(256)) - set(commands.TABLE):
        assert arm.ask(command, READ) is None


def test_the_device_says_who_it_is(arm):
    assert arm.ask(commands.DEVICE_SN, READ) == b"FABRIC-EMULATOR\0"
    arm.ask(commands.DEVICE_NAME, WRITE, b"left arm")
    assert arm.ask(commands.DEVICE_NAME, READ) == b"left arm\0"
    assert arm.ask(commands.DEVICE_VERSION, READ) == bytes((3, 7, 0))
    before = struct.unpack("<I", arm.ask(commands.DEVICE_TIME, READ))[0]
    arm.run(1.5)
    assert struct.unpack("<I", arm.ask(commands.DEVICE_TIME, READ))[0] == before + 1500
    arm.put(commands.RAIL, 1, 0, control=WRITE)
    assert arm.ask(commands.RAIL, READ) == b"\x01"
    assert len(arm.ask(commands.DEVICE_ID, READ)) == 12
