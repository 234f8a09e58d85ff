# SPDX-License-Identifier: BSD-3-Clause
"""Camera calibrations in the YAML layout of ROS's calibration tools, as sensor_msgs/CameraInfo."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from sensor_msgs.msg import CameraInfo

from fabric_perception.camera import Camera, CameraError
from fabric_perception.camera_poses import read_yaml

SHAPES = {  # key: rows and columns
    "camera_matrix": (3, 3),
    "rectification_matrix": (3, 3),
    "projection_matrix": (3, 4),
}


def load_camera_info(path: str | Path, frame: str) -> CameraInfo:
    """Return the calibration of a file, for pictures of a frame.

    Raises CameraError naming file and element; a matrix of zeros, what an uncalibrated camera
    has, is refused.
    """
    path = Path(path)
    held = read_yaml(path)
    try:
        info = _info_of(held)
        info.header.frame_id = frame
        Camera.from_camera_info(info, np.eye(4))
    except CameraError as error:
        raise CameraError(f"{path}: {error}") from None
    return info


def entry_of(name: str, info: CameraInfo) -> dict[str, Any]:
    """Return what a file holds of a calibration; `name` is the camera's."""
    matrices = {"camera_matrix": info.K, "rectification_matrix": info.R}
    entry: dict[str, Any] = {
        "image_width": int(info.width),
        "image_height": int(info.height),
        "camera_name": name,
        "camera_matrix": _matrix(3, 3, matrices["camera_matrix"]),
        "distortion_model": info.distortion_model,
        "distortion_coefficients": _matrix(1, len(info.D), info.D),
        "rectification_matrix": _matrix(3, 3, matrices["rectification_matrix"]),
        "projection_matrix": _matrix(3, 4, info.P),
    }
    return entry


def info_of(camera: Camera, frame: str) -> CameraInfo:
    """Return the CameraInfo of a camera whose pictures are not rectified."""
    K = camera.K
    info = CameraInfo(width=camera.width, height=camera.height)
    info.header.frame_id = frame
    info.distortion_model = "rational_polynomial" if len(camera.distortion) == 8 else "plumb_bob"
    info.D = list(camera.distortion) or [0.0] * 5
    info.K = K.ravel().tolist()
    info.R = np.eye(3).ravel().tolist()
    info.P = np.column_stack([K, np.zeros(3)]).ravel().tolist()
    return info


def _info_of(held: Any) -> CameraInfo:
    if not isinstance(held, Mapping):
        raise CameraError("holds no calibration")
    width, height = (_size(held, key) for key in ("image_width", "image_height"))
    info = CameraInfo(width=width, height=height)
    info.distortion_model = str(held.get("distortion_model", "plumb_bob"))
    info.K = _data(held, "camera_matrix")
    info.D = _data(held, "distortion_coefficients")
    info.R = _data(held, "rectification_matrix", np.eye(3).ravel().tolist())
    straight = np.column_stack([np.reshape(info.K, (3, 3)), np.zeros(3)]).ravel().tolist()
    info.P = _data(held, "projection_matrix", straight)
    return info


def _size(held: Mapping[str, Any], key: str) -> int:
    value = held.get(key)
    if isinstance(value, bool) or not isinstance(value, int) or value < 1:
        raise CameraError(f"{key} is {value!r}; it must be a whole number above 0")
    return value


def _data(held: Mapping[str, Any], key: str, default: list[float] | None = None) -> list[float]:
    if key not in held and default is not None:
        return default
    entry = held.get(key)
    data = entry.get("data") if isinstance(entry, Mapping) else None
    if not isinstance(data, list):
        raise CameraError(f"{key} is missing or has no data")
    if key in SHAPES and len(data) != np.prod(SHAPES[key]):
        raise CameraError(f"{key} has {len(data)} numbers, not {np.prod(SHAPES[key])}")
    for index, value in enumerate(data):
        numeric = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not numeric or not math.isfinite(value):
            raise CameraError(f"{key}[{index}] is {value!r}; it must be a finite number")
    return [float(value) for value in data]


def _matrix(rows: int, cols: int, data: Any) -> dict[str, Any]:
    return {"rows": rows, "cols": cols, "data": [round(float(v), 8) for v in data]}
