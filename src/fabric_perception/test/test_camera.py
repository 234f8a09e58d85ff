# SPDX-License-Identifier: BSD-3-Clause
"""Pixels to points and back."""

import math

import cv2
import numpy as np
import pytest
from sensor_msgs.msg import CameraInfo

from fabric_perception.camera import Camera, CameraError

K = np.array([[570.0, 0.0, 319.5], [0.0, 572.0, 239.5], [0.0, 0.0, 1.0]])
LENS = (0.11, -0.23, 0.001, -0.002, 0.05)


def pose(rotation_vector=(0.0, 0.0, 0.0), position=(0.0, 0.0, 0.0)) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3] = cv2.Rodrigues(np.array(rotation_vector, dtype=float))[0]
    matrix[:3, 3] = position
    return matrix


def info(**changes) -> CameraInfo:
    message = CameraInfo(width=640, height=480, distortion_model="plumb_bob")
    message.K, message.D = K.ravel().tolist(), list(LENS)
    message.header.frame_id = "cell_camera_color_optical_frame"
    for name, value in changes.items():
        setattr(message, name, value)
    return message


def test_a_point_on_the_axis_falls_on_the_principal_point():
    camera = Camera(K, 640, 480, np.eye(4))
    assert np.allclose(camera.project([[0.0, 0.0, 2.0]]), [[319.5, 239.5]])


def test_pixels_follow_the_pinhole_equation_worked_by_hand():
    camera = Camera(K, 640, 480, np.eye(4))
    expected = [319.5 + 570.0 * 0.1 / 2.0, 239.5 + 572.0 * -0.2 / 2.0]
    assert np.allclose(camera.project([[0.1, -0.2, 2.0]]), [expected])


def test_a_camera_that_looks_down_sees_the_table_below_it():
    down = pose((math.pi, 0.0, 0.0), (0.3, 0.1, 1.2))
    camera = Camera(K, 640, 480, down)
    assert np.allclose(camera.deproject([[319.5, 239.5]], [1.2]), [[0.3, 0.1, 0.0]])
    assert np.allclose(camera.position, (0.3, 0.1, 1.2))


@pytest.mark.parametrize("distortion", [(), LENS, (*LENS, 0.01, 0.02, 0.003)])
def test_deproject_undoes_project(distortion):
    rng = np.random.default_rng(3)
    camera = Camera(K, 640, 480, pose((0.4, -2.0, 0.7), (0.5, -0.3, 1.1)), distortion)
    depth = rng.uniform(0.5, 2.0, 50)
    pixels = rng.uniform((40, 40), (600, 440), (50, 2))
    points = camera.deproject(pixels, depth)
    assert np.allclose(camera.project(points), pixels, atol=0.01)
    assert np.allclose(camera.to_camera(points)[:, 2], depth)


def test_what_is_not_before_the_camera_has_no_pixel():
    camera = Camera(K, 640, 480, np.eye(4))
    pixels = camera.project([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.1, 0.1, 0.0]])
    assert np.isfinite(pixels[0]).all()
    assert np.isnan(pixels[1:]).all()


def test_a_hole_in_the_depth_has_no_point():
    camera = Camera(K, 640, 480, np.eye(4))
    points = camera.deproject(np.full((4, 2), 100.0), [1.0, np.nan, 0.0, -1.0])
    assert np.isfinite(points[0]).all()
    assert np.isnan(points[1:]).all()


def test_no_points_are_no_pixels():
    camera = Camera(K, 640, 480, np.eye(4), LENS)
    assert camera.project(np.empty((0, 3))).shape == (0, 2)
    assert camera.deproject(np.empty((0, 2)), []).shape == (0, 3)


def test_pixels_and_depths_must_be_as_many():
    with pytest.raises(ValueError, match="2 pixels cannot have 1 depths"):
        Camera(K, 640, 480, np.eye(4)).deproject([[1, 2], [3, 4]], [1.0])


def test_camera_info_is_taken_as_it_is():
    camera = Camera.from_camera_info(info(), pose(position=(1.0, 2.0, 3.0)))
    assert np.array_equal(camera.K, K)
    assert (camera.width, camera.height, camera.distortion) == (640, 480, LENS)
    assert np.array_equal(camera.position, (1.0, 2.0, 3.0))


def test_a_camera_that_was_never_calibrated_is_refused_with_a_sentence():
    with pytest.raises(CameraError, match="'cell_camera_color_optical_frame' is not calibrated"):
        Camera.from_camera_info(info(K=[0.0] * 9), np.eye(4))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"K": [math.nan] * 9}, r"K\[0\]\[0\] is nan"),
        ({"K": [-570.0, 0, 1, 0, 570.0, 1, 0, 0, 1]}, "focal lengths"),
        ({"K": [570.0, 0, 1, 0, 570.0, 1, 0, 0, 0]}, "no camera matrix"),
        ({"width": 0}, "0x480 pixels is empty"),
        ({"distortion_model": "equidistant"}, "'equidistant' is not known"),
        ({"D": [0.1, 0.2]}, "2 coefficients"),
        ({"D": [0.1, 0.2, math.inf, 0.0, 0.0]}, r"distortion\[2\] is inf"),
        ({"binning_x": 2}, "binning 2x0"),
    ],
)
def test_a_broken_camera_info_is_refused_by_name(changes, words):
    with pytest.raises(CameraError, match=words):
        Camera.from_camera_info(info(**changes), np.eye(4))


@pytest.mark.parametrize(
    ("matrix", "words"),
    [
        (np.eye(3), r"shape \(3, 3\), not \(4, 4\)"),
        (np.diag([1.0, 1.0, -1.0, 1.0]), "no rotation"),
        (np.diag([2.0, 2.0, 2.0, 1.0]), "no rotation"),
        (np.ones((4, 4)) * np.nan, r"pose_in_cell\[0\]\[0\] is nan"),
    ],
)
def test_a_pose_that_is_not_rigid_is_refused(matrix, words):
    with pytest.raises(CameraError, match=words):
        Camera(K, 640, 480, matrix)
