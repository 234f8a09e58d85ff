# SPDX-License-Identifier: BSD-3-Clause
"""Markers are found where they are, through the old and the new calls of OpenCV."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from head_scene import HELMET, camera, head

from fabric_perception.head import aruco
from fabric_perception.head.aruco import MarkerFinder
from fabric_perception.head.picture import Optics, helmet_picture


class NewDetector:
    """OpenCV's class from 4.7 on, over the functions of the one installed."""

    def __init__(self, dictionary, parameters):
        self._old = cv2.aruco.DetectorParameters_create()
        for name, value in vars(parameters).items():
            setattr(self._old, name, value)
        self._dictionary = dictionary

    def detectMarkers(self, grey):  # noqa: N802  (OpenCV's name)
        return cv2.aruco.detectMarkers(grey, self._dictionary, parameters=self._old)


def new_library(**changes) -> SimpleNamespace:
    """What cv2.aruco looks like from 4.7 on: none of the old names."""
    names = {name: getattr(cv2.aruco, name) for name in dir(cv2.aruco) if name.isupper()}
    return SimpleNamespace(
        **{
            **names,
            "ArucoDetector": NewDetector,
            "DetectorParameters": SimpleNamespace,
            "getPredefinedDictionary": cv2.aruco.getPredefinedDictionary,
            "generateImageMarker": cv2.aruco.drawMarker,
            **changes,
        }
    )


TURNED = 0.0  # both frontal markers are seen
PICTURE = helmet_picture(camera(), HELMET, head(TURNED), seed=1)


def truth(marker: int) -> np.ndarray:
    pose = head(TURNED)
    return camera().project(HELMET.markers[marker].corners @ pose[:3, :3].T + pose[:3, 3])


def test_refined_corners_lie_within_a_quarter_of_a_pixel_of_the_truth():
    found = MarkerFinder(wanted=HELMET.markers).find(PICTURE)
    assert [marker.id for marker in found] == [0, 1]
    for marker in found:
        assert marker.refined
        error = np.sqrt(((marker.corners - truth(marker.id)) ** 2).sum(axis=1).mean())
        assert error < 0.25


def test_without_refinement_corners_are_several_times_worse():
    finder = MarkerFinder(wanted=HELMET.markers)
    plain = dict(finder._detect(finder._search, PICTURE))
    errors = [np.sqrt(((plain[i] - truth(i)) ** 2).sum(axis=1).mean()) for i in (0, 1)]
    assert min(errors) > 0.4


def test_the_new_calls_give_the_same_markers_as_the_old_ones():
    old = MarkerFinder(wanted=HELMET.markers).find(PICTURE)
    new = MarkerFinder(wanted=HELMET.markers, library=new_library()).find(PICTURE)
    assert [m.id for m in old] == [m.id for m in new] != []
    for a, b in zip(old, new, strict=True):
        assert np.array_equal(a.corners, b.corners)


def test_a_library_that_counts_pixels_as_opencv_does_is_not_shifted_again():
    class Reconciled(NewDetector):
        def detectMarkers(self, grey):  # noqa: N802
            corners, ids, rest = super().detectMarkers(grey)
            shift = 0.5 * (self._old.cornerRefinementMethod == cv2.aruco.CORNER_REFINE_APRILTAG)
            return [corner - np.float32(shift) for corner in corners], ids, rest

    plain = MarkerFinder(wanted=HELMET.markers).find(PICTURE)
    library = new_library(ArucoDetector=Reconciled)
    found = MarkerFinder(wanted=HELMET.markers, library=library).find(PICTURE)
    for a, b in zip(plain, found, strict=True):
        assert np.allclose(a.corners, b.corners, atol=1e-4)


def test_only_wanted_markers_are_found():
    assert [m.id for m in MarkerFinder(wanted=[1, 7]).find(PICTURE)] == [1]
    assert [m.id for m in MarkerFinder().find(PICTURE)] == [0, 1]


def test_a_part_of_the_picture_gives_the_same_corners():
    finder = MarkerFinder(wanted=HELMET.markers)
    whole = finder.find(PICTURE)
    low = np.min([m.corners.min(axis=0) for m in whole], axis=0) - 30
    high = np.max([m.corners.max(axis=0) for m in whole], axis=0) + 30
    part = finder.find(PICTURE, (*low.astype(int), *high.astype(int)))
    for a, b in zip(whole, part, strict=True):
        assert np.allclose(a.corners, b.corners)


@pytest.mark.parametrize("area", [(700, 0, 900, 100), (10, 10, 10, 50), (-50, -50, 0, 0)])
def test_a_part_outside_the_picture_holds_nothing(area):
    assert MarkerFinder().find(PICTURE, area) == []


def test_a_marker_seen_twice_is_left_out():
    twice = np.vstack([PICTURE[180:340], PICTURE[180:340]])
    assert MarkerFinder(wanted=HELMET.markers).find(PICTURE[180:340].copy()) != []
    assert MarkerFinder(wanted=HELMET.markers).find(twice) == []


def test_a_picture_without_markers_or_of_one_colour_holds_none():
    empty = helmet_picture(camera(), HELMET, head(np.pi), Optics(clutter=200), seed=3)
    assert MarkerFinder(wanted=HELMET.markers).find(empty) == []
    assert MarkerFinder().find(np.zeros((480, 640), np.uint8)) == []
    assert MarkerFinder().find(np.full((2, 2), 255, np.uint8)) == []


def test_cells_of_a_marker_have_a_black_border():
    cells = aruco.cells_of(aruco.dictionary_of("DICT_4X4_50"), 3)
    assert cells.shape == (6, 6)
    assert cells[0].all() and cells[-1].all() and cells[:, 0].all() and cells[:, -1].all()
    assert not cells.all()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            {"dictionary": "DICT_3X3_50"},
            "no marker dictionary 'DICT_3X3_50'; there are DICT_4X4_100",
        ),
        ({"dictionary": "detectMarkers"}, "no marker dictionary"),
        ({"window": 22}, "window is 22"),
        ({"window": 1}, "window is 1"),
        ({"wanted": [3, 50]}, "no marker 50, only 0..49"),
        ({"wanted": [-1]}, "no marker -1"),
    ],
)
def test_bad_arguments_are_refused_by_value(arguments, words):
    with pytest.raises(ValueError, match=words):
        MarkerFinder(**arguments)
