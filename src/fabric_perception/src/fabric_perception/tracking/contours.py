# SPDX-License-Identifier: BSD-3-Clause
"""Stage 2: patches of one colour, found by following their borders (Suzuki, 1985)."""

from typing import NamedTuple

import cv2
import numpy as np


class Patch(NamedTuple):
    """A patch of one colour in the picture.

    colour: name. contour: (N, 1, 2) int32 pixels. box: x, y, width, height in pixels.
    inside: (height, width) uint8 of the box, 255 in the patch. area: pixels.
    centre: (u, v) of its pixels.
    """

    colour: str
    contour: np.ndarray
    box: tuple[int, int, int, int]
    inside: np.ndarray
    area: float
    centre: tuple[float, float]

    def window(self, picture: np.ndarray) -> np.ndarray:
        """The part of a picture in the patch's box."""
        x, y, width, height = self.box
        return picture[y : y + height, x : x + width]


def find_patches(masks: dict[str, np.ndarray], least: float) -> list[Patch]:
    """Return the patches of at least `least` pixels in masks (H, W) by colour."""
    found = []
    for colour, mask in masks.items():
        contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
        for contour in contours:
            box = cv2.boundingRect(contour)
            if box[2] * box[3] >= least:
                patch = patch_of(colour, contour, box)
                if patch.area >= least:
                    found.append(patch)
    return found


def patch_of(colour: str, contour: np.ndarray, box: tuple[int, int, int, int]) -> Patch:
    """Return the patch inside a contour; holes in it are filled."""
    x, y, width, height = box
    inside = np.zeros((height, width), np.uint8)
    cv2.drawContours(inside, [contour], 0, 255, cv2.FILLED, offset=(-x, -y))
    return patch_within(colour, contour, box, inside)


def patch_within(
    colour: str, contour: np.ndarray, box: tuple[int, int, int, int], inside: np.ndarray
) -> Patch:
    """Return the patch of the pixels `inside` a box, which are at least one."""
    moments = cv2.moments(inside, binaryImage=True)
    area = moments["m00"]
    centre = (box[0] + moments["m10"] / area, box[1] + moments["m01"] / area)
    return Patch(colour, contour, box, inside, area, centre)
