# SPDX-License-Identifier: BSD-3-Clause
"""Poses of the helmet that explain the markers of one picture.

A square seen in a picture has two poses that explain it nearly as well (planar ambiguity); both
are kept for every marker, and refined on all markers that agree with them. Which one it is, is
decided by their errors and by what was seen before (`continuity`).
"""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np

from fabric_perception.camera import Camera
from fabric_perception.head.aruco import Marker
from fabric_perception.head.helmet import Helmet

# OpenCV's marker frame has x to the right of its face, y to its top, z out of it: ours from its.
FROM_OPENCV = np.array([[0.0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
AGREEMENT = 0.35  # of a marker's edge: how far its corners may lie off before the refinement
SAME = 0.03  # rad; two solutions closer than this are one
REFINEMENT = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 20, 1e-8)


class Candidate(NamedTuple):
    """A pose of the helmet that may be the one."""

    pose: np.ndarray  # (4, 4), frame helmet to the camera's optical frame, m
    error: float  # pixels, root mean square over the corners it explains
    ids: tuple[int, ...]  # of the markers it explains


def candidates(
    camera: Camera, helmet: Helmet, seen: Sequence[Marker], largest_error: float
) -> list[Candidate]:
    """Return the poses that explain most of the seen markers, the best first; may be none.

    Markers whose corners could not be refined count only when there is no other. largest_error:
    pixels, root mean square of the corners; poses above it are left out.
    """
    seen = [marker for marker in seen if marker.id in helmet.markers]
    seen = [marker for marker in seen if marker.refined] or seen
    starts = [pose for marker in seen for pose in _planar(camera, helmet, marker)]
    agreeing = [_agreeing(camera, helmet, pose, seen) for pose in starts]
    most = max((len(markers) for markers in agreeing), default=0)
    found = [
        _refined(camera, helmet, pose, markers)
        for pose, markers in zip(starts, agreeing, strict=True)
        if markers and len(markers) == most
    ]
    good = [c for c in found if c.error <= largest_error and c.pose[2, 3] > 0.0]
    return _distinct(sorted(good, key=lambda candidate: candidate.error))


def angle_between(a: np.ndarray, b: np.ndarray) -> float:
    """Return the angle in rad of the turn from rotation a (3, 3) to rotation b (3, 3)."""
    return float(np.arccos(np.clip((np.trace(a.T @ b) - 1.0) / 2.0, -1.0, 1.0)))


def _planar(camera: Camera, helmet: Helmet, marker: Marker) -> list[np.ndarray]:
    """Both poses (4, 4) of the helmet that one marker allows."""
    known = helmet.markers[marker.id]
    half = known.size / 2.0
    square = np.array([[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]])
    _, turns, shifts, _ = cv2.solvePnPGeneric(
        square,
        marker.corners.reshape(4, 1, 2),
        camera.K,
        np.asarray(camera.distortion),
        flags=cv2.SOLVEPNP_IPPE_SQUARE,
    )
    back = FROM_OPENCV.T @ np.linalg.inv(known.pose)
    poses = [_matrix(*pair) @ back for pair in zip(turns, shifts, strict=True)]
    return [pose for pose in poses if np.isfinite(pose).all()]


def _agreeing(
    camera: Camera, helmet: Helmet, pose: np.ndarray, seen: Sequence[Marker]
) -> list[Marker]:
    """Those markers that lie about where the pose wants them."""
    return [
        marker
        for marker in seen
        if np.abs(_residuals(camera, helmet, pose, [marker])).max()
        <= AGREEMENT * np.linalg.norm(marker.corners[0] - marker.corners[2]) / np.sqrt(2.0)
    ]


def _refined(
    camera: Camera, helmet: Helmet, pose: np.ndarray, markers: Sequence[Marker]
) -> Candidate:
    """The pose of least squares over all corners of the markers, from a start."""
    turn, shift = cv2.Rodrigues(pose[:3, :3])[0], pose[:3, 3].copy().reshape(3, 1)
    points = np.concatenate([helmet.markers[marker.id].corners for marker in markers])
    pixels = np.concatenate([marker.corners for marker in markers])
    lens = np.asarray(camera.distortion)
    turn, shift = cv2.solvePnPRefineLM(points, pixels, camera.K, lens, turn, shift, REFINEMENT)
    better = _matrix(turn, shift)
    rest = _residuals(camera, helmet, better, markers)
    error = float(np.sqrt((rest**2).sum(axis=1).mean())) if np.isfinite(rest).all() else np.inf
    return Candidate(better, error, tuple(marker.id for marker in markers))


def _residuals(
    camera: Camera, helmet: Helmet, pose: np.ndarray, markers: Sequence[Marker]
) -> np.ndarray:
    """(4 n, 2) pixels."""
    points = np.concatenate([helmet.markers[marker.id].corners for marker in markers])
    turn = cv2.Rodrigues(pose[:3, :3])[0]
    lens = np.asarray(camera.distortion)
    there, _ = cv2.projectPoints(points, turn, pose[:3, 3].copy(), camera.K, lens)
    return there.reshape(-1, 2) - np.concatenate([marker.corners for marker in markers])


def _matrix(turn: np.ndarray, shift: np.ndarray) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3] = cv2.Rodrigues(turn)[0]
    pose[:3, 3] = np.ravel(shift)
    return pose


def _distinct(found: Sequence[Candidate]) -> list[Candidate]:
    kept: list[Candidate] = []
    for candidate in found:
        R = candidate.pose[:3, :3]
        if all(angle_between(R, other.pose[:3, :3]) > SAME for other in kept):
            kept.append(candidate)
    return kept
