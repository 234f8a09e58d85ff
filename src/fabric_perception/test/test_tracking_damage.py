# SPDX-License-Identifier: BSD-3-Clause
"""Damaged input is refused with a sentence, and what was known stays known."""

import math
from dataclasses import replace

import numpy as np
import pytest
from drawn import CELL, Painter, camera, palette, workspace

from fabric_msgs.msg import Cube
from fabric_msgs.settings import settings_from
from fabric_perception.tracking.health import ERROR, OK, WARN, Health
from fabric_perception.tracking.images import ImageError
from fabric_perception.tracking.parameters import TrackingParameters
from fabric_perception.tracking.pipeline import Tracking
from fabric_perception.tracking.settings import SettingsError
from fabric_perception.tracking.workspace import Workspace

AT_PICK_POINT = np.array([0.281, 0.035, 0.1345])


@pytest.fixture(scope="module")
def pictures():
    painter = Painter(camera(), workspace(), seed=102)
    painter.cube(Cube.COLOUR_BLUE, AT_PICK_POINT).glove((0.6, 0.2, 0.06))
    return painter.picture(noise=2.0, blur=0.6, depth_noise=0.001)


def started(pictures):
    tracking = Tracking(camera(), workspace(), palette())
    for k in range(6):
        seen = tracking.step(0.1 * k, *pictures)
    assert len(seen.cubes) == 1
    return tracking


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda b, d: (b[:0], d), "colour picture is empty"),
        (lambda b, d: (b[::2, ::2].copy(), d), r"colour picture has shape \(240, 320, 3\)"),
        (lambda b, d: (b[:, :, 0].copy(), d), r"colour picture has shape \(480, 640\)"),
        (lambda b, d: (b.astype(np.float32), d), "colour picture holds float32"),
        (lambda b, d: (None, d), "colour picture is NoneType"),
        (lambda b, d: (b, d[:, :100].copy()), r"depth picture has shape \(480, 100\)"),
        (lambda b, d: (b, d.astype(np.uint16)), "depth picture holds uint16"),
    ],
)
def test_pictures_of_another_kind_are_refused_and_change_nothing(pictures, spoil, words):
    tracking = started(pictures)
    before = tracking.cubes.tracks[1].position
    with pytest.raises(ImageError, match=words):
        tracking.step(1.0, *spoil(*pictures))
    assert (tracking.cubes.tracks[1].position == before).all()
    assert len(tracking.step(1.0, *pictures).cubes) == 1


@pytest.mark.parametrize("t", [0.5, 0.1, math.nan, math.inf])
def test_stamps_that_do_not_follow_are_refused(pictures, t):
    tracking = started(pictures)
    with pytest.raises(ImageError, match="come after|stamp"):
        tracking.step(t, *pictures)


def test_after_a_restart_pictures_may_be_older(pictures):
    tracking = started(pictures)
    tracking.restart()
    assert tracking.step(0.05, *pictures).cubes == []


@pytest.mark.parametrize("nothing", [np.nan, 0.0])
def test_without_any_depth_cubes_are_placed_on_the_ground_they_lie_on(pictures, nothing):
    tracking = Tracking(camera(), workspace(), palette())
    blind = np.full_like(pictures[1], nothing)
    for k in range(6):
        seen = tracking.step(0.1 * k, pictures[0], blind)
    assert np.linalg.norm(seen.cubes[0].position - AT_PICK_POINT) < 0.010
    assert seen.hand is None
    assert seen.refusals[0].reason == "no depth"


def test_pictures_of_noise_make_no_cube_and_no_hand():
    rng = np.random.default_rng(103)
    tracking = Tracking(camera(), workspace(), palette())
    for k in range(5):
        bgr = rng.integers(0, 256, (480, 640, 3), dtype=np.uint8)
        depth = rng.uniform(0.0, 2.0, (480, 640)).astype(np.float32)
        seen = tracking.step(0.1 * k, bgr, depth)
    assert seen.cubes == []
    assert seen.hand is None


@pytest.mark.parametrize("grey", [0, 255])
def test_black_and_white_pictures_are_an_empty_cell(grey):
    tracking = Tracking(camera(), workspace(), palette())
    bgr = np.full((480, 640, 3), grey, np.uint8)
    seen = tracking.step(0.0, bgr, np.full((480, 640), np.nan, np.float32))
    assert (seen.cubes, seen.hand, seen.detections) == ([], None, [])


def test_a_load_cell_that_does_not_exist_is_refused_by_its_number(pictures):
    with pytest.raises(ValueError, match=r"container 4 has no load cell; \[1, 2, 3\] have"):
        started(pictures).on_load_step(4, 1.0)


def test_cubes_taken_out_before_anybody_knew_them_are_forgotten(pictures):
    tracking = started(pictures)
    tracking.on_load_step(1, 1.0, 2)
    tracking.on_load_step(1, 1.2, -2)
    tracking.step(9.0, *pictures)
    assert tracking.containers.unexplained == 0


def test_cell_files_are_refused_by_file_and_entry(tmp_path):
    path = tmp_path / "cell.yaml"
    path.write_text(CELL.read_text().replace("owner: robot", "owner: nobody"))
    with pytest.raises(SettingsError, match=r"cell.yaml: scenarios.*owner is 'nobody'"):
        Workspace.load(path)
    with pytest.raises(SettingsError, match="scenarios.moon is missing"):
        Workspace.load(CELL, "moon")
    with pytest.raises(SettingsError, match="cannot be read"):
        Workspace.load(tmp_path / "none.yaml")


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"gates": 1.0}, "unknown parameter 'gates'"),
        ({"gate": "wide"}, "gate is 'wide'"),
        ({"gate": math.nan}, "gate is nan"),
        ({"least_area": 2.5}, "least_area is 2.5"),
        ({"trail": 100.0}, "trail is 100.0"),
        ({"glove_area": [0.02, 0.01]}, "glove_area"),
    ],
)
def test_parameters_are_refused_by_name(values, words):
    with pytest.raises(ValueError, match=words):
        settings_from(TrackingParameters, values)


def test_parameters_can_be_replaced_one_by_one():
    assert settings_from(TrackingParameters, {"glove_area": [0.001, 0.01]}) == replace(
        TrackingParameters(), glove_area=(0.001, 0.01)
    )


def test_refused_pictures_and_missing_depth_show_in_the_diagnostic():
    health = Health()
    assert health.status(0.0).level == ERROR
    health.take(10.0, 9.9, depth_share=1.0)
    assert health.status(10.1).level == OK
    health.refuse(10.2, "the depth picture is empty")
    assert health.status(10.3).level == WARN
    assert "the depth picture is empty" in health.status(10.3).text
    assert health.status(20.0).level == ERROR
    for k in range(30):
        health.take(20.0 + k, 20.0 + k, depth_share=0.0)
    assert "hardly any depth" in health.status(49.0).text
