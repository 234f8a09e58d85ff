# SPDX-License-Identifier: BSD-3-Clause
"""A printed sheet before a camera: the SVG itself is what the camera sees."""

import xml.etree.ElementTree as ElementTree

import cv2
import numpy as np

from fabric_perception.calibration.board import Board
from fabric_perception.camera import Camera
from fabric_perception.head.helmet import rotation

DOTS = 8  # a mm of the rasterised sheet
BOARD = Board()
LENS = (-0.08, 0.04, 0.0008, -0.0006, 0.0)
K = np.array([[610.0, 0.0, 322.0], [0.0, 612.0, 236.0], [0.0, 0.0, 1.0]])
SVG = "{http://www.w3.org/2000/svg}"


def rectangles(svg: str) -> list[tuple[float, float, float, float]]:
    """x, y, width, height in mm of every black rectangle, the order of the sheet."""
    root = ElementTree.fromstring(svg)
    return [
        tuple(float(r.get(k, "0")) for k in ("x", "y", "width", "height"))
        for r in root.iter(f"{SVG}rect")
        if r.get("fill") is None
    ]


def raster(svg: str) -> np.ndarray:
    """The sheet as printed, DOTS pixels a mm."""
    root = ElementTree.fromstring(svg)
    size = [float(root.get(k).removesuffix("mm")) for k in ("height", "width")]
    sheet = np.full([int(round(v * DOTS)) for v in size], 255, np.uint8)
    for x, y, w, h in rectangles(svg):
        a, b = (int(round(v * DOTS)) for v in (x, y))
        c, d = (int(round(v * DOTS)) for v in (x + w, y + h))
        sheet[b:d, a:c] = 0
    return sheet


def origin_of(svg: str) -> tuple[float, float]:
    """Where the sheet's cross points, mm from its upper left corner."""
    x, y, w, h = np.array(rectangles(svg)).T
    return float(x.min()), float((y + h).max())


def board_pose(at, yaw=0.0, pitch=0.0, roll=0.0) -> np.ndarray:
    """(4, 4) of a board in cell."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation(yaw, pitch, roll), at
    return pose


def photograph(svg: str, camera: Camera, board: np.ndarray, seed: int = 0) -> np.ndarray:
    """A grey picture (H, W) of a sheet whose frame board is at `board` (4, 4) in cell."""
    sheet = raster(svg)
    x0, y0 = origin_of(svg)
    fine = 2
    v, u = np.indices((camera.height * fine, camera.width * fine), dtype=np.float64)
    pixels = np.column_stack([(u.ravel() + 0.5) / fine - 0.5, (v.ravel() + 0.5) / fine - 0.5])
    rays = camera.rays(pixels) @ camera.pose_in_cell[:3, :3].T
    normal, offset = board[:3, 2], board[:3, 3] - camera.position
    points = camera.position + rays * ((normal @ offset) / (rays @ normal))[:, None]
    own = (points - board[:3, 3]) @ board[:3, :3]
    x = (1000.0 * own[:, 0] + x0) * DOTS - 0.5
    y = (y0 - 1000.0 * own[:, 1]) * DOTS - 0.5
    maps = [m.reshape(u.shape).astype(np.float32) for m in (x, y)]
    seen = cv2.remap(sheet, *maps, cv2.INTER_LINEAR, borderValue=90)
    picture = cv2.resize(seen, (camera.width, camera.height), interpolation=cv2.INTER_AREA)
    noise = np.random.default_rng(seed).normal(0.0, 3.0, picture.shape)
    return np.clip(20.0 + 0.8 * picture + noise, 0, 255).astype(np.uint8)


def above(at, look_at, lens=LENS) -> Camera:
    """A camera at a place (m in cell) that looks at another."""
    ahead = np.array(look_at, dtype=float) - at
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, (0.0, 1.0, 0.0))
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([right, np.cross(ahead, right), ahead])
    pose[:3, 3] = at
    return Camera(K, 640, 480, pose, lens)
