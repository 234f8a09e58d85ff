# SPDX-License-Identifier: BSD-3-Clause
"""Pictures as arrays: decoding of sensor_msgs/Image and the checks at the border."""

from typing import Any

import cv2
import numpy as np

COLOUR = {  # encoding: conversion to BGR, channels
    "bgr8": (None, 3),
    "8UC3": (None, 3),
    "rgb8": (cv2.COLOR_RGB2BGR, 3),
    "bgra8": (cv2.COLOR_BGRA2BGR, 4),
    "rgba8": (cv2.COLOR_RGBA2BGR, 4),
}
DEPTH = {"32FC1": np.float32, "16UC1": np.uint16, "mono16": np.uint16}
MILLIMETRE = np.float32(0.001)


class ImageError(ValueError):
    """A picture cannot be used; the message says why."""


def bgr_of(message: Any) -> np.ndarray:
    """Return the colours (H, W, 3) uint8 BGR of a sensor_msgs/Image.

    Raises ImageError for another encoding than bgr8, rgb8, bgra8, rgba8, an empty picture, or
    data that do not fill it.
    """
    if message.encoding not in COLOUR:
        raise ImageError(f"colour encoding is {message.encoding!r}; want {', '.join(COLOUR)}")
    conversion, channels = COLOUR[message.encoding]
    pixels = _pixels(message, np.dtype(np.uint8), channels)
    return pixels if conversion is None else cv2.cvtColor(pixels, conversion)


def depth_of(message: Any) -> np.ndarray:
    """Return depths (H, W) float32 in m of a sensor_msgs/Image; 0 and NaN both mean none.

    Raises ImageError for another encoding than 32FC1 (m) and 16UC1 (mm), an empty picture, or
    data that do not fill it.
    """
    if message.encoding not in DEPTH:
        raise ImageError(f"depth encoding is {message.encoding!r}; want {', '.join(DEPTH)}")
    kind = np.dtype(DEPTH[message.encoding])
    pixels = _pixels(message, kind.newbyteorder(">" if message.is_bigendian else "<"), 1)
    if kind == np.uint16:
        return pixels * MILLIMETRE
    return pixels.astype(np.float32, copy=False)


def check_pictures(bgr: Any, depth: Any, width: int, height: int) -> None:
    """Raise ImageError unless bgr is (height, width, 3) uint8 and depth (height, width) float32.

    The contents are not judged: a depth of NaN everywhere is a sensor without a view.
    """
    _check_array("the colour picture", bgr, np.dtype(np.uint8), (height, width, 3))
    _check_array("the depth picture", depth, np.dtype(np.float32), (height, width))


def _check_array(name: str, array: Any, kind: np.dtype, shape: tuple[int, ...]) -> None:
    if not isinstance(array, np.ndarray):
        raise ImageError(f"{name} is {type(array).__name__}, not an array")
    if array.size == 0:
        raise ImageError(f"{name} is empty")
    if array.shape != shape:
        raise ImageError(f"{name} has shape {array.shape}; the camera's pictures have {shape}")
    if array.dtype != kind:
        raise ImageError(f"{name} holds {array.dtype}; want {kind}")


def _pixels(message: Any, kind: np.dtype, channels: int) -> np.ndarray:
    """(H, W, channels), or (H, W) for one channel, a view of the message's data."""
    width, height, step = message.width, message.height, message.step
    if width < 1 or height < 1 or not len(message.data):
        raise ImageError(f"the picture is empty: {width}x{height}, {len(message.data)} bytes")
    row = width * channels * kind.itemsize
    if step < row or len(message.data) < step * height:
        raise ImageError(
            f"{len(message.data)} bytes in rows of {step} do not fill {width}x{height} pixels of "
            f"{message.encoding}"
        )
    raw = np.frombuffer(message.data, np.uint8, step * height).reshape(height, step)[:, :row]
    shape = (height, width, channels) if channels > 1 else (height, width)
    return np.ascontiguousarray(raw).view(kind).reshape(shape)
