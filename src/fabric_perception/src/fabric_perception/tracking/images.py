# SPDX-License-Identifier: BSD-3-Clause
"""Whether a pair of pictures is one that the tracker can use."""

from typing import Any

import numpy as np

from fabric_perception.images import ImageError

__all__ = ["ImageError", "check_pictures"]


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
