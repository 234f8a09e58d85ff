# SPDX-License-Identifier: BSD-3-Clause
"""Calibration files of cameras."""

import math

import numpy as np
import pytest
import yaml
from head_scene import camera

from fabric_perception import camera_info
from fabric_perception.camera import Camera, CameraError

ENTRY = camera_info.entry_of("head", camera_info.info_of(camera(), ""))


def loaded(tmp_path, **changes):
    path = tmp_path / "info.yaml"
    held = {key: value for key, value in {**ENTRY, **changes}.items() if value is not None}
    path.write_text(yaml.safe_dump(held))
    return camera_info.load_camera_info(path, "head_camera_optical_frame")


def matrix(*data) -> dict:
    return {"rows": 3, "cols": 3, "data": list(data)}


def test_a_file_in_the_layout_of_rosbag_tools_is_taken(tmp_path):
    info = loaded(tmp_path)
    assert info.header.frame_id == "head_camera_optical_frame"
    found = Camera.from_camera_info(info, np.eye(4))
    assert np.allclose(found.K, camera().K)
    assert (found.width, found.height) == (640, 480)


def test_what_may_be_missing_is_filled_in(tmp_path):
    info = loaded(tmp_path, rectification_matrix=None, projection_matrix=None, camera_name=None)
    assert list(info.R) == np.eye(3).ravel().tolist()
    assert np.reshape(info.P, (3, 4))[:, :3].tolist() == camera().K.tolist()


def test_a_matrix_of_zeros_is_refused_with_a_sentence(tmp_path):
    with pytest.raises(CameraError, match="info.yaml: the camera '.*' is not calibrated: K of"):
        loaded(tmp_path, camera_matrix=matrix(*[0.0] * 9))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"image_width": 0}, "image_width is 0"),
        ({"image_height": "480"}, "image_height is '480'"),
        ({"camera_matrix": None}, "camera_matrix is missing"),
        ({"camera_matrix": matrix(1.0, 2.0)}, "camera_matrix has 2 numbers, not 9"),
        ({"camera_matrix": matrix(*[math.nan] * 9)}, r"camera_matrix\[0\] is nan"),
        ({"distortion_coefficients": {"data": [0.1, "x"]}}, r"distortion_coefficients\[1\] is 'x'"),
        ({"distortion_model": "fisheye"}, "lens model 'fisheye' is not known"),
    ],
)
def test_a_broken_file_is_refused_by_element(tmp_path, changes, words):
    with pytest.raises(CameraError, match=words) as error:
        loaded(tmp_path, **changes)
    assert "info.yaml: " in str(error.value)


def test_a_file_that_is_none_is_refused(tmp_path):
    with pytest.raises(CameraError, match="cannot be read"):
        camera_info.load_camera_info(tmp_path / "none.yaml", "f")
    (tmp_path / "list.yaml").write_text("[1, 2]")
    with pytest.raises(CameraError, match="holds no calibration"):
        camera_info.load_camera_info(tmp_path / "list.yaml", "f")
