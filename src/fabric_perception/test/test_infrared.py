# SPDX-License-Identifier: BSD-3-Clause
"""The light barrier's level can be relied on: chatter and wrong samples make no edges."""

import math

import pytest

from fabric_perception.infrared import Edge, LightBarrier

PERIOD = 0.0025  # s


def edges(levels, hold=0.03, period=PERIOD):
    barrier = LightBarrier(hold)
    found = [barrier.step(i * period, bool(level)) for i, level in enumerate(levels)]
    return [edge for edge in found if edge is not None]


def test_a_clean_edge_is_told_once_with_the_time_it_began():
    (edge,) = edges([0] * 40 + [1] * 40)
    assert edge == Edge(pytest.approx(40 * PERIOD), True)


def test_an_edge_is_believed_after_the_hold_time_and_not_before():
    barrier = LightBarrier(0.03)
    told = [i for i in range(80) if barrier.step(i * PERIOD, i >= 40) is not None]
    assert told == [40 + round(0.03 / PERIOD) - 1]
    assert barrier.blocked


def test_chatter_makes_one_edge():
    chatter = [1, 0, 1, 1, 0, 0, 1, 0, 1, 1]
    assert [edge.blocked for edge in edges([0] * 40 + chatter + [1] * 60 + chatter + [0] * 60)] == [
        True,
        False,
    ]


def test_single_wrong_samples_make_none():
    assert edges(([0] * 20 + [1]) * 20) == []
    (edge,) = edges([0] * 20 + ([1] * 20 + [0]) * 5)
    assert edge.blocked


def test_a_gap_in_the_samples_is_no_evidence():
    barrier = LightBarrier(0.03)
    barrier.step(0.0, False)
    assert barrier.step(5.0, True) is None
    assert not barrier.blocked


@pytest.mark.parametrize("hold", [0.0, -0.01, math.nan, math.inf])
def test_the_hold_time_must_make_sense(hold):
    with pytest.raises(ValueError, match=f"hold is {hold} s"):
        LightBarrier(hold)


@pytest.mark.parametrize("t", [1.0, 0.5, math.nan, math.inf])
def test_samples_follow_each_other(t):
    barrier = LightBarrier()
    barrier.step(1.0, False)
    with pytest.raises(ValueError, match=r"does not follow one of 1\.0 s"):
        barrier.step(t, False)
