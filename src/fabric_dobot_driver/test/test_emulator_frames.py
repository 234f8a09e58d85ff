# SPDX-License-Identifier: BSD-3-Clause
"""Frames of the emulator: golden bytes, and a parser that nothing throws off."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabric_dobot_driver.emulator.frames import HEADER, Frame, Parser, encode

GOLDEN = {
    "AA AA 02 F0 01 0F": Frame(240, 1),
    "AA AA 02 F5 01 0A": Frame(245, 1),
    "AA AA 02 0A 00 F6": Frame(10, 0),
    "AA AA 03 83 00 0A 73": Frame(131, 0, b"\x0a"),
}
frames = st.builds(Frame, st.integers(0, 255), st.integers(0, 255), st.binary(max_size=12))
noise = st.binary(max_size=10).filter(lambda data: 0xAA not in data)


@pytest.mark.parametrize("text", GOLDEN)
def test_golden_frames_are_written_and_read(text):
    data = bytes.fromhex(text)
    assert encode(GOLDEN[text]) == data
    assert Parser().feed(data) == [GOLDEN[text]]


@given(st.lists(frames, max_size=4), st.data())
def test_frames_survive_any_cut_into_reads(sent, data):
    stream = b"".join(map(encode, sent))
    parser, heard = Parser(), []
    while stream:
        cut = data.draw(st.integers(1, len(stream)))
        heard += parser.feed(stream[:cut])
        stream = stream[cut:]
    assert heard == sent
    assert not parser.waiting


@given(st.lists(st.tuples(noise, frames), max_size=4), noise)
def test_noise_between_frames_is_passed_over(pairs, end):
    stream = b"".join(before + encode(frame) for before, frame in pairs) + end
    assert Parser().feed(stream) == [frame for _, frame in pairs]


@given(frames, st.data())
def test_one_wrong_byte_behind_the_length_drops_the_frame_and_only_it(frame, data):
    damaged = bytearray(encode(frame))
    at = data.draw(st.integers(3, len(damaged) - 1))
    damaged[at] ^= data.draw(st.integers(1, 255))
    parser, after = Parser(), Frame(10, 0)
    heard = parser.feed(bytes(damaged) + encode(after)) + parser.give_up()
    assert frame not in heard[:-1]
    assert heard[-1] == after
    assert parser.dropped >= 1


@pytest.mark.parametrize("length", [0, 1, 251, 255])
def test_lengths_that_no_frame_has_are_dropped_at_once(length):
    parser = Parser()
    assert parser.feed(HEADER + bytes((length,)) + encode(Frame(10, 0))) == [Frame(10, 0)]


def test_a_third_header_byte_costs_no_frame():
    parser = Parser()
    assert parser.feed(b"\xaa" + encode(Frame(10, 0))) + parser.give_up() == [Frame(10, 0)]


def test_a_frame_within_a_broken_one_is_found_when_the_line_falls_silent():
    parser = Parser()
    assert parser.feed(HEADER + b"\x40\x54\x03" + encode(Frame(240, 1))) == []
    assert parser.waiting
    assert parser.give_up() == [Frame(240, 1)]
    assert not parser.waiting


def test_a_frame_that_cannot_be_said_is_refused():
    with pytest.raises(ValueError, match="249"):
        encode(Frame(1, 1, bytes(249)))
