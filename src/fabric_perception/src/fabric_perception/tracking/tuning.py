# SPDX-License-Identifier: BSD-3-Clause
"""Limits of colours out of samples: what tune_colours.py does, without a window."""

from collections.abc import Sequence

import cv2
import numpy as np

from fabric_perception.images import ImageError
from fabric_perception.tracking.colours import HUES, NAMES, Limits, Palette
from fabric_perception.tracking.segmentation import plain_masks

AROUND = 3  # pixels on each side of a click
KEPT = 0.98  # share of the sampled pixels that the limits must hold
HUE_MARGIN, MARGIN = 4, 30  # added on each side
FEWEST = 9  # pixels
GREYISH = 40  # saturation below which a hue says nothing
PAINT = {"red": (0, 0, 255), "green": (0, 255, 0), "blue": (255, 0, 0), "glove": (0, 255, 255)}


class TuningError(ValueError):
    """Samples do not make limits; the message says why."""


def sample(bgr: np.ndarray, box: Sequence[int]) -> np.ndarray:
    """Return HSV values (N, 3) uint8 of a click (x, y) or a box (x, y, width, height).

    Raises TuningError when the box is empty or not in the picture (H, W, 3).
    """
    if bgr is None or bgr.ndim != 3 or bgr.shape[2] != 3 or bgr.dtype != np.uint8 or not bgr.size:
        raise ImageError("the picture is not (H, W, 3) uint8")
    if len(box) not in (2, 4):
        raise TuningError(f"a sample is x,y or x,y,width,height, not {len(box)} numbers")
    if len(box) == 2:
        side = 2 * AROUND + 1
        box = (box[0] - AROUND, box[1] - AROUND, side, side)
    x, y, width, height = box
    left, top = max(0, x), max(0, y)
    part = bgr[top : max(top, y + height), left : max(left, x + width)]
    if not part.size:
        size = f"{bgr.shape[1]}x{bgr.shape[0]}"
        raise TuningError(f"the sample {list(box)} is not in the picture of {size} pixels")
    return cv2.cvtColor(np.ascontiguousarray(part), cv2.COLOR_BGR2HSV).reshape(-1, 3)


def suggest(hsv: np.ndarray) -> Limits:
    """Return limits around HSV values (N, 3): the shortest span of hues, wrapping or not.

    Saturation and value stay open upwards. Raises TuningError for few or grey values.
    """
    if len(hsv) < FEWEST:
        raise TuningError(f"{len(hsv)} pixels are too few; {FEWEST} are needed")
    coloured = hsv[hsv[:, 1] >= GREYISH]
    if len(coloured) < 0.5 * len(hsv):
        raise TuningError("most of the sampled pixels are grey")
    first, last = _shortest_arc(np.bincount(coloured[:, 0], minlength=HUES))
    low = np.percentile(coloured[:, 1:], 100.0 * (1.0 - KEPT), axis=0) - MARGIN
    saturation, value = (int(max(GREYISH, round(float(bound)))) for bound in low)
    hue = ((first - HUE_MARGIN) % HUES, (last + HUE_MARGIN) % HUES)
    return Limits(hue, (saturation, 255), (value, 255))


def _shortest_arc(counts: np.ndarray) -> tuple[int, int]:
    """First and last hue of the shortest span around the circle that holds KEPT of the counts."""
    twice = np.concatenate([[0], np.cumsum(np.tile(counts, 2))])
    needed = KEPT * counts.sum()
    best = (HUES, 0)
    for first in range(HUES):
        last = int(np.searchsorted(twice, twice[first] + needed))
        best = min(best, (last - first, first))
    length, first = best
    return first, (first + length - 1) % HUES


class Tuner:
    """Samples of colours on the way to a palette."""

    def __init__(self, palette: Palette) -> None:
        """palette: to begin with; a colour without samples keeps its limits."""
        self.palette = palette
        self._samples: dict[str, list[np.ndarray]] = {}

    def add(self, name: str, bgr: np.ndarray, box: Sequence[int]) -> Limits:
        """Sample a colour in a picture; return its new limits.

        Raises TuningError, and SettingsError when colours would share hues; then nothing changes.
        """
        if name not in NAMES:
            raise TuningError(f"unknown colour {name!r}; known are {', '.join(NAMES)}")
        samples = [*self._samples.get(name, []), sample(bgr, box)]
        limits = suggest(np.concatenate(samples))
        self.set(name, limits)
        self._samples[name] = samples
        return limits

    def set(self, name: str, limits: Limits) -> None:
        """Give a colour limits by hand. Raises SettingsError; then nothing changes."""
        self.palette = Palette({**self.palette.limits, name: limits}, self.palette.source)

    def forget(self, name: str) -> None:
        """Forget the samples of a colour; its limits stay."""
        self._samples.pop(name, None)


def paint(bgr: np.ndarray, palette: Palette) -> np.ndarray:
    """Return a darkened picture (H, W, 3) in which every colour's pixels shine."""
    painted = (bgr // 3).astype(np.uint8)
    for name, mask in plain_masks(bgr, palette).items():
        painted[mask > 0] = PAINT[name]
    return painted


def describe(palette: Palette) -> str:
    """Return the limits, one colour a line."""
    return "\n".join(
        f"{name:6} hue {limits.hue[0]:3}..{limits.hue[1]:<3} saturation {limits.saturation[0]:3}.."
        f"{limits.saturation[1]:<3} value {limits.value[0]:3}..{limits.value[1]:<3}"
        for name, limits in palette.limits.items()
    )
