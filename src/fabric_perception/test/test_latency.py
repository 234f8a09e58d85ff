# SPDX-License-Identifier: BSD-3-Clause
"""Answers are timed by the stamps of their pictures."""

import math

import pytest

from fabric_perception.latency import Stopwatches, to_and_fro


def test_percentiles_are_of_the_time_from_picture_to_answer():
    watches = Stopwatches(["human/activity", "human/head"])
    for k in range(101):
        watches.sent(k, at=10.0 + k)
        watches.told("human/activity", k, at=10.0 + k + 1e-3 * k)
    found = watches.latency("human/activity")
    assert found.told == 101
    assert found[1:] == pytest.approx((50.0, 95.0, 99.0, 100.0))
    assert watches.latency("human/head").told == 0
    assert math.isnan(watches.latency("human/head").p95)


def test_what_is_told_again_or_of_no_picture_does_not_count():
    watches = Stopwatches(["human/head"])
    watches.sent(1, at=0.0)
    watches.told("human/head", 7, at=0.1)
    assert not watches.answered("human/head", 7)
    watches.told("human/head", 1, at=0.02)
    watches.told("human/head", 1, at=5.0)
    assert watches.answered("human/head", 1)
    assert watches.latency("human/head").most == pytest.approx(20.0)


def test_a_film_goes_forth_and_back_without_a_jump():
    assert to_and_fro(8, 3) == [0, 1, 2, 1, 0, 1, 2, 1]
    assert to_and_fro(3, 1) == [0, 0, 0]
