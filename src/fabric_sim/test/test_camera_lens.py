# SPDX-License-Identifier: BSD-3-Clause
"""What the cameras do to perfect pictures is as strong as their file says."""

from dataclasses import replace

import numpy as np
import pytest
from camera_helpers import PARAMETERS, small

from fabric_sim.camera.lens import ColourLens, DepthSensor, Smear, smeared

LENS = small().cell._replace(focal=570.0)
SHAPE = (LENS.height, LENS.width)
QUIET = replace(PARAMETERS.grain, grain=(0.0, 0.0), blur=(0.0, 0.0), vignette=(0.0, 0.0))
PERFECT = replace(
    PARAMETERS.depth, sigma=0.0, step=0.0, shadow=0.0, dropout=(0.0, 0.0), blotches=(0, 0)
)


def rng(seed=1):
    return np.random.default_rng(seed)


def grey(value=120):
    return np.full((*SHAPE, 3), value, np.uint8)


def test_grain_has_its_strength_and_differs_from_picture_to_picture():
    lens = ColourLens(LENS, replace(QUIET, grain=(4.0, 4.0)), 1.0, rng())
    first, second = (lens.spoil(grey()).astype(float) for _ in range(2))
    assert first.std() == pytest.approx(4.0, abs=0.2)
    assert np.abs(first - second).mean() > 2.0
    assert first.mean() == pytest.approx(120.0, abs=4.0)


def test_exposure_makes_pictures_brighter_and_never_wraps_round():
    lens = ColourLens(LENS, replace(QUIET, grain=(9.0, 9.0)), 2.0, rng())
    assert lens.spoil(grey(60)).mean() == pytest.approx(120.0, abs=4.0)
    assert lens.spoil(grey(250)).min() == 255
    assert lens.spoil(grey(0)).max() < 60


def test_corners_are_darker():
    picture = ColourLens(LENS, replace(QUIET, vignette=(0.2, 0.2)), 1.0, rng()).spoil(grey())
    assert picture[120, 160, 0] - picture[0, 0, 0] == pytest.approx(24, abs=2)


def test_blur_softens_an_edge():
    edge = grey(0)
    edge[:, 160:] = 200
    soft = ColourLens(LENS, replace(QUIET, blur=(0.8, 0.8)), 1.0, rng()).spoil(edge)
    assert 10 < soft[100, 159, 0] < 100 < soft[100, 160, 0] < 190


def test_what_moves_is_smeared_along_its_way_and_nowhere_else():
    picture = grey(0)
    picture[:, 160] = 255
    picture[50, :] = 255
    across = smeared(picture, Smear((160.0, 120.0), (50.0, 50.0), (6.0, 0.0)))
    assert (across[120, 150:170, 0] > 0).sum() in (6, 7)
    assert (across[50] == picture[50]).all()  # outside of the part
    assert smeared(picture, Smear((160.0, 120.0), (50.0, 50.0), (0.4, 0.0))) is picture
    assert smeared(picture, Smear((-900.0, 0.0), (50.0, 50.0), (9.0, 0.0))) is picture


def test_depth_noise_grows_with_the_square_of_the_distance():
    sensor = DepthSensor(LENS, replace(PERFECT, sigma=0.0015), rng())
    for distance in (0.8, 1.6):
        depth = sensor.spoil(np.full(SHAPE, distance, np.float32))
        assert np.nanstd(depth) == pytest.approx(0.0015 * distance**2, rel=0.15)
        assert np.nanmean(depth) == pytest.approx(distance, abs=0.001)


def test_depth_comes_in_steps():
    sensor = DepthSensor(LENS, replace(PERFECT, step=0.003, sigma=0.001), rng())
    values = np.unique(sensor.spoil(np.full(SHAPE, 1.0, np.float32)).round(5))
    np.testing.assert_allclose(np.diff(values), 0.003, atol=2e-5)


def test_there_is_no_depth_near_far_and_at_edges():
    depth = np.full(SHAPE, 1.0, np.float32)
    depth[:50], depth[190:] = 0.3, 5.0
    depth[100:150, 100:150] = 0.9
    seen = DepthSensor(LENS, PERFECT, rng()).spoil(depth)
    assert seen.dtype == np.float32
    assert np.isnan(seen[:50]).all()
    assert np.isnan(seen[190:]).all()
    assert np.isnan(seen[125, 100])
    assert seen[125, 125] == pytest.approx(0.9)
    assert seen[75, 125] == pytest.approx(1.0)


def test_what_is_near_throws_a_shadow_to_one_side():
    depth = np.full(SHAPE, 1.0, np.float32)
    depth[100:150, 150:200] = 0.7
    bare = np.isnan(DepthSensor(LENS, PERFECT, rng()).spoil(depth))
    shaded = np.isnan(DepthSensor(LENS, replace(PERFECT, shadow=42.8), rng()).spoil(depth))
    more = np.flatnonzero((shaded & ~bare)[125])
    assert len(more) > 8  # 42.8 (1 / 0.7 - 1) is 18 pixels
    assert more.max() < 150


def test_pixels_drop_out_at_their_rate():
    sensor = DepthSensor(LENS, replace(PERFECT, dropout=(0.01, 0.01)), rng())
    holes = np.isnan(sensor.spoil(np.full(SHAPE, 1.0, np.float32)))
    assert holes.mean() == pytest.approx(0.01, rel=0.15)
