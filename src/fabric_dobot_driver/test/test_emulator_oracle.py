# SPDX-License-Identifier: BSD-3-Clause
"""The emulator beside the simulator that pydobotlab brings along: the same frames to both.

Where they differ, the protocol's facts decide; each difference is listed with its reason, and
fails here when it goes away. docs/emulator.md has the same list in words.
"""

import struct

import pytest
from pydobotlab.simulator import FakeDobot
from virtual_arm import QUEUED, READ, WRITE, VirtualArm

from fabric_dobot_driver.emulator import commands
from fabric_dobot_driver.emulator.frames import Frame, Parser, encode
from fabric_dobot_driver.emulator.planning import MOVJ_ANGLE, MOVJ_XYZ, MOVL_XYZ

TICK = 0.02
HERE, THERE = (200.0, 80.0, 30.0, 0.0), (200.0, -80.0, 30.0, 0.0)
BEYOND_REACH = (500.0, 0.0, 0.0, 0.0)
IMMEDIATE_PTP = commands.TABLE[commands.PTP].pack((MOVL_XYZ, *HERE))


class OtherArm(VirtualArm):
    """pydobotlab's simulated arm, in virtual time too: its thread is ended, we make its ticks."""

    def __init__(self) -> None:
        self._other = FakeDobot(tick_hz=1.0 / TICK)
        self._other._stop.set()
        self._other._thread.join()

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / TICK)):
            self._other.run_queue_tick()

    def ask(self, command: int, control: int, params: bytes = b"") -> bytes | None:
        data = self._other.handle_frame(encode(Frame(command, control, params)))
        answers = Parser().feed(data)
        assert [(answer.id, answer.control) for answer in answers] in ([], [(command, control)])
        return answers[0].params if answers else None


# --- what both do ---


def connects(arm: VirtualArm):
    return [arm.ask(command, WRITE) for command in (commands.CLEAR, commands.START)]


def counts_commands(arm: VirtualArm):
    given = [arm.ptp(MOVJ_XYZ, *HERE), arm.put(commands.WAIT, 500), arm.ptp(MOVL_XYZ, *THERE)]
    before = arm.index
    arm.run(30.0)
    return given, before, arm.index, [round(value, 2) for value in arm.pose]


def waits(arm: VirtualArm):
    arm.put(commands.WAIT, 1000)
    arm.run(0.9)
    before = arm.index
    arm.run(0.2)
    return before, arm.index


def holds_while_stopped(arm: VirtualArm):
    arm.control(commands.STOP)
    arm.put(commands.WAIT, 10)
    arm.run(1.0)
    before = arm.index
    arm.control(commands.START)
    arm.run(1.0)
    return before, arm.index


def refuses_what_is_out_of_reach(arm: VirtualArm):
    arm.ptp(MOVJ_XYZ, *BEYOND_REACH)
    arm.ptp(MOVJ_XYZ, *HERE)
    arm.run(30.0)
    blocked = arm.index, arm.ask(commands.ALARMS, READ)
    arm.control(commands.ALARMS)
    arm.run(30.0)
    return blocked, arm.index, arm.ask(commands.ALARMS, READ), [round(v, 2) for v in arm.pose]


def homes_under_an_alarm(arm: VirtualArm):
    arm.ptp(MOVJ_XYZ, *BEYOND_REACH)
    arm.put(commands.HOME, 0)
    arm.run(60.0)
    return arm.index, arm.ask(commands.ALARMS, READ)


def keeps_settings(arm: VirtualArm):
    written = [commands.PTP_RATIO, commands.PTP_JUMP, commands.JOG_RATIO]
    for control in (WRITE, QUEUED):
        for command in written:
            arm.put(command, 40.0, 60.0, control=control)
    return [arm.ask(command, READ) for command in written]


def takes_a_stop_of_a_jog_at_once(arm: VirtualArm):
    return [arm.ask(commands.JOG, WRITE, bytes((0, command))) for command in (1, 0)]


def takes_writes_it_has_no_use_for(arm: VirtualArm):
    return [
        arm.ask(command, control, bytes(commands.TABLE[command].size))
        for command in (commands.SUCTION, commands.STEPPER, commands.INFRARED, commands.CP)
        for control in (WRITE, QUEUED)
    ]


BOTH = [
    connects,
    counts_commands,
    waits,
    holds_while_stopped,
    refuses_what_is_out_of_reach,
    homes_under_an_alarm,
    keeps_settings,
    takes_a_stop_of_a_jog_at_once,
    takes_writes_it_has_no_use_for,
]


@pytest.mark.parametrize("scene", BOTH, ids=lambda scene: scene.__name__)
def test_both_answer_alike(scene):
    assert scene(VirtualArm()) == scene(OtherArm())


# --- where they differ: ours, theirs, and why ours is so ---


def move_and(arm: VirtualArm, command: int) -> VirtualArm:
    """Under way from THERE to HERE when the command comes."""
    arm.ptp(MOVL_XYZ, *THERE)
    arm.run(30.0)
    arm.put(commands.PTP_RATIO, 30.0, 100.0)
    arm.ptp(MOVL_XYZ, *HERE)
    arm.run(0.5)
    arm.control(command)
    return arm


def at_end_of_stop(arm: VirtualArm) -> bool:
    move_and(arm, commands.STOP).run(30.0)
    return arm.is_at(*HERE)


def ends_by_angles(arm: VirtualArm) -> tuple[float, ...]:
    arm.ptp(MOVJ_ANGLE, 10.0, 30.0, 40.0, 0.0)
    arm.run(30.0)
    return tuple(round(angle, 2) for angle in arm.joints)


def left_space(arm: VirtualArm) -> int:
    arm.control(commands.STOP)
    arm.put(commands.WAIT, 10)
    return arm.space


def goes_on_after_clear(arm: VirtualArm) -> bool:
    move_and(arm, commands.CLEAR).run(30.0)
    return arm.is_at(*HERE)


def reaches(*pose: float):
    def scene(arm: VirtualArm) -> bool:
        arm.ptp(MOVJ_XYZ, *pose)
        arm.run(30.0)
        return not arm.alarms

    return scene


def home_of(arm: VirtualArm) -> tuple[float, ...]:
    arm.put(commands.HOME, 0)
    arm.run(60.0)
    return tuple(round(value, 1) for value in arm.pose)


def jog_into_the_limit(arm: VirtualArm) -> set[int]:
    arm.put(commands.JOG, 1, 1, control=WRITE)
    arm.run(30.0)
    return arm.alarms


def answers(command: int, control: int, params: bytes = b""):
    return lambda arm: arm.ask(command, control, params)


INDEX_ONE = struct.pack("<Q", 1)
DIFFERENT = {
    "unknown ids are not answered": (answers(200, READ), None, bytes(8)),
    "reads have the length of their layout": (answers(commands.SUCTION, READ), bytes(2), bytes(8)),
    "a digital input says its address": (
        answers(commands.DIGITAL_IN, READ, b"\x05"),
        b"\x05\x00",
        bytes(8),
    ),
    "a move at once has no index": (answers(commands.PTP, WRITE, IMMEDIATE_PTP), b"", INDEX_ONE),
    "homing at once has no index": (answers(commands.HOME, WRITE, bytes(4)), b"", INDEX_ONE),
    "a queued jog has an index": (answers(commands.JOG, QUEUED, bytes(2)), INDEX_ONE, b""),
    "id 21 clears alarms without the write bit": (
        answers(commands.ALARMS_AS_PRINTED, READ),
        b"",
        bytes(8),
    ),
    "set payloads without the write bit count": (
        answers(commands.INFRARED, 0b10, b"\x01\x02"),
        INDEX_ONE,
        bytes(8),
    ),
    "writes with bytes missing are not answered": (
        answers(commands.PTP_RATIO, WRITE, bytes(4)),
        None,
        struct.pack("<2f", 50.0, 50.0),
    ),
    "the index is not turned back by clear": (
        lambda arm: move_and(arm, commands.CLEAR).index,
        2,
        0,
    ),
    "clear leaves the running command alone": (goes_on_after_clear, True, False),
    "stop lets the running command end": (at_end_of_stop, True, False),
    "force stop marks its command finished": (
        lambda arm: move_and(arm, commands.FORCE_STOP).index,
        3,
        2,
    ),
    "left space is counted": (left_space, 31, 32),
    "angle modes take angles": (ends_by_angles, (10.0, 30.0, 40.0, 0.0), (0.0, 0.0, 0.0, 0.0)),
    "j1 turns beyond 90 deg": (reaches(-30.0, -250.0, 20.0, 0.0), True, False),
    "the cup is 59.7 mm before the wrist": (reaches(175.0, 0.0, 75.0, 0.0), False, True),
    "home is where the joints are 0, 45, 45": (
        home_of,
        (259.1, 0.0, -8.5, 0.0),
        (200.0, 0.0, 50.0, 0.0),
    ),
    "a jog ends at the limit with an alarm": (jog_into_the_limit, {0x40}, set()),
}


@pytest.mark.parametrize("reason", DIFFERENT)
def test_they_differ_where_and_as_listed(reason):
    scene, ours, theirs = DIFFERENT[reason]
    assert scene(VirtualArm()) == ours
    assert scene(OtherArm()) == theirs
