# SPDX-License-Identifier: BSD-3-Clause
"""Readings of several trays in one message become changes of each tray, once."""

import pytest

from fabric_perception.tracking.weighing import Scales, TrayChange, scale_parameters

SCALE = {"counts_per_gram": 400.0, "cube": 18.0}
PERIOD = 0.0125  # s
ZERO = 8000


def feed(scales, grams, seconds, start):
    """Feed trays 1 and 2 in messages of four readings; return changes and the time after."""
    changes, t = [], start
    for _ in range(round(seconds / PERIOD / 4)):
        t += 4 * PERIOD
        counts = [ZERO + int(400 * grams[tray]) for _ in range(4) for tray in (1, 2)]
        changes += scales.read(t, PERIOD, [1, 2], counts)
    return changes, t


def test_a_cube_in_one_tray_is_one_change_of_that_tray():
    scales = Scales(scale_parameters(SCALE))
    none, t = feed(scales, {1: 0.0, 2: 0.0}, 1.0, 0.0)
    put, t = feed(scales, {1: 0.0, 2: 18.0}, 3.0, t)
    taken, t = feed(scales, {1: 0.0, 2: 0.0}, 3.0, t)
    assert none == []
    assert [(change.tray, change.cubes) for change in put + taken] == [(2, 1), (2, -1)]
    assert isinstance(put[0], TrayChange) and 1.0 <= put[0].t <= 1.6


def test_emptied_trays_are_weighed_anew():
    scales = Scales(scale_parameters(SCALE))
    _, t = feed(scales, {1: 36.0, 2: 0.0}, 1.0, 0.0)
    scales.reset()
    changes, _ = feed(scales, {1: 0.0, 2: 0.0}, 2.0, t)
    assert changes == []


@pytest.mark.parametrize(
    ("trays", "counts", "words"),
    [([], [], "0 trays"), ([1, 2], [1, 2, 3], "3 counts are not whole readings of 2 trays")],
)
def test_readings_that_do_not_fit_are_refused(trays, counts, words):
    with pytest.raises(ValueError, match=words):
        Scales(scale_parameters(SCALE)).read(1.0, PERIOD, trays, counts)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"cube": 18.0}, "counts_per_gram is missing"),
        (SCALE | {"mass": 1.0}, "unknown parameter 'mass'"),
        (SCALE | {"cube": "heavy"}, "cube is 'heavy'"),
        (SCALE | {"cube": 0.0}, "cube is 0.0"),
    ],
)
def test_parameters_of_scales_are_refused_by_name(values, words):
    with pytest.raises(ValueError, match=words):
        scale_parameters(values)
