# SPDX-License-Identifier: BSD-3-Clause
"""What the head tracker has found, drawn into the camera's picture."""

import math

import cv2
import numpy as np

from fabric_perception.camera import Camera
from fabric_perception.head.tracker import HeadPercept

GREEN, ORANGE, GREY = (80, 200, 80), (0, 140, 255), (170, 170, 170)
AXES = ((60, 60, 230), (60, 200, 60), (230, 120, 40))  # x, y, z
AXIS = 0.10  # m
FACE = 0.30  # m, of the arrow where the face points
FONT = cv2.FONT_HERSHEY_SIMPLEX
SUBPIXEL = 4  # binary digits behind the point, for smooth lines


def draw_overlay(picture: np.ndarray, camera: Camera, percept: HeadPercept) -> np.ndarray:
    """Return a copy of a colour picture (H, W, 3) with markers, axes, gaze and words."""
    picture = picture.copy()
    for marker in percept.markers:
        outline = _fixed(marker.corners)
        cv2.polylines(picture, [outline], True, GREEN, 2, cv2.LINE_AA, SUBPIXEL)
        _write(picture, f"{marker.id}", marker.corners[0] - (4.0, 6.0), GREEN)
    if percept.visible:
        _draw_axes(picture, camera, percept.pose)
    words, colour = _words(percept)
    _write(picture, words, np.array((10.0, picture.shape[0] - 12.0)), colour)
    return picture


def _words(percept: HeadPercept) -> tuple[str, tuple[int, int, int]]:
    if not percept.visible:
        return "head: no marker in view, unknown", GREY
    state = "looking around" if percept.looking_around else "at the work area"
    yaw, pitch = math.degrees(percept.yaw), math.degrees(percept.pitch)
    colour = ORANGE if percept.looking_around else GREEN
    return f"head: {state}   yaw {yaw:.0f}  pitch {pitch:.0f} deg", colour


def _draw_axes(picture: np.ndarray, camera: Camera, pose: np.ndarray) -> None:
    ends = np.vstack([np.zeros(3), np.eye(3) * AXIS, (FACE, 0.0, 0.0)])
    pixels = camera.project(ends @ pose[:3, :3].T + pose[:3, 3])
    if not np.isfinite(pixels).all() or np.abs(pixels).max() > 1e4:
        return
    origin, *tips, face = _fixed(pixels)
    cv2.arrowedLine(
        picture, _whole(origin), _whole(face), (0, 220, 220), 2, cv2.LINE_AA, tipLength=0.15
    )
    for tip, colour in zip(tips, AXES, strict=True):
        cv2.line(picture, tuple(origin), tuple(tip), colour, 2, cv2.LINE_AA, SUBPIXEL)


def _fixed(pixels: np.ndarray) -> np.ndarray:
    """Pixels (N, 2) as OpenCV wants them with fractional bits."""
    return np.rint(pixels * 2**SUBPIXEL).astype(np.int32)


def _whole(fixed: np.ndarray) -> tuple[int, int]:
    return int(fixed[0]) >> SUBPIXEL, int(fixed[1]) >> SUBPIXEL


def _write(picture: np.ndarray, words: str, at: np.ndarray, colour: tuple[int, int, int]) -> None:
    place = (int(at[0]), int(at[1]))
    cv2.putText(picture, words, place, FONT, 0.55, (0, 0, 0), 4, cv2.LINE_AA)
    cv2.putText(picture, words, place, FONT, 0.55, colour, 1, cv2.LINE_AA)
