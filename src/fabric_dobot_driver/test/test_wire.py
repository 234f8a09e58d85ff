# SPDX-License-Identifier: BSD-3-Clause
"""Requests in SI units become the bytes of the protocol; answers are checked before use."""

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydobotlab.commands import CommandID as Id

from fabric_dobot_driver import ToolPose
from fabric_dobot_driver.link import NoAnswer
from fabric_dobot_driver.wire import Wire


class Recorder:
    """A Link that notes the request and gives a fixed answer."""

    def __init__(self, answer: bytes = b"") -> None:
        self.answer = answer
        self.asked: list[tuple[int, bytes, bool, bool]] = []

    def exchange(self, command, params, write, queued):
        self.asked.append((command, params, write, queued))
        return self.answer


READS = (
    Wire.pose,
    Wire.alarms,
    Wire.current_index,
    lambda wire: wire.infrared(2),
    lambda wire: wire.move(ToolPose(0.2, 0.0, 0.1, 0.0)),
)


@given(st.binary(max_size=60), st.sampled_from(READS))
def test_whatever_is_answered_gives_a_value_or_no_answer(answer, read):
    try:
        read(Wire(Recorder(answer)))
    except NoAnswer:
        pass


@given(st.lists(st.floats(width=32), min_size=8, max_size=8))
def test_a_pose_that_is_believed_is_finite_and_near(values):
    wire = Wire(Recorder(struct.pack("<8f", *values)))
    try:
        pose, joints = wire.pose()
    except NoAnswer:
        return
    assert all(math.isfinite(value) for value in (*pose, *joints))
    assert max(abs(value) for value in pose[:3]) <= 1.0


def test_a_move_is_a_straight_line_in_millimetres_and_degrees():
    link = Recorder(struct.pack("<Q", 7))
    assert Wire(link).move(ToolPose(0.2, -0.1, 0.05, math.pi / 2)) == 7
    ((command, params, write, queued),) = link.asked
    assert (command, write, queued) == (Id.SET_PTP_CMD, True, True)
    assert struct.unpack("<B4f", params) == pytest.approx((2, 200.0, -100.0, 50.0, 90.0))


def test_the_belt_is_given_whole_pulses_at_once():
    link = Recorder()
    Wire(link).belt(0, 14145)
    ((command, params, write, queued),) = link.asked
    assert (command, write, queued) == (Id.SET_E_MOTOR, True, False)
    assert params == struct.pack("<BBi", 0, 1, 14145)


@pytest.mark.parametrize(
    ("current", "done"), [(4, False), (5, True), (7, True), (2**64 - 1, False)]
)
def test_a_command_is_done_between_its_own_index_and_the_newest(current, done):
    link = Recorder()
    wire = Wire(link)
    for index in (5, 6, 7):
        link.answer = struct.pack("<Q", index)
        wire.home()
    link.answer = struct.pack("<Q", current)
    assert wire.finished(5) is done


@pytest.mark.parametrize("index", [7, 3, 2**63])
def test_an_index_that_does_not_follow_is_a_damaged_answer(index):
    link = Recorder(struct.pack("<Q", 7))
    wire = Wire(link)
    wire.home()
    link.answer = struct.pack("<Q", index)
    with pytest.raises(NoAnswer, match="after 7"):
        wire.home()
    wire.clear_queue()
    assert wire.home() == index
