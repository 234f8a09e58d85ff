# SPDX-License-Identifier: BSD-3-Clause
"""The pose of a camera in the cell from pictures of a board that lies at a known place."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from fabric_perception.calibration.board import View, coverage
from fabric_perception.camera import Camera

LEAST_CORNERS = 24  # in every picture: six markers
LEAST_COVERAGE = 0.03  # of the picture
LARGEST_ERROR = 1.0  # pixels, root mean square
SECOND_SOLUTION = 2.0  # times the error: a board whose other planar pose fits better is ambiguous


class CalibrationError(ValueError):
    """A calibration that would not be worth its file; the message says why."""


@dataclass(frozen=True)
class Extrinsics:
    """Where a camera is, and how well that is known."""

    pose_in_cell: np.ndarray  # (4, 4), optical frame to cell, m
    error: float  # pixels, root mean square over all corners
    corners: int
    views: int
    position_deviation: (
        float  # m, standard deviation of the camera's place, all three axes together
    )
    angle_deviation: float  # rad, of its direction


def calibrate(
    camera: Camera,
    views: Sequence[View],
    board_in_cell: np.ndarray,
    largest_error: float = LARGEST_ERROR,
) -> Extrinsics:
    """Return the pose of a camera that saw a board at a known place; neither has moved.

    camera: its pose is not used. board_in_cell: (4, 4), frame board to cell, m.
    Raises CalibrationError when a picture shows too little of the board, when the corners do not
    fit to one pose, or fit nearly as well to another.
    """
    check_views(views, camera.width, camera.height)
    points = np.concatenate([view.points for view in views])
    pixels = np.concatenate([view.pixels for view in views])
    found = _poses(camera, points, pixels)
    turn, shift, error = found[0]
    if error > largest_error:
        raise CalibrationError(
            f"the corners miss the board by {error:.2f} pixels (root mean square; "
            f"{largest_error:g} allowed): is the sheet flat, and the camera_info this camera's?"
        )
    _check_second(found)
    board_in_camera = np.eye(4)
    board_in_camera[:3, :3], board_in_camera[:3, 3] = cv2.Rodrigues(turn)[0], shift.ravel()
    pose = board_in_cell @ np.linalg.inv(board_in_camera)
    place, angle = _deviations(camera, points, turn, shift, error)
    return Extrinsics(pose, error, len(points), len(views), place, angle)


def check_views(views: Sequence[View], width: int, height: int) -> None:
    """Raise CalibrationError when a picture shows too little of the board, naming it."""
    if not views:
        raise CalibrationError("there is no picture to calibrate from")
    for number, view in enumerate(views, 1):
        if view.count < LEAST_CORNERS:
            raise CalibrationError(
                f"picture {number} shows {view.count} corners of the board; {LEAST_CORNERS} are "
                "needed: more light, a nearer board, or another first_id?"
            )
        share = coverage(view, width, height)
        if share < LEAST_COVERAGE:
            raise CalibrationError(
                f"the board covers {100 * share:.1f} % of picture {number}; "
                f"{100 * LEAST_COVERAGE:g} % are needed: bring it nearer"
            )


def _poses(
    camera: Camera, points: np.ndarray, pixels: np.ndarray
) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """Rotation vectors and translations (3, 1) of the board in the optical frame, with their
    errors in pixels, the best first."""
    lens = np.asarray(camera.distortion)
    count, turns, shifts, _ = cv2.solvePnPGeneric(
        points, pixels, camera.K, lens, flags=cv2.SOLVEPNP_IPPE
    )
    found = []
    for turn, shift in list(zip(turns, shifts, strict=True))[:count]:
        turn, shift = cv2.solvePnPRefineLM(points, pixels, camera.K, lens, turn, shift)
        there, _ = cv2.projectPoints(points, turn, shift, camera.K, lens)
        rest = there.reshape(-1, 2) - pixels
        found.append((turn, shift, float(np.sqrt((rest**2).sum(axis=1).mean()))))
    found.sort(key=lambda solution: solution[2])
    if not found or not np.isfinite(found[0][2]) or float(found[0][1][2, 0]) <= 0.0:
        raise CalibrationError("no pose of the board explains the corners")
    return found


def _check_second(found: list[tuple[np.ndarray, np.ndarray, float]]) -> None:
    for other in found[1:]:
        apart = np.linalg.norm(cv2.Rodrigues(found[0][0])[0] - cv2.Rodrigues(other[0])[0])
        if apart > 0.05 and other[2] < SECOND_SOLUTION * found[0][2]:
            raise CalibrationError(
                "two poses of the board explain the corners: tilt it, or bring it nearer"
            )


def _deviations(
    camera: Camera, points: np.ndarray, turn: np.ndarray, shift: np.ndarray, error: float
) -> tuple[float, float]:
    """Standard deviations (m, rad) of the camera seen from the board, first order.

    The camera stands at -R^T t; R^T dt and the turn's effect on it are both in the covariance.
    """
    lens = np.asarray(camera.distortion)
    _, J = cv2.projectPoints(points, turn, shift, camera.K, lens)
    free = J[:, :6]
    variance = error**2 * len(points) / (2 * len(points) - 6)
    covariance = variance * np.linalg.inv(free.T @ free)
    R, dR = cv2.Rodrigues(turn)
    place = np.empty((3, 6))
    for axis in range(3):
        place[:, axis] = -dR[axis].reshape(3, 3).T @ shift.ravel()
    place[:, 3:] = -R.T
    spread = place @ covariance @ place.T
    return float(np.sqrt(np.trace(spread))), float(np.sqrt(np.trace(covariance[:3, :3])))
