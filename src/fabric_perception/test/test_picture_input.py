# SPDX-License-Identifier: BSD-3-Clause
"""Cameras and stamps as the nodes that take pictures see them."""

import math

import numpy as np
import pytest
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import CameraInfo

from fabric_perception.camera import CameraError
from fabric_perception.picture_input import CameraSource, PictureTimes, StampError

FRAME = "cell_camera_color_optical_frame"
TOPIC = "/cell/camera/rgb/camera_info"


def info(focal: float = 570.0, **changes) -> CameraInfo:
    message = CameraInfo(width=640, height=480, distortion_model="plumb_bob", D=[0.0] * 5)
    message.K = [focal, 0.0, 319.5, 0.0, focal, 239.5, 0.0, 0.0, 1.0]
    message.header.frame_id = FRAME
    for name, value in changes.items():
        setattr(message, name, value)
    return message


def source(*frames: str) -> CameraSource:
    def look_up(frame: str) -> TransformStamped:
        if frame not in frames:
            raise LookupError(f"'{frame}' does not exist")
        found = TransformStamped()
        found.transform.translation.z, found.transform.rotation.x = 1.2, 1.0
        return found

    return CameraSource(TOPIC, look_up, LookupError)


def test_a_camera_has_the_calibration_it_was_told_and_the_place_that_was_found():
    camera = source(FRAME)
    camera.told(info(580.0))
    found = camera.camera(FRAME)
    assert found.K[0, 0] == 580.0
    assert np.allclose(found.position, (0.0, 0.0, 1.2))
    assert np.allclose(found.deproject([[319.5, 239.5]], [1.2]), [[0.0, 0.0, 0.0]])


def test_what_is_missing_of_a_camera_is_said():
    camera = source(FRAME)
    with pytest.raises(CameraError, match=f"nothing has come yet on {TOPIC}"):
        camera.camera(FRAME)
    camera.told(info())
    with pytest.raises(CameraError, match="'elsewhere' is, is not known: 'elsewhere' does not"):
        camera.camera("elsewhere")
    camera.told(info(K=[0.0] * 9))
    with pytest.raises(CameraError, match="is not calibrated"):
        camera.camera(FRAME)


def test_a_camera_is_placed_when_the_frame_of_its_calibration_is_known():
    assert not source(FRAME).placed()
    for frames, placed in (((), False), ((FRAME,), True)):
        camera = source(*frames)
        camera.told(info())
        assert camera.placed() == placed


@pytest.mark.parametrize("change", [{"focal": 571.0}, {"width": 320}, {"D": [0.1] * 5}])
def test_another_lens_is_noticed_and_the_same_one_is_not(change):
    camera = source(FRAME)
    assert camera.told(info())
    assert not camera.told(info())
    assert camera.told(info(**change))


def test_pictures_of_now_and_in_order_are_accepted():
    times = PictureTimes(oldest=0.5)
    assert [times.accept(t + 0.3, t) for t in (10.0, 10.1, 10.2)] == [False] * 3


@pytest.mark.parametrize(
    ("t", "words"),
    [(9.3, "0.70 s old; 0.5 s are allowed"), (10.7, "0.70 s ahead of time"), (math.nan, "nan s")],
)
def test_pictures_of_another_time_are_refused(t, words):
    with pytest.raises(StampError, match=words):
        PictureTimes(oldest=0.5).accept(10.0, t)


@pytest.mark.parametrize("late", [10.0, 9.95])
def test_a_picture_that_came_late_is_refused_and_the_next_is_not(late):
    times = PictureTimes(oldest=0.5)
    times.accept(10.0, 10.0)
    with pytest.raises(StampError, match="came after one of 10.000 s"):
        times.accept(10.05, late)
    assert not times.accept(10.1, 10.1)


def test_a_bag_that_is_played_again_begins_time_anew():
    times = PictureTimes(oldest=0.5)
    times.accept(60.0, 60.0)
    assert times.accept(2.0, 2.0)
    assert not times.accept(2.1, 2.1)
