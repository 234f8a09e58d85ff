# SPDX-License-Identifier: BSD-3-Clause
"""The markers on the helmet."""

import math

import numpy as np
import pytest
import yaml
from head_scene import CONFIG, HELMET

from fabric_perception.head.helmet import HelmetError, load_helmet, marker_of, rotation

MARKER = {"id": 4, "size": 0.05, "position": [0.1, 0.0, 0.0], "yaw": 0.0, "pitch": 0.0, "roll": 0.0}


def test_a_frontal_markers_corners_run_clockwise_for_who_looks_at_it():
    corners = marker_of(MARKER).corners
    # Who faces the helmet has its left (+y) on the right.
    assert np.allclose(
        corners,
        [[0.1, -0.025, 0.025], [0.1, 0.025, 0.025], [0.1, 0.025, -0.025], [0.1, -0.025, -0.025]],
    )


def test_a_negative_pitch_faces_upwards_and_a_positive_yaw_to_the_left():
    face = marker_of({**MARKER, "yaw": 0.5, "pitch": -0.3}).pose[:3, 0]
    assert face[1] > 0.0
    assert face[2] == pytest.approx(math.sin(0.3))


def test_rotations_are_those_of_rep_103():
    R = rotation(0.3, -0.4, 0.5)
    z = [[math.cos(0.3), -math.sin(0.3), 0], [math.sin(0.3), math.cos(0.3), 0], [0, 0, 1]]
    y = [[math.cos(0.4), 0, -math.sin(0.4)], [0, 1, 0], [math.sin(0.4), 0, math.cos(0.4)]]
    x = [[1, 0, 0], [0, math.cos(0.5), -math.sin(0.5)], [0, math.sin(0.5), math.cos(0.5)]]
    assert np.allclose(R, np.array(z) @ np.array(y) @ np.array(x))


def test_the_shipped_markers_do_not_overlap_and_face_outwards():
    for marker in HELMET.markers.values():
        assert marker.pose[:3, 0] @ marker.pose[:3, 3] > 0.0
    places = [marker.pose[:3, 3] for marker in HELMET.markers.values()]
    apart = [np.linalg.norm(a - b) for i, a in enumerate(places) for b in places[:i]]
    assert min(apart) > 1.3 * max(marker.size for marker in HELMET.markers.values())


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"id": -1}, "marker 1: id is -1"),
        ({"id": True}, "marker 1: id is True"),
        ({"size": 0.0}, "marker 1: size is 0.0"),
        ({"size": math.nan}, "marker 1: size is nan"),
        ({"yaw": "east"}, "marker 1: yaw is 'east'"),
        ({"position": [0, 0]}, r"marker 1: position is \[0, 0\]"),
        ({"position": [0, math.inf, 0]}, r"marker 1: position\[1\] is inf"),
        ({"tilt": 1.0}, "marker 1: is .* must have id, size"),
    ],
)
def test_a_broken_marker_is_refused_by_file_number_and_element(tmp_path, changes, words):
    path = tmp_path / "helmet.yaml"
    path.write_text(yaml.safe_dump({"dictionary": "D", "markers": [{**MARKER, **changes}]}))
    with pytest.raises(HelmetError, match=words) as error:
        load_helmet(path)
    assert str(path) in str(error.value)


@pytest.mark.parametrize(
    ("held", "words"),
    [
        (None, "a dictionary and markers"),
        ({"dictionary": "D", "markers": []}, "needs a list of markers"),
        ({"dictionary": "D", "markers": [MARKER, MARKER]}, "marker 2: id 4 is there already"),
    ],
)
def test_a_file_that_holds_no_helmet_is_refused(tmp_path, held, words):
    path = tmp_path / "helmet.yaml"
    path.write_text(yaml.safe_dump(held))
    with pytest.raises(HelmetError, match=words):
        load_helmet(path)
    with pytest.raises(HelmetError, match="cannot be read"):
        load_helmet(CONFIG / "no_such_helmet.yaml")
