# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of the cell: places, depth, colours and markers are where projection says."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from camera_helpers import (
    BELT_CUBE,
    GEOMETRY,
    LINKS,
    PARAMETERS,
    SCENES,
    small,
)
from cell_helpers import SRC, B, G, R

from fabric_sim.camera.looks import Appearance
from fabric_sim.camera.mjcf import model_of
from fabric_sim.camera.place import turn
from fabric_sim.camera.renderer import CellRenderer
from fabric_sim.camera.scene import Scene, SceneCube
from fabric_sim.camera.smear import hand_smear, head_smear

SMALL = small()
CELL = SRC.parent / "launch" / "config" / "cell.yaml"
LIMITS = SRC / "fabric_dobot_driver" / "config" / "magician.yaml"
HUES = {R: (172, 8), G: (52, 72), B: (102, 120)}  # OpenCV's, of 180


@pytest.fixture(scope="module")
def pictures():
    """What one run's cameras see, perfect and spoilt, by scene; a process has one renderer."""
    renderer = CellRenderer(GEOMETRY, LINKS, SMALL, seed=101)
    clean = {name: renderer.render_clean(scene) for name, scene in SCENES.items()}
    spoilt = {name: renderer.render(scene) for name, scene in SCENES.items()}
    renderer.close()
    return clean, spoilt


@pytest.fixture(scope="module")
def heads():
    """Head pictures of full size by yaw in rad."""
    renderer = CellRenderer(GEOMETRY, LINKS, PARAMETERS, seed=102)
    yaws = (-1.2, -0.6, 0.0, 0.3, 1.0)
    seen = {yaw: renderer.render(Scene(yaw=yaw, pitch=0.3)).head for yaw in yaws}
    renderer.close()
    return seen


def project(lens, point):
    """Pixel (u, v) and depth of a point in the cell."""
    x, y, z = (np.array(point) - lens.pose[:3, 3]) @ lens.pose[:3, :3]
    return round(lens.focal * x / z + lens.K[0, 2]), round(lens.focal * y / z + lens.K[1, 2]), z


def find(picture, colour):
    """Mask of a cube's colour."""
    hsv = cv2.cvtColor(picture, cv2.COLOR_BGR2HSV)
    low, high = HUES[colour]
    hue = hsv[..., 0]
    inside = (hue >= low) | (hue <= high) if low > high else (hue >= low) & (hue <= high)
    return inside & (hsv[..., 1] > 110) & (hsv[..., 2] > 40)


def test_pictures_have_their_shapes(pictures):
    for frame in pictures[1].values():
        assert frame.rgb.shape == frame.head.shape == (240, 320, 3)
        assert frame.rgb.dtype == frame.head.dtype == np.uint8
        assert frame.depth.shape == (240, 320)
        assert frame.depth.dtype == np.float32


@pytest.mark.parametrize("place", [(0.281, -0.05, 0.122), (-0.20, 0.20, 0.0), (-0.05, 0.38, 0.0)])
def test_depth_is_the_distance_along_the_optical_axis(pictures, place):
    u, v, z = project(SMALL.cell, place)
    assert pictures[0]["away"].depth[v, u] == pytest.approx(z, abs=0.003)
    assert np.nanmedian(pictures[1]["away"].depth[v - 3 : v + 4, u - 3 : u + 4]) == pytest.approx(
        z, abs=0.012
    )


@pytest.mark.parametrize("number", range(3))
def test_cubes_have_their_colours_where_they_lie(pictures, number):
    cube = SCENES["colours"].cubes[number]
    u, v, z = project(SMALL.cell, (*cube.position[:2], 0.147))
    for frames in pictures:
        mask = find(frames["colours"].rgb, cube.colour)
        rows, columns = np.nonzero(mask[v - 12 : v + 13, u - 12 : u + 13])
        assert mask[v, u]
        assert columns.mean() == pytest.approx(12.0, abs=1.5)
        assert rows.mean() == pytest.approx(12.0, abs=1.5)
    assert pictures[0]["colours"].depth[v, u] == pytest.approx(z, abs=0.004)


def test_a_cube_is_as_large_as_it_is(pictures):
    look = Appearance.draw(SMALL.looks, GEOMETRY, 101)
    edge = GEOMETRY.edge * look.cube_size
    _, _, z = project(SMALL.cell, BELT_CUBE.position)
    area = find(pictures[0]["work"].rgb, G).sum()
    assert area == pytest.approx((SMALL.cell.focal * edge / z) ** 2, rel=0.35)
    assert 0.025 <= edge <= 0.030


def test_the_yellow_glove_is_where_the_hand_is_and_goes_with_it(pictures):
    u, v, z = project(SMALL.cell, SCENES["work"].hand)
    hsv = cv2.cvtColor(pictures[1]["work"].rgb, cv2.COLOR_BGR2HSV)
    assert 20 <= hsv[v, u, 0] <= 32
    assert hsv[v, u, 1] > 120
    assert pictures[0]["work"].depth[v, u] == pytest.approx(z - 0.02, abs=0.03)
    gone = cv2.cvtColor(pictures[1]["away"].rgb, cv2.COLOR_BGR2HSV)
    assert not (20 <= gone[v, u, 0] <= 32 and gone[v, u, 1] > 120)


def test_trays_stand_for_their_scenario_only(pictures):
    tray = GEOMETRY.trays("inspection")[0]
    u, v, z = project(SMALL.cell, tray.floor)
    assert pictures[0]["away"].depth[v, u] == pytest.approx(z, abs=0.003)
    wall = (tray.floor.x, tray.floor.y + tray.size[1] / 2, tray.floor.z + 0.032)
    u, v, z = project(SMALL.cell, wall)
    assert pictures[0]["away"].depth[v - 1 : v + 2, u].min() == pytest.approx(z, abs=0.006)


def test_depth_has_holes_and_colours_have_grain(pictures):
    clean, spoilt = (frames["work"] for frames in pictures)
    assert not np.isnan(clean.depth).any()
    assert 0.005 < np.isnan(spoilt.depth).mean() < 0.35
    assert np.abs(clean.rgb.astype(int) - spoilt.rgb).mean() > 1.0


def test_markers_are_found_where_the_helmet_holds_them(heads):
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    for yaw, picture in heads.items():
        corners, ids, _ = cv2.aruco.detectMarkers(
            cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), dictionary
        )
        assert ids is not None, f"no marker is seen at {yaw} rad"
        plain = 0
        for quad, number in zip(corners, ids.ravel(), strict=True):
            expected = corners_of(number, yaw)
            if edges_of(expected).min() > 45.0:  # others are seen too much from the side
                np.testing.assert_allclose(quad[0], expected, atol=2.0)
                plain += 1
        assert plain


def corners_of(number, yaw):
    """Pixels of a marker's corners, clockwise from its top left."""
    plate = next(plate for plate in PARAMETERS.plates if plate.id == number)
    half = plate.size / 2
    own = np.array([(0, -half, half), (0, half, half), (0, half, -half), (0, -half, -half)])
    helmet = own @ plate.pose[:3, :3].T + plate.pose[:3, 3]
    R = turn("z", GEOMETRY.person.yaw + yaw) @ turn("y", 0.3)
    lens = PARAMETERS.head
    seen = (helmet @ R.T + Scene().head - lens.pose[:3, 3]) @ lens.pose[:3, :3]
    return lens.focal * seen[:, :2] / seen[:, 2:] + lens.K[:2, 2]


def edges_of(quad):
    """Lengths of the edges of four corners, pixels."""
    return np.linalg.norm(quad - np.roll(quad, 1, axis=0), axis=1)


def test_a_marker_that_faces_the_camera_is_large_enough_to_be_measured(heads):
    assert set(heads) == {-1.2, -0.6, 0.0, 0.3, 1.0}
    for number, yaw in ((0, -0.6), (1, 0.6), (2, -1.57), (3, 1.57)):
        assert edges_of(corners_of(number, yaw)).mean() >= 80.0


def test_equal_seeds_look_alike_and_others_do_not():
    draw = [Appearance.draw(SMALL.looks, GEOMETRY, seed) for seed in (101, 101, 102)]
    texts = [model_of(GEOMETRY, LINKS, SMALL, look) for look in draw]
    assert texts[0] == texts[1]
    assert texts[0].xml != texts[2].xml
    assert texts[0].assets["table.png"] != texts[2].assets["table.png"]


def test_the_same_seed_renders_the_same_pictures(pictures):
    renderer = CellRenderer.of_files(CELL, LIMITS, SMALL, seed=101)
    again = {name: renderer.render(scene) for name, scene in SCENES.items()}
    with pytest.raises(ValueError, match="scenario is 'cooking'; allowed: inspection, sorting"):
        renderer.render(Scene(scenario="cooking"))
    with pytest.raises(ValueError, match="25 cubes are too many: 24 can be shown"):
        renderer.render(Scene(cubes=(SceneCube(R, (0.0, 0.0, 0.0), 0.0),) * 25))
    renderer.close()
    for name, frame in again.items():
        for ours, theirs in zip(frame, pictures[1][name], strict=True):
            np.testing.assert_array_equal(ours, theirs)


@pytest.mark.parametrize(
    ("words", "named"),
    [({"dictionary": "SQUARES"}, "'SQUARES'"), ({"dictionary": "DICT_9X9"}, "'DICT_9X9'")],
)
def test_markers_of_no_dictionary_are_refused(words, named):
    look = Appearance.draw(SMALL.looks, GEOMETRY, 101)
    with pytest.raises(ValueError, match=named):
        model_of(GEOMETRY, LINKS, replace(SMALL, **words), look)


def test_a_marker_that_a_dictionary_does_not_hold_is_refused():
    look = Appearance.draw(SMALL.looks, GEOMETRY, 101)
    plates = (PARAMETERS.plates[0]._replace(id=50),)
    with pytest.raises(ValueError, match="marker 50 is not in DICT_4X4_50: it has 50"):
        model_of(GEOMETRY, LINKS, replace(SMALL, plates=plates), look)


def test_what_moves_is_smeared_by_as_much_as_it_moves():
    before = Scene(hand=(0.40, 0.0, 0.2), t=1.0)
    now = before._replace(hand=(0.50, 0.0, 0.2), t=1.1)  # 1 m/s
    (smear,) = hand_smear(PARAMETERS.cell, before, now, 0.008)
    assert np.hypot(*smear.way) == pytest.approx(570.0 * 0.008 / 0.88, rel=0.05)
    (turning,) = head_smear(PARAMETERS.head, before, now._replace(yaw=0.2), 0.008)
    assert abs(turning.way[0]) > 2.5
    assert hand_smear(PARAMETERS.cell, None, now, 0.008) == []
    assert hand_smear(PARAMETERS.cell, before._replace(t=-9.0), now, 0.008) == []
