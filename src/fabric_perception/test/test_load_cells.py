# SPDX-License-Identifier: BSD-3-Clause
"""A tray's scale says once what was put in, and is not taken in by hands, spikes or drift."""

import math

import numpy as np
import pytest

from fabric_perception.load_cells import SATURATED, ScaleParameters, TrayScale

RATE, GAIN, CUBE = 80.0, 420.0, 18.0
PARAMETERS = ScaleParameters(GAIN, CUBE)


def weigh(grams, scale=None, offset=20000.0, noise=0.1, start=0.0, seed=1):
    """Changes told of a course of weights, one a reading."""
    scale = scale or TrayScale(PARAMETERS)
    rng = np.random.default_rng(seed)
    counts = np.rint(offset + GAIN * (np.asarray(grams) + noise * rng.standard_normal(len(grams))))
    told = [scale.step(start + i / RATE, int(count)) for i, count in enumerate(counts)]
    return [change for change in told if change is not None], scale


def course(*pieces):
    """(seconds, grams) one after another."""
    return np.concatenate([np.full(int(seconds * RATE), grams) for seconds, grams in pieces])


def test_a_cube_is_told_once_soon_and_with_its_weight():
    changes, scale = weigh(course((1.0, 0.0), (3.0, 18.3)))
    (change,) = changes
    assert change.cubes == scale.cubes == 1
    assert change.grams == pytest.approx(18.3, abs=0.3)
    assert 1.0 <= change.t <= 1.4


def test_several_cubes_come_and_go():
    changes, scale = weigh(
        course((1.0, 0.0), (1.0, 17.4), (1.0, 35.6), (1.0, 71.0), (1.0, 53.5), (2.0, 0.0))
    )
    assert [change.cubes for change in changes] == [1, 1, 2, -1, -3]
    assert scale.cubes == 0


def test_two_cubes_in_quick_succession_are_both_counted():
    changes, _ = weigh(course((1.0, 0.0), (0.2, 18.0), (2.0, 36.0)))
    assert sum(change.cubes for change in changes) == 2


def test_spikes_and_saturated_readings_count_for_nothing():
    grams = course((1.0, 0.0), (2.0, 18.0))
    grams[::40] = 900.0
    scale = TrayScale(PARAMETERS)
    told = [scale.step(i / RATE, round(GAIN * value)) for i, value in enumerate(grams)]
    assert [change.cubes for change in told if change] == [1]
    for i, code in enumerate(SATURATED * 30):
        assert scale.step(100.0 + i / RATE, code) is None
    assert scale.cubes == 1


def test_a_swinging_tray_is_waited_for():
    t = np.arange(0.0, 3.0, 1.0 / RATE)
    swing = 18.0 * (1.0 - np.exp(-6.0 * t) * np.cos(2.0 * np.pi * 5.0 * t))
    (change,), _ = weigh(np.concatenate([course((1.0, 0.0)), swing]))
    assert change.cubes == 1
    assert change.grams == pytest.approx(18.0, abs=1.0)


def test_a_hand_on_the_tray_is_no_cube():
    rng = np.random.default_rng(4)
    hand = 60.0 + np.cumsum(rng.normal(0.0, 2.0, int(4 * RATE)))
    changes, scale = weigh(np.concatenate([course((1.0, 0.0)), hand, course((2.0, 0.0))]))
    assert changes == []
    assert scale.settled


def test_a_cube_put_in_under_a_resting_hand_is_told_when_the_hand_is_gone():
    rng = np.random.default_rng(5)
    hand = 60.0 + np.cumsum(rng.normal(0.0, 2.0, int(2 * RATE)))
    changes, _ = weigh(np.concatenate([course((1.0, 0.0)), hand, course((2.0, 18.0))]))
    assert [change.cubes for change in changes] == [1]
    assert changes[0].t > 3.0


def test_an_empty_tray_is_tared_slowly_and_a_full_one_never():
    drift = np.linspace(0.0, 40.0, int(120 * RATE))
    changes, scale = weigh(drift)
    assert changes == []
    assert scale.cubes == 0
    loaded = np.concatenate([course((1.0, 0.0), (1.0, 18.0)), 18.0 + 0.05 * drift])
    changes, scale = weigh(loaded)
    assert [change.cubes for change in changes] == [1]


def test_something_of_another_weight_is_no_cube():
    assert weigh(course((1.0, 0.0), (3.0, 9.0)))[0] == []
    assert weigh(course((1.0, 0.0), (3.0, 27.0)))[0] == []


def test_an_empty_tray_cannot_lose_a_cube():
    changes, scale = weigh(course((1.0, 0.0), (2.0, -18.0)))
    assert changes == []
    assert scale.cubes == 0


def test_a_tray_may_hold_cubes_from_the_start():
    changes, scale = weigh(course((1.0, 36.0), (2.0, 18.0)), TrayScale(PARAMETERS, cubes=2))
    assert [change.cubes for change in changes] == [-1]
    assert scale.cubes == 1


def test_after_a_gap_everything_is_looked_at_anew():
    _, scale = weigh(course((1.0, 0.0)))
    assert scale.step(50.0, 20000) is None
    assert not scale.settled
    changes, _ = weigh(course((1.0, 18.0)), scale, start=50.1)
    assert [change.cubes for change in changes] == [1]


def test_cells_wired_the_other_way_round_count_downwards():
    scale = TrayScale(ScaleParameters(-GAIN, CUBE))
    grams = course((1.0, 0.0), (2.0, 18.0))
    told = [scale.step(i / RATE, round(-GAIN * value)) for i, value in enumerate(grams)]
    assert [change.cubes for change in told if change] == [1]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("counts_per_gram", 0.0),
        ("counts_per_gram", math.nan),
        ("cube", -1.0),
        ("tolerance", 0.5),
        ("still", math.inf),
        ("hold_off", 0.0),
    ],
)
def test_numbers_that_make_no_sense_are_named(name, value):
    words = {"counts_per_gram": GAIN, "cube": CUBE} | {name: value}
    with pytest.raises(ValueError, match=f"{name} is {value}"):
        ScaleParameters(**words)


def test_negative_cubes_are_refused():
    with pytest.raises(ValueError, match="-1 cubes cannot lie in a tray"):
        TrayScale(PARAMETERS, cubes=-1)


@pytest.mark.parametrize("t", [0.5, 1.0, math.nan])
def test_readings_follow_each_other(t):
    scale = TrayScale(PARAMETERS)
    scale.step(1.0, 0)
    with pytest.raises(ValueError, match=r"does not follow one of 1\.0 s"):
        scale.step(t, 0)
