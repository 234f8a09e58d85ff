# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of a helmet with exactly known pose: what the head tracker is measured on.

Each marker with its white rim is a plane that is warped into the picture at several times its
resolution and then averaged over each pixel, like the light that falls on one.
"""

from dataclasses import dataclass
from functools import cache

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
    picture = _background(rng, camera, optics)
    visible = [m for m in helmet.markers.values() if facing(camera, pose, m) > 0.05]
    for marker in sorted(visible, key=lambda m: -_distance(camera, pose, m)):
        _paint(picture, camera, helmet, pose, marker)
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
    picture: np.ndarray, camera: Camera, helmet: Helmet, pose: np.ndarray, marker: HelmetMarker
) -> None:
    corners = camera.project(marker.corners @ pose[:3, :3].T + pose[:3, 3])
    if not np.isfinite(corners).all():
        return
    printed, source = _printed(helmet.dictionary, marker.id)
    margin = 0.5 * float(np.ptp(corners, axis=0).max()) + 2.0
    low = np.maximum(np.floor(corners.min(axis=0) - margin), 0).astype(int)
    size = (camera.width, camera.height)
    high = np.minimum(np.ceil(corners.max(axis=0) + margin), size).astype(int)
    if (high <= low).any():
        return
    H = cv2.getPerspectiveTransform(source, _oversampled(corners - low).astype(np.float32))
    fine = tuple(int(n) for n in (high - low) * OVERSAMPLING)
    warped = cv2.warpPerspective(printed, H, fine, flags=cv2.INTER_LINEAR)
    cover = cv2.warpPerspective(np.ones_like(printed), H, fine, flags=cv2.INTER_LINEAR)
    coarse = tuple(int(n) for n in high - low)
    light = cv2.resize(warped, coarse, interpolation=cv2.INTER_AREA)
    share = cv2.resize(cover, coarse, interpolation=cv2.INTER_AREA)
    part = picture[low[1] : high[1], low[0] : high[0]]
    part[:] = light + (1.0 - share) * part


def _oversampled(pixels: np.ndarray) -> np.ndarray:
    """The same places counted in finer pixels, centres at whole numbers in both."""
    return (pixels + 0.5) * OVERSAMPLING - 0.5


@cache
def _printed(name: str, marker: int) -> tuple[np.ndarray, np.ndarray]:
    """A marker with its white rim (n, n), and its corners (4, 2) there, clockwise."""
    dictionary = dictionary_of(name)
    cells = int(dictionary.markerSize) + 2
    printed = np.full(((cells + 2) * CELL,) * 2, 255.0, np.float32)
    printed[CELL:-CELL, CELL:-CELL] = draw(dictionary, marker, cells * CELL)
    near, far = CELL - 0.5, (cells + 1) * CELL - 0.5
    return printed, np.array([[near, near], [far, near], [far, far], [near, far]], np.float32)
