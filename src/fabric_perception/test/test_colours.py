# SPDX-License-Identifier: BSD-3-Clause
"""Limits of colours: red's wrap, files, the fast masks against OpenCV's, tuning."""

import importlib.util

import cv2
import numpy as np
import pytest
from drawn import COLOURS, PAINT, ROOT, YELLOW, camera, palette, workspace

from fabric_perception.tracking.colours import CUBES, Limits, Palette
from fabric_perception.tracking.segmentation import Segmenter, plain_masks
from fabric_perception.tracking.settings import SettingsError
from fabric_perception.tracking.tuning import Tuner, TuningError, sample, suggest
from fabric_perception.tracking.workspace import flat_depth

TOOL = ROOT / "src/fabric_perception/nodes/tune_colours.py"


def hsv_patch(hues, saturation=200, value=180):
    """BGR picture (40, n, 3) whose columns have these hues."""
    hsv = np.zeros((40, len(hues), 3), np.uint8)
    hsv[..., 0], hsv[..., 1], hsv[..., 2] = np.array(hues) % 180, saturation, value
    return cv2.cvtColor(hsv, cv2.COLOR_HSV2BGR)


def test_red_is_found_on_both_sides_of_the_wrap():
    picture = hsv_patch(list(range(172, 188)) * 3)
    masks = Segmenter(palette()).masks(picture, np.ones(picture.shape[:2], np.float32))
    assert (masks["red"] > 0).all()
    assert not masks["glove"].any()


def test_the_masks_are_those_of_plain_opencv():
    rng = np.random.default_rng(104)
    picture = cv2.GaussianBlur(rng.integers(0, 256, (480, 640, 3), dtype=np.uint8), (0, 0), 3)
    picture = cv2.convertScaleAbs(picture, alpha=6.0, beta=-640.0)
    fast = Segmenter(palette()).masks(picture, np.ones((480, 640), np.float32))
    plain = plain_masks(picture, palette())
    for name, mask in plain.items():
        assert mask.any()
        assert (fast[name] == mask).all()


def test_paint_on_the_table_is_ground_and_holes_in_the_depth_are_not():
    view, cell = camera(), workspace()
    flat = flat_depth(cell, view, 0.008)
    ground = flat_depth(cell, view, 0.0)
    picture = np.full((480, 640, 3), PAINT[1], np.uint8)
    segmenter = Segmenter(palette(), flat)
    borders = np.count_nonzero(segmenter.masks(picture, ground)["red"])
    assert borders < 0.01 * ground.size  # sides of belt and containers
    ground[100:120, 20:40] = np.nan
    assert np.count_nonzero(segmenter.masks(picture, ground)["red"]) == borders + 400


def test_a_palette_survives_its_file(tmp_path):
    path = tmp_path / "colours.yaml"
    palette().save(path)
    assert Palette.load(path).limits == palette().limits
    assert path.read_text() == COLOURS.read_text()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("colours: 3", "colours is 3"),
        ("{", "is not YAML"),
        ("colours: {red: {hue: [0, 10], saturation: [0, 255]}}", "colours.red.value is missing"),
        ("colours: {red: {hue: [0, 190], saturation: [0, 255], value: [0, 255]}}", "red.hue"),
        ("colours: {red: {hue: [0, 9], saturation: [200, 100], value: [0, 255]}}", "missing"),
    ],
)
def test_files_of_colours_are_refused_by_entry(tmp_path, text, words):
    path = tmp_path / "colours.yaml"
    path.write_text(text)
    with pytest.raises(SettingsError, match=words):
        Palette.load(path)


def test_two_colours_may_not_share_a_hue():
    limits = palette().limits | {"glove": Limits((5, 30), (100, 255), (50, 255))}
    with pytest.raises(SettingsError, match="hue 5 is both red and glove"):
        Palette(limits)


@pytest.mark.parametrize("middle", [0, 25, 60, 115, 178])
def test_suggested_limits_hold_the_samples_and_little_else(middle):
    rng = np.random.default_rng(middle)
    hues = np.rint(rng.normal(middle, 2.0, 400)).astype(int) % 180
    hsv = np.column_stack([hues, rng.integers(150, 250, 400), rng.integers(100, 200, 400)])
    limits = suggest(hsv.astype(np.uint8))
    assert limits.matches(hsv.astype(np.uint8)).mean() > 0.97
    assert limits.hues().sum() < 26
    assert limits.hues()[middle % 180]


@pytest.mark.parametrize("name", ["red", "green", "blue"])
def test_a_click_on_a_cube_gives_limits_that_find_it(name):
    picture = np.full((100, 100, 3), 120, np.uint8)
    picture[40:60, 40:60] = PAINT[CUBES[name]]
    tuner = Tuner(palette())
    tuner.add(name, picture, (50, 50))
    assert np.count_nonzero(plain_masks(picture, tuner.palette)[name]) == 400


def test_bad_samples_are_refused_and_leave_the_limits():
    picture = np.full((100, 100, 3), 120, np.uint8)
    picture[:50] = YELLOW
    tuner = Tuner(palette())
    for name, box, words in (
        ("pink", (5, 5), "unknown colour 'pink'"),
        ("red", (500, 5), "not in the picture of 100x100"),
        ("red", (5, 5, 2, 2), "4 pixels are too few"),
        ("red", (60, 80), "grey"),
        ("red", (1, 2, 3), "not 3 numbers"),
        ("red", (20, 20), "is both red and glove"),
    ):
        with pytest.raises(ValueError, match=words):
            tuner.add(name, picture, box)
    assert tuner.palette.limits == palette().limits
    with pytest.raises(TuningError):
        sample(picture, (0, 0, 0, 5))


@pytest.fixture(scope="module")
def tool():
    spec = importlib.util.spec_from_file_location("tune_colours", TOOL)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_tool_saves_limits_from_samples_without_a_window(tool, tmp_path, capsys):
    picture = np.full((100, 100, 3), 120, np.uint8)
    picture[40:60, 40:60] = PAINT[3]
    cv2.imwrite(str(tmp_path / "a.png"), picture)
    out, preview = tmp_path / "mine.yaml", tmp_path / "preview.png"
    words = [str(COLOURS), str(tmp_path), "--out", str(out), "--preview", str(preview)]
    assert tool.main([*words, "--sample", "blue:50,50"]) == 0
    assert Palette.load(out).limits["blue"] != palette().limits["blue"]
    assert f"saved {out}" in capsys.readouterr().out
    assert cv2.imread(str(preview)).shape == (100, 200, 3)


def test_the_tool_refuses_what_it_cannot_use_and_saves_nothing(tool, tmp_path, capsys):
    colours = tmp_path / "colours.yaml"
    colours.write_text(COLOURS.read_text())
    (tmp_path / "empty").mkdir()
    (tmp_path / "text.png").write_text("no picture")
    for words, told in (
        (["empty"], "no picture in"),
        (["text.png"], "is no picture"),
        (["none.png"], "does not exist"),
    ):
        paths = [str(tmp_path / word) for word in words]
        assert tool.main([str(colours), *paths, "--sample", "red:5,5"]) == 2
        assert told in capsys.readouterr().err
    assert colours.read_text() == COLOURS.read_text()
