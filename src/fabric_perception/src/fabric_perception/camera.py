# SPDX-License-Identifier: BSD-3-Clause
"""A pinhole camera with a place in the cell: pixels to points and back.

The optical frame has x to the right of the picture, y down and z ahead (REP-103). Pixels are
(u, v) with the centre of the first pixel at (0, 0), as in OpenCV.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import ArrayLike

MODELS = {"": (0, 4, 5, 8), "plumb_bob": (0, 4, 5), "rational_polynomial": (0, 8)}


class CameraError(ValueError):
    """A camera cannot be used as described; the message names what is wrong."""


@dataclass(frozen=True)
class Camera:
    """Where a camera is and how it projects. Raises CameraError naming a bad part.

    K: (3, 3) camera matrix, pixels. width, height: of its pictures, pixels.
    pose_in_cell: (4, 4), takes points of the optical frame to frame cell, m.
    distortion: k1 k2 p1 p2 [k3 [k4 k5 k6]], OpenCV's order; empty for none.
    """

    K: np.ndarray
    width: int
    height: int
    pose_in_cell: np.ndarray
    distortion: Sequence[float] = ()

    def __post_init__(self) -> None:
        _check_size(self.width, self.height)
        object.__setattr__(self, "K", _matrix("K", self.K, (3, 3)))
        object.__setattr__(self, "pose_in_cell", check_pose(self.pose_in_cell))
        object.__setattr__(self, "distortion", _distortion(self.distortion))
        _check_intrinsics(self.K)

    @classmethod
    def from_camera_info(cls, info: Any, pose_in_cell: ArrayLike) -> "Camera":
        """Return the camera that a sensor_msgs/CameraInfo describes.

        Raises CameraError when the camera is not calibrated (a zero matrix), has a lens model
        other than plumb_bob or rational_polynomial, or sends a cut or binned picture.
        """
        K = _matrix("K", np.reshape(info.K, (3, 3)), (3, 3))
        if not K.any():
            raise CameraError(
                f"the camera '{info.header.frame_id}' is not calibrated: K of its camera_info is "
                "all zero; docs/cameras.md says how to calibrate it"
            )
        _check_model(info.distortion_model, len(info.D))
        _check_whole_picture(info)
        return cls(K, int(info.width), int(info.height), np.asarray(pose_in_cell), tuple(info.D))

    @property
    def position(self) -> np.ndarray:
        """Its optical centre, (3,) m in cell."""
        return self.pose_in_cell[:3, 3].copy()

    def to_cell(self, points: ArrayLike) -> np.ndarray:
        """Return points (N, 3) of the optical frame in frame cell, m."""
        points = np.asarray(points, dtype=float).reshape(-1, 3)
        return points @ self.pose_in_cell[:3, :3].T + self.pose_in_cell[:3, 3]

    def to_camera(self, points: ArrayLike) -> np.ndarray:
        """Return points (N, 3) of frame cell in the optical frame, m."""
        points = np.asarray(points, dtype=float).reshape(-1, 3)
        return (points - self.pose_in_cell[:3, 3]) @ self.pose_in_cell[:3, :3]

    def project(self, points: ArrayLike) -> np.ndarray:
        """Return the pixels (N, 2) of points (N, 3) in cell; NaN where not before the camera.

        Pixels may lie outside the picture.
        """
        seen = self.to_camera(points)
        pixels = np.full((len(seen), 2), np.nan)
        ahead = seen[:, 2] > 0.0
        if ahead.any():
            none = np.zeros(3)
            found, _ = cv2.projectPoints(seen[ahead], none, none, self.K, self._coefficients())
            pixels[ahead] = found.reshape(-1, 2)
        return pixels

    def rays(self, pixels: ArrayLike) -> np.ndarray:
        """Return (N, 3) directions in the optical frame with z = 1 of pixels (N, 2)."""
        pixels = np.asarray(pixels, dtype=float).reshape(-1, 1, 2)
        if not len(pixels):
            return np.empty((0, 3))
        flat = cv2.undistortPoints(pixels, self.K, self._coefficients()).reshape(-1, 2)
        return np.column_stack([flat, np.ones(len(flat))])

    def deproject(self, pixels: ArrayLike, depth: ArrayLike) -> np.ndarray:
        """Return the points (N, 3) in cell, m, of pixels (N, 2) with depth (N,) along z, m.

        A depth that is not above zero, or NaN, gives a point of NaN.
        """
        z = np.asarray(depth, dtype=float).reshape(-1)
        rays = self.rays(pixels)
        if len(rays) != len(z):
            raise ValueError(f"{len(rays)} pixels cannot have {len(z)} depths")
        z = np.where(np.isfinite(z) & (z > 0.0), z, np.nan)
        return self.to_cell(rays * z[:, None])

    def _coefficients(self) -> np.ndarray:
        return np.asarray(self.distortion, dtype=float)


def check_pose(pose: ArrayLike) -> np.ndarray:
    """Return a rigid (4, 4) transform as floats; raises CameraError when it is none."""
    pose = _matrix("pose_in_cell", pose, (4, 4))
    R = pose[:3, :3]
    if not np.allclose(R @ R.T, np.eye(3), atol=1e-6) or np.linalg.det(R) < 0.0:
        raise CameraError("pose_in_cell has no rotation in its upper left 3x3")
    if not np.allclose(pose[3], (0.0, 0.0, 0.0, 1.0)):
        raise CameraError(f"pose_in_cell ends with the row {pose[3].tolist()}, not 0 0 0 1")
    return pose


def _matrix(name: str, value: ArrayLike, shape: tuple[int, ...]) -> np.ndarray:
    matrix = np.array(value, dtype=float)
    if matrix.shape != shape:
        raise CameraError(f"{name} has shape {matrix.shape}, not {shape}")
    for index in np.argwhere(~np.isfinite(matrix)):
        place = "][".join(map(str, index))
        raise CameraError(f"{name}[{place}] is {matrix[tuple(index)]}")
    return matrix


def _distortion(values: Sequence[float]) -> tuple[float, ...]:
    if len(values) not in (0, 4, 5, 8):
        raise CameraError(f"distortion has {len(values)} values, not 0, 4, 5 or 8")
    return tuple(_matrix("distortion", values, (len(values),)).tolist())


def _check_size(width: int, height: int) -> None:
    if width < 1 or height < 1:
        raise CameraError(f"a picture of {width}x{height} pixels is empty")


def _check_intrinsics(K: np.ndarray) -> None:
    if K[0, 0] <= 0.0 or K[1, 1] <= 0.0:
        raise CameraError(f"the focal lengths {K[0, 0]} and {K[1, 1]} must be above zero")
    if K[0, 1] or K[1, 0] or K[2].tolist() != [0.0, 0.0, 1.0]:
        raise CameraError(f"K is no camera matrix: {K.tolist()}")


def _check_model(model: str, count: int) -> None:
    if model not in MODELS:
        raise CameraError(f"lens model '{model}' is not known; plumb_bob, rational_polynomial are")
    if count not in MODELS[model]:
        raise CameraError(f"lens model '{model}' with {count} coefficients makes no sense")


def _check_whole_picture(info: Any) -> None:
    if info.binning_x > 1 or info.binning_y > 1:
        raise CameraError(f"binning {info.binning_x}x{info.binning_y} of a picture is not known")
    if (info.roi.width, info.roi.height) not in ((0, 0), (info.width, info.height)):
        raise CameraError(f"the camera '{info.header.frame_id}' sends a part of its picture only")
