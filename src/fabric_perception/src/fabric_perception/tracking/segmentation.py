# SPDX-License-Identifier: BSD-3-Clause
"""Stage 1: which pixels have which colour."""

import cv2
import numpy as np

from fabric_perception.tracking.colours import Limits, Palette

OPENING = np.ones((3, 3), np.uint8)


class Segmenter:
    """Masks of the colours of a palette.

    A threshold of one channel costs an eighth of cv2.inRange on three, so the channels are
    split once and compared one by one; equal spans of two colours are compared once.
    """

    def __init__(self, palette: Palette, flat: np.ndarray | None = None) -> None:
        """flat: (H, W) float32 m, depth from which on a pixel shows empty ground; None: unknown."""
        self.palette = palette
        self._flat = flat

    def masks(self, bgr: np.ndarray, depth: np.ndarray) -> dict[str, np.ndarray]:
        """Return (H, W) uint8, 255 where a pixel has a colour, for each colour's name.

        bgr: (H, W, 3) uint8. depth: (H, W) float32 m. Pixels on empty ground are left out; those
        without depth are kept.
        """
        channels = cv2.split(cv2.cvtColor(bgr, cv2.COLOR_BGR2HSV))
        known: dict[tuple[int, int, int], np.ndarray] = {}
        raised = None
        if self._flat is not None:
            # not "nearer": a comparison with NaN is false, and a hole in the depth is no ground
            raised = cv2.bitwise_not(cv2.compare(depth, self._flat, cv2.CMP_GE))
        return {
            name: self._mask(channels, limits, raised, known)
            for name, limits in self.palette.limits.items()
        }

    def _mask(
        self,
        channels: tuple[np.ndarray, ...],
        limits: Limits,
        raised: np.ndarray | None,
        known: dict[tuple[int, int, int], np.ndarray],
    ) -> np.ndarray:
        low, *more = limits.hue_spans()
        mask = cv2.inRange(channels[0], *low)
        for span in more:
            cv2.bitwise_or(mask, cv2.inRange(channels[0], *span), dst=mask)
        for number, span in ((1, limits.saturation), (2, limits.value)):
            key = (number, *span)
            if key not in known:
                known[key] = cv2.inRange(channels[number], *span)
            cv2.bitwise_and(mask, known[key], dst=mask)
        if raised is not None:
            cv2.bitwise_and(mask, raised, dst=mask)
        return cv2.morphologyEx(mask, cv2.MORPH_OPEN, OPENING)


def plain_masks(bgr: np.ndarray, palette: Palette) -> dict[str, np.ndarray]:
    """The same without depth by the plain OpenCV calls: the yardstick of speed and of tests."""
    hsv = cv2.cvtColor(bgr, cv2.COLOR_BGR2HSV)
    found = {}
    for name, limits in palette.limits.items():
        mask = np.zeros(bgr.shape[:2], np.uint8)
        for low, high in limits.hue_spans():
            bounds = zip((low, high), limits.saturation, limits.value, strict=True)
            mask |= cv2.inRange(hsv, *bounds)
        found[name] = cv2.morphologyEx(mask, cv2.MORPH_OPEN, OPENING)
    return found
