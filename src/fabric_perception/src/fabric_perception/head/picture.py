# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of a helmet with exactly known pose: what the head tracker is measured on.

Each marker with its white rim is a plane that is warped into the picture at several times its
resolution and then averaged over each pixel, like the light that falls on one.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from fabric_perception.camera import Camera
from fabric_perception.head.aruco import dictionary_of, draw
from fabric_perception.head.helmet import Helmet, HelmetMarker

OVERSAMPLING = 4
CELL = 40  # pixels a cell of the drawn marker


@dataclass(frozen=True)
class Optics:
    """What stands between the helmet and the picture."""

    blur: float = 0.6  # pixels, standard deviation of the lens
    motion: float = 0.0  # pixels, length of a smear to the side
    noise: float = 3.0  # grey values, standard deviation
    contrast: float = 0.75  # of what is printed
    clutter: int = 40  # rectangles in the background


def helmet_picture(
    camera: Camera,
    helmet: Helmet,
    pose: np.ndarray,
    optics: Optics = Optics(),  # noqa: B008  (frozen)
    seed: int = 0,
) -> np.ndarray:
    """Return a grey picture (H, W) uint8 of a helmet at pose (4, 4) in cell.

    Markers that face away are not drawn; the lens is free of distortion.
    """
    rng = np.random.default_rng(seed)
    size = (camera.width * OVERSAMPLING, camera.height * OVERSAMPLING)
    canvas = _background(rng, camera, optics)
    canvas = cv2.resize(canvas, size, interpolation=cv2.INTER_LINEAR)
    visible = [m for m in helmet.markers.values() if facing(camera, pose, m) > 0.05]
    for marker in sorted(visible, key=lambda m: -_distance(camera, pose, m)):
        _paint(canvas, camera, helmet, pose, marker)
    picture = cv2.resize(canvas, (camera.width, camera.height), interpolation=cv2.INTER_AREA)
    if optics.motion >= 1.0:
        picture = cv2.blur(picture, (int(round(optics.motion)), 1))
    if optics.blur > 0.0:
        picture = cv2.GaussianBlur(picture, (0, 0), optics.blur)
    middle = 128.0 + optics.contrast * (picture - 128.0)
    noisy = middle + rng.normal(0.0, 1.0, picture.shape) * optics.noise
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def facing(camera: Camera, pose: np.ndarray, marker: HelmetMarker) -> float:
    """Return the cosine between a marker's face and the way to the camera; above 0 it is seen."""
    placed = pose @ marker.pose
    way = camera.position - placed[:3, 3]
    return float(placed[:3, 0] @ way / np.linalg.norm(way))


def side_in_pixels(camera: Camera, pose: np.ndarray, marker: HelmetMarker) -> float:
    """Return the mean length of a marker's four edges in the picture, pixels."""
    corners = camera.project(marker.corners @ pose[:3, :3].T + pose[:3, 3])
    return float(np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).mean())


def _distance(camera: Camera, pose: np.ndarray, marker: HelmetMarker) -> float:
    return float(np.linalg.norm((pose @ marker.pose)[:3, 3] - camera.position))


def _background(rng: np.random.Generator, camera: Camera, optics: Optics) -> np.ndarray:
    shape = (camera.height, camera.width)
    canvas = cv2.GaussianBlur(rng.uniform(0.0, 255.0, shape).astype(np.float32), (0, 0), 8.0)
    canvas = cv2.normalize(canvas, None, 60.0, 190.0, cv2.NORM_MINMAX)
    for _ in range(optics.clutter):
        corner = rng.integers(0, (camera.width, camera.height))
        far = corner + rng.integers(8, 140, 2)
        grey = float(rng.uniform(0.0, 255.0))
        cv2.rectangle(canvas, tuple(map(int, corner)), tuple(map(int, far)), grey, -1)
    return canvas


def _paint(
    canvas: np.ndarray, camera: Camera, helmet: Helmet, pose: np.ndarray, marker: HelmetMarker
) -> None:
    dictionary = dictionary_of(helmet.dictionary)
    cells = int(dictionary.markerSize) + 2
    printed = np.full(((cells + 2) * CELL,) * 2, 255, np.uint8)
    printed[CELL:-CELL, CELL:-CELL] = draw(dictionary, marker.id, cells * CELL)
    edge = CELL - 0.5
    end = printed.shape[0] - CELL - 0.5
    source = np.array([[edge, edge], [end, edge], [end, end], [edge, end]])
    corners = camera.project(marker.corners @ pose[:3, :3].T + pose[:3, 3])
    if not np.isfinite(corners).all():
        return
    target = (corners + 0.5) * OVERSAMPLING - 0.5
    H = cv2.getPerspectiveTransform(source.astype(np.float32), target.astype(np.float32))
    size = (canvas.shape[1], canvas.shape[0])
    warped = cv2.warpPerspective(printed.astype(np.float32), H, size, flags=cv2.INTER_LINEAR)
    mask = cv2.warpPerspective(np.ones_like(printed), H, size, flags=cv2.INTER_NEAREST) > 0
    canvas[mask] = warped[mask]
