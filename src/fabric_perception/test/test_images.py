# SPDX-License-Identifier: BSD-3-Clause
"""Image messages, whole and damaged."""

import cv2
import numpy as np
import pytest
from sensor_msgs.msg import Image

from fabric_perception import images
from fabric_perception.images import ImageError

rng = np.random.default_rng(5)
BGR = rng.integers(0, 256, (12, 16, 3), dtype=np.uint8)


def message(encoding: str, pixels: np.ndarray, padding: int = 0, big: bool = False) -> Image:
    rows = np.ascontiguousarray(pixels).reshape(len(pixels), -1).view(np.uint8)
    rows = np.pad(rows, ((0, 0), (0, padding)), constant_values=7)
    height, width = pixels.shape[:2]
    return Image(None, height, width, encoding, int(big), rows.shape[1], rows.tobytes())


@pytest.mark.parametrize(
    ("encoding", "pixels"),
    [
        ("bgr8", BGR),
        ("rgb8", BGR[..., ::-1]),
        ("bgra8", cv2.cvtColor(BGR, cv2.COLOR_BGR2BGRA)),
        ("rgba8", cv2.cvtColor(BGR, cv2.COLOR_BGR2RGBA)),
    ],
)
@pytest.mark.parametrize("padding", [0, 5])
def test_every_order_of_colours_gives_the_same_picture(encoding, pixels, padding):
    found = images.colour_of(message(encoding, pixels, padding))
    assert np.array_equal(found, BGR)


def test_a_grey_picture_is_taken_as_it_is():
    grey = cv2.cvtColor(BGR, cv2.COLOR_BGR2GRAY)
    assert np.array_equal(images.grey_of(message("mono8", grey)), grey)
    assert np.array_equal(images.grey_of(message("bgr8", BGR)), grey)
    assert np.array_equal(images.colour_of(message("mono8", grey))[..., 1], grey)


def test_the_two_layouts_of_a_usb_camera_give_the_same_picture():
    yuy2 = rng.integers(0, 256, (12, 16, 2), dtype=np.uint8)
    uyvy = yuy2[..., ::-1]
    a = images.colour_of(message("yuv422_yuy2", yuy2))
    assert a.shape == (12, 16, 3)
    assert np.array_equal(a, images.colour_of(message("yuv422", uyvy)))
    assert np.array_equal(images.grey_of(message("yuv422", uyvy)), yuy2[..., 0])


def test_depth_in_millimetres_and_in_metres_is_the_same_picture():
    millimetres = np.array([[0, 900], [1, 65535]], dtype=np.uint16)
    expected = np.array([[np.nan, 0.9], [0.001, 65.535]], dtype=np.float32)
    found = images.depth_of(message("16UC1", millimetres))
    assert np.allclose(found, expected, equal_nan=True)
    swapped = message("16UC1", millimetres.byteswap(), big=True)
    assert np.allclose(images.depth_of(swapped), expected, equal_nan=True)


def test_what_is_no_depth_becomes_a_hole():
    metres = np.array([[0.9, np.inf], [-1.0, np.nan]], dtype=np.float32)
    found = images.depth_of(message("32FC1", metres))
    assert np.isnan(found).tolist() == [[False, True], [True, True]]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"encoding": "bayer_rggb8"}, "'bayer_rggb8' is not known here; bgr8"),
        ({"encoding": ""}, "encoding '' is not known"),
        ({"width": 0, "height": 0, "data": b""}, "empty: 0x0"),
        ({"data": b""}, "0 bytes are not 12 rows of 48"),
        ({"data": BGR.tobytes()[:-1]}, "575 bytes are not 12 rows"),
        ({"width": 17}, "a row of 48 bytes cannot hold 17 pixels bgr8"),
        ({"height": 11}, "576 bytes are not 11 rows"),
    ],
)
def test_a_damaged_message_is_refused_by_name(changes, words):
    damaged = message("bgr8", BGR)
    for name, value in changes.items():
        setattr(damaged, name, value)
    for reader in (images.colour_of, images.grey_of):
        with pytest.raises(ImageError, match=words):
            reader(damaged)


def test_a_colour_picture_is_no_depth():
    with pytest.raises(ImageError, match="'bgr8' is not known here; 32FC1"):
        images.depth_of(message("bgr8", BGR))


@pytest.mark.parametrize("picture", [BGR, BGR[..., 0], BGR[::2, ::2], np.ones((4, 6), np.float32)])
def test_what_is_filled_in_can_be_read_again(picture):
    filled = images.fill(Image(), picture)
    reader = {"bgr8": images.colour_of, "mono8": images.grey_of, "32FC1": images.depth_of}
    assert np.array_equal(reader[filled.encoding](filled), picture)


@pytest.mark.parametrize(
    "array", [np.ones((4, 4)), np.ones((4, 4, 2), np.uint8), np.ones((0, 4), np.uint8)]
)
def test_what_is_no_picture_is_not_filled_in(array):
    with pytest.raises(ImageError, match="is no picture"):
        images.fill(Image(), array)


def test_a_picture_must_have_its_cameras_size():
    grey = BGR[..., 0]
    images.check_grey(grey, 16, 12)
    with pytest.raises(ImageError, match="is 16x12 pixels, its camera's are 640x480"):
        images.check_grey(grey, 640, 480)
    with pytest.raises(ImageError, match="no grey picture"):
        images.check_grey(BGR, 16, 12)
