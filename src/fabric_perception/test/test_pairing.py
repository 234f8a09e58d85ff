# SPDX-License-Identifier: BSD-3-Clause
"""Percepts come together by their stamps, whatever the order of arrival."""

from fabric_perception.pairing import KEPT, Pair, StampPairing


def test_with_no_tolerance_a_pair_is_complete_when_the_second_of_its_stamp_arrives():
    pairing = StampPairing()
    assert pairing.add_head(5, "h5") == []
    assert pairing.add_activity(6, "a6") == []
    assert pairing.add_activity(5, "a5") == [Pair(5, "a5", "h5")]
    assert pairing.add_head(6, "h6") == [Pair(6, "a6", "h6")]


def test_a_complete_pair_drops_what_is_older():
    pairing = StampPairing()
    pairing.add_activity(1, "a1")
    pairing.add_activity(2, "a2")
    assert pairing.add_head(2, "h2") == [Pair(2, "a2", "h2")]
    assert pairing.add_head(1, "h1") == []


def test_halves_that_never_meet_do_not_pile_up():
    pairing = StampPairing()
    for stamp in range(10 * KEPT):
        pairing.add_activity(stamp, "a")
    assert pairing.add_head(0, "h") == []
    assert pairing.add_head(10 * KEPT - 1, "h") != []


def test_cameras_without_a_common_shutter_are_paired_by_the_nearest_stamp():
    pairing = StampPairing(tolerance=50)
    pairing.add_head(960, "early")
    assert pairing.add_activity(1000, "a") == []  # a nearer head may still come
    assert pairing.add_head(1010, "late") == [Pair(1000, "a", "late")]


def test_a_head_serves_two_activities_when_its_camera_is_slower():
    pairing = StampPairing(tolerance=60)
    pairing.add_activity(1000, "a1")
    assert pairing.add_head(1050, "h1") == [Pair(1000, "a1", "h1")]
    pairing.add_activity(1100, "a2")
    assert pairing.add_head(1170, "h2") == [Pair(1100, "a2", "h1")]


def test_a_head_that_is_not_seen_is_said_to_be_unknown_and_holds_nothing_up():
    pairing = StampPairing(tolerance=50, unseen=lambda stamp: f"unknown at {stamp}", patience=2)
    assert pairing.add_activity(1000, "a1") == []
    assert pairing.add_activity(1100, "a2") == []
    assert pairing.add_activity(1200, "a3") == [Pair(1000, "a1", "unknown at 1000")]
    assert pairing.add_head(1210, "h") == [
        Pair(1100, "a2", "unknown at 1100"),
        Pair(1200, "a3", "h"),
    ]


def test_without_a_word_for_unknown_an_activity_without_a_head_is_dropped():
    pairing = StampPairing(tolerance=50)
    pairing.add_activity(1000, "a1")
    assert pairing.add_head(2000, "h") == []
    assert pairing.add_activity(2000, "a2") == [Pair(2000, "a2", "h")]
