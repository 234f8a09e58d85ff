# SPDX-License-Identifier: BSD-3-Clause
"""How a camera projects, from many pictures of a board held in front of it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from fabric_perception.calibration.board import View, coverage
from fabric_perception.calibration.extrinsics import CalibrationError, check_views
from fabric_perception.camera import Camera

LEAST_VIEWS = 8
LEAST_COVERAGE = 0.5  # of the picture, by all views together
LARGEST_ERROR = 1.0  # pixels, root mean square
LARGEST_DEVIATION = 0.01  # of the focal length
LEAST_TILTED = 3  # views; boards that face the camera leave focal length and distance open
TILTED = math.radians(15.0)


@dataclass(frozen=True)
class Intrinsics:
    """A calibrated lens."""

    camera: Camera  # its pose is the identity
    error: float  # pixels, root mean square
    focal_deviation: float  # pixels, standard deviation of the focal length
    views: int


def calibrate_lens(views: Sequence[View], width: int, height: int) -> Intrinsics:
    """Return focal lengths, principal point and distortion k1 k2 p1 p2 (k3 = 0).

    Raises CalibrationError when the pictures are too few, too much alike or do not fit.
    """
    check_views(views, width, height)
    if len(views) < LEAST_VIEWS:
        raise CalibrationError(f"{len(views)} pictures are not enough; {LEAST_VIEWS} are needed")
    everything = [
        np.concatenate(parts) for parts in zip(*((v.points, v.pixels) for v in views), strict=True)
    ]
    share = coverage(View(*everything, ()), width, height)
    if share < LEAST_COVERAGE:
        raise CalibrationError(
            f"the pictures together show the board on {100 * share:.0f} % of the view; "
            f"{100 * LEAST_COVERAGE:g} % are needed: hold it into the corners too"
        )
    error, K, lens, turns, _, deviations, _, _ = cv2.calibrateCameraExtended(
        [view.points.astype(np.float32) for view in views],
        [view.pixels.astype(np.float32) for view in views],
        (width, height),
        None,
        None,
        flags=cv2.CALIB_FIX_K3,
    )
    focal_deviation = float(max(deviations[0, 0], deviations[1, 0]))
    _check(float(error), focal_deviation, float(K[0, 0]), [_tilt(turn) for turn in turns])
    camera = Camera(K, width, height, np.eye(4), tuple(np.ravel(lens)[:5].tolist()))
    return Intrinsics(camera, float(error), focal_deviation, len(views))


def _check(error: float, focal_deviation: float, focal: float, tilts: Sequence[float]) -> None:
    if not np.isfinite(error) or error > LARGEST_ERROR:
        raise CalibrationError(
            f"the corners miss the board by {error:.2f} pixels (root mean square; "
            f"{LARGEST_ERROR:g} allowed): is the sheet flat, and the focus fixed?"
        )
    tilted = sum(tilt > TILTED for tilt in tilts)
    if tilted < LEAST_TILTED or not focal_deviation <= LARGEST_DEVIATION * focal:
        raise CalibrationError(
            f"the focal length stays open: the board is tilted in {tilted} pictures; tilt it by 30 "
            "to 45 degrees to different sides"
        )


def _tilt(turn: np.ndarray) -> float:
    """Angle in rad between the board's normal and the optical axis."""
    return math.acos(min(abs(float(cv2.Rodrigues(turn)[0][2, 2])), 1.0))
