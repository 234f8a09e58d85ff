# SPDX-License-Identifier: BSD-3-Clause
"""Percepts of one stamp come together whatever the order of arrival."""

from fabric_perception.pairing import KEPT, StampPairing


def test_a_pair_is_complete_when_the_second_of_its_stamp_arrives():
    pairing = StampPairing("activity", "head")
    assert pairing.add("head", 5, "h5") is None
    assert pairing.add("activity", 6, "a6") is None
    assert pairing.add("activity", 5, "a5") == {"head": "h5", "activity": "a5"}
    assert pairing.add("head", 6, "h6") == {"head": "h6", "activity": "a6"}


def test_a_complete_pair_drops_what_is_older():
    pairing = StampPairing("activity", "head")
    pairing.add("activity", 1, "a1")
    pairing.add("activity", 2, "a2")
    pairing.add("head", 2, "h2")
    assert pairing.add("head", 1, "h1") is None


def test_halves_that_never_meet_do_not_pile_up():
    pairing = StampPairing("activity", "head")
    for stamp in range(10 * KEPT):
        pairing.add("activity", stamp, "a")
    assert pairing.add("head", 0, "h") is None
    assert pairing.add("head", 10 * KEPT - 1, "h") is not None
