# SPDX-License-Identifier: BSD-3-Clause
"""Hands and head change together, or not at all."""

import pytest

from fabric_perception.joint import JointHysteresis
from fabric_perception.recognition import Reading

IDLE, GRASP, WARN, OTHER = range(4)
LOOKS = Reading(IDLE, True, True)
RESTS = Reading(IDLE, True, False)
REACHES = Reading(GRASP, True, False)
WARNS = Reading(WARN, True, False)


def passed(percepts, readings):
    joint = JointHysteresis(percepts)
    return [joint.feed(reading) for reading in readings]


def test_a_movement_of_head_and_hand_is_one_change():
    told = passed(4, [LOOKS] * 5 + [RESTS] * 3 + [REACHES] * 5)
    assert told == [LOOKS] * 11 + [REACHES] * 2


def test_what_lasts_is_told_after_so_many_percepts():
    assert passed(4, [LOOKS] + [RESTS] * 5) == [LOOKS] * 4 + [RESTS] * 2


def test_one_percept_passes_everything_on():
    readings = [LOOKS, RESTS, REACHES, Reading(OTHER, False, None), WARNS]
    assert passed(1, readings) == readings


def test_a_warning_does_not_wait():
    assert passed(4, [LOOKS, WARNS, WARNS]) == [LOOKS, WARNS, WARNS]


def test_presence_does_not_wait():
    gone = RESTS._replace(detected=False)
    assert passed(4, [RESTS, gone]) == [RESTS, gone]


@pytest.mark.parametrize("hidden", [1, 2, 3])
def test_a_helmet_out_of_view_counts_as_where_it_was(hidden):
    unseen = REACHES._replace(looking_around=None)
    told = passed(4, [RESTS] * 2 + [REACHES] * (4 - hidden) + [unseen] * hidden)
    assert [reading.gesture for reading in told] == [IDLE] * 5 + [GRASP]


def test_flicker_is_never_told():
    told = passed(3, [RESTS] + [REACHES, REACHES, RESTS, RESTS] * 5)
    assert set(told) == {RESTS}
