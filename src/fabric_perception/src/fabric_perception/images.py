# SPDX-License-Identifier: BSD-3-Clause
"""Pictures out of sensor_msgs/Image and into it, checked; no ROS needed.

A colour picture is (H, W, 3) uint8 in the order blue, green, red; a grey one (H, W) uint8; a depth
picture (H, W) float32 in m with NaN where there is none.
"""

from typing import Any

import cv2
import numpy as np

COLOUR = {  # encoding: (channels, what turns it into BGR)
    "bgr8": (3, None),
    "rgb8": (3, cv2.COLOR_RGB2BGR),
    "bgra8": (4, cv2.COLOR_BGRA2BGR),
    "rgba8": (4, cv2.COLOR_RGBA2BGR),
    "8UC3": (3, None),
    "mono8": (1, cv2.COLOR_GRAY2BGR),
    "8UC1": (1, cv2.COLOR_GRAY2BGR),
    "yuv422": (2, cv2.COLOR_YUV2BGR_UYVY),
    "yuv422_yuy2": (2, cv2.COLOR_YUV2BGR_YUY2),
}
TO_GREY = {
    "bgr8": cv2.COLOR_BGR2GRAY,
    "8UC3": cv2.COLOR_BGR2GRAY,
    "rgb8": cv2.COLOR_RGB2GRAY,
    "bgra8": cv2.COLOR_BGRA2GRAY,
    "rgba8": cv2.COLOR_RGBA2GRAY,
    "mono8": None,
    "8UC1": None,
    "yuv422": cv2.COLOR_YUV2GRAY_UYVY,
    "yuv422_yuy2": cv2.COLOR_YUV2GRAY_YUY2,
}
DEPTH = {"32FC1": np.dtype("f4"), "16UC1": np.dtype("u2"), "mono16": np.dtype("u2")}
MILLIMETRES = 0.001  # m, of 16UC1 (REP-118)


class ImageError(ValueError):
    """A picture that cannot be used; the message names what is wrong with it."""


def colour_of(message: Any) -> np.ndarray:
    """Return the colour picture (H, W, 3) of an Image message; raises ImageError.

    The array may share the message's memory and is then read-only.
    """
    if message.encoding not in COLOUR:
        raise ImageError(_unknown(message.encoding, COLOUR))
    channels, conversion = COLOUR[message.encoding]
    pixels = _pixels(message, np.dtype("u1"), channels)
    return pixels if conversion is None else cv2.cvtColor(pixels, conversion)


def grey_of(message: Any) -> np.ndarray:
    """Return the grey picture (H, W) of an Image message; as `colour_of`."""
    if message.encoding not in TO_GREY:
        raise ImageError(_unknown(message.encoding, TO_GREY))
    pixels = _pixels(message, np.dtype("u1"), COLOUR[message.encoding][0])
    conversion = TO_GREY[message.encoding]
    return pixels if conversion is None else cv2.cvtColor(pixels, conversion)


def depth_of(message: Any) -> np.ndarray:
    """Return the depth (H, W) m of an Image message, NaN where there is none; raises ImageError.

    16UC1 is in mm with 0 for none, 32FC1 in m; infinite and negative depths become NaN.
    """
    if message.encoding not in DEPTH:
        raise ImageError(_unknown(message.encoding, DEPTH))
    pixels = _pixels(message, DEPTH[message.encoding], 1)
    if pixels.dtype.kind == "u":
        depth = pixels * np.float32(MILLIMETRES)
    else:
        depth = pixels.astype(np.float32)
    with np.errstate(invalid="ignore"):
        depth[~(np.isfinite(depth) & (depth > 0.0))] = np.nan
    return depth


def fill(message: Any, picture: np.ndarray) -> Any:
    """Put a colour, grey or depth picture into an Image message and return the message.

    Raises ImageError for an array that is none of the three.
    """
    encodings = {(3, "uint8"): "bgr8", (2, "uint8"): "mono8", (2, "float32"): "32FC1"}
    encoding = encodings.get((picture.ndim, picture.dtype.name))
    if encoding is None or (picture.ndim == 3 and picture.shape[2] != 3) or not picture.size:
        raise ImageError(f"an array {picture.shape} of {picture.dtype} is no picture")
    message.encoding = encoding
    message.height, message.width = picture.shape[:2]
    message.is_bigendian = 0
    message.step = picture[0].size * picture.itemsize
    message.data = np.ascontiguousarray(picture).tobytes()
    return message


def check_grey(picture: np.ndarray, width: int, height: int) -> None:
    """Raise ImageError unless the array is a grey picture of this size."""
    if picture.dtype != np.uint8 or picture.ndim != 2:
        raise ImageError(f"an array {picture.shape} of {picture.dtype} is no grey picture")
    if picture.shape != (height, width):
        raise ImageError(
            f"the picture is {picture.shape[1]}x{picture.shape[0]} pixels, its camera's are "
            f"{width}x{height}"
        )


def _unknown(encoding: str, known: Any) -> str:
    return f"encoding '{encoding}' is not known here; {', '.join(known)} are"


def _pixels(message: Any, kind: np.dtype, channels: int) -> np.ndarray:
    """The bytes as (H, W) or (H, W, channels); padding of the rows is left out."""
    height, width, step = message.height, message.width, message.step
    row = width * channels * kind.itemsize
    if not height or not width:
        raise ImageError(f"the picture is empty: {width}x{height} pixels")
    if step < row:
        raise ImageError(f"a row of {step} bytes cannot hold {width} pixels {message.encoding}")
    if len(message.data) != height * step:
        raise ImageError(f"{len(message.data)} bytes are not {height} rows of {step} bytes")
    raw = np.frombuffer(message.data, np.uint8).reshape(height, step)[:, :row]
    order = ">" if message.is_bigendian else "<"
    pixels = np.ascontiguousarray(raw).view(kind.newbyteorder(order))
    if message.is_bigendian:
        pixels = pixels.astype(kind)
    return pixels if channels == 1 else pixels.reshape(height, width, channels)
