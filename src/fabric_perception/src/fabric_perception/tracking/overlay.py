# SPDX-License-Identifier: BSD-3-Clause
"""What the tracker sees, drawn into its picture."""

import cv2
import numpy as np

from fabric_msgs.msg import Cube
from fabric_perception.camera import Camera
from fabric_perception.tracking.pipeline import WHERE_NAMES, Seen
from fabric_perception.tracking.workspace import Workspace

FONT, SCALE = cv2.FONT_HERSHEY_SIMPLEX, 0.42
INK, PAPER, GLOVE, NO_GLOVE = (255, 255, 255), (0, 0, 0), (255, 0, 255), (128, 128, 128)
PAINT = {
    Cube.COLOUR_RED: (60, 60, 255),
    Cube.COLOUR_GREEN: (80, 220, 80),
    Cube.COLOUR_BLUE: (255, 150, 60),
}
AHEAD = 0.3  # s of the hand's way that the arrow shows


def draw_overlay(bgr: np.ndarray, camera: Camera, workspace: Workspace, seen: Seen) -> np.ndarray:
    """Return a copy of a picture (H, W, 3) with tracks, containers and the hand drawn into it."""
    picture = bgr.copy()
    for tray in workspace.trays:
        x, y, z = tray.floor
        _label(picture, camera, np.array([x, y - tray.size[1] / 2, z]), f"{tray.id} {tray.label}")
    for cube in seen.detections:
        cv2.drawContours(picture, [cube.patch.contour], 0, INK, 1)
    for refusal in seen.refusals:
        cv2.drawContours(picture, [refusal.patch.contour], 0, NO_GLOVE, 1)
        x, y, _, _ = refusal.patch.box
        _write(picture, (x, y - 4), f"no glove: {refusal.reason}", INK)
    for cube in seen.cubes:
        text = f"{cube.id} {WHERE_NAMES[cube.where]} {cube.confidence:.0%}"
        _mark(picture, camera, cube.position, PAINT[cube.colour], cube.age == 0.0)
        _label(picture, camera, cube.position, text)
    _draw_hand(picture, camera, seen)
    return picture


def _draw_hand(picture: np.ndarray, camera: Camera, seen: Seen) -> None:
    hand = seen.hand
    if hand is None or not hand.visible:
        _write(picture, (8, 18), "no hand in view", INK)
        return
    ends = camera.project([hand.position, hand.position + AHEAD * hand.velocity])
    if np.isfinite(ends).all():
        start, end = (tuple(int(round(v)) for v in pixel) for pixel in ends)
        cv2.circle(picture, start, 6, GLOVE, 2)
        cv2.arrowedLine(picture, start, end, GLOVE, 2)


def _mark(
    picture: np.ndarray,
    camera: Camera,
    place: np.ndarray,
    colour: tuple[int, int, int],
    measured: bool,
) -> None:
    pixel = camera.project(place[None])[0]
    if np.isfinite(pixel).all():
        at = tuple(int(round(v)) for v in pixel)
        shape = cv2.MARKER_CROSS if measured else cv2.MARKER_TILTED_CROSS
        cv2.drawMarker(picture, at, PAPER, shape, 12, 3)
        cv2.drawMarker(picture, at, colour, shape, 12, 1)


def _label(picture: np.ndarray, camera: Camera, place: np.ndarray, text: str) -> None:
    pixel = camera.project(place[None])[0]
    if np.isfinite(pixel).all():
        _write(picture, (int(pixel[0]) + 9, int(pixel[1]) - 4), text, INK)


def _write(
    picture: np.ndarray, at: tuple[int, int], text: str, colour: tuple[int, int, int]
) -> None:
    cv2.putText(picture, text, at, FONT, SCALE, PAPER, 3, cv2.LINE_AA)
    cv2.putText(picture, text, at, FONT, SCALE, colour, 1, cv2.LINE_AA)
