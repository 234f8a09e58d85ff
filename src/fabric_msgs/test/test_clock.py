# SPDX-License-Identifier: BSD-3-Clause
"""Times come out exactly as `round` and the constructors of genpy make them, only sooner."""

import genpy
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from fabric_msgs.clock import header_of, micro, seconds_of, stamp_of
from fabric_msgs.msg import TaskEvent


@given(st.floats(allow_nan=False, allow_infinity=False))
@example(0.0000005)
@example(2.5e-6)
@example(1e9 + 0.0000005)
@example(1e300)
def test_micro_is_round_to_six_digits(t):
    assert micro(t) == round(t, 6)


@given(st.integers(0, 10**12), st.floats(-1e-12, 1e-12))
def test_micro_is_round_beside_whole_and_half_microseconds(half_micros, off):
    t = half_micros / 2e6 + off
    assert micro(t) == round(t, 6)


@given(st.integers(0, 10**13))
def test_a_stamp_holds_every_microsecond(micros):
    stamp = stamp_of(micros / 1e6)
    assert stamp == genpy.Time(micros // 10**6, micros % 10**6 * 1000)


@given(st.integers(0, 10**12))
def test_seconds_come_back_from_a_header(micros):
    event = TaskEvent(header=header_of(micros / 1e6))
    assert seconds_of(event) == micros / 1e6


def test_a_header_is_as_its_constructor_makes_it():
    header = header_of(12.35, "cell")
    assert (header.seq, header.stamp, header.frame_id) == (0, genpy.Time(12, 350000000), "cell")


def test_a_time_before_the_beginning_is_refused():
    with pytest.raises(TypeError, match="positive"):
        stamp_of(-1.0)
