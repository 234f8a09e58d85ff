# SPDX-License-Identifier: BSD-3-Clause
"""What cameras do to a perfect picture: blur, dark corners, grain; noise and holes in depth."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import cv2
import numpy as np

from fabric_sim.camera.parameters import DepthErrors, Grain, Lens

POOL = 4  # pictures of noise that are drawn beforehand; each is used shifted at random
JITTER = 0.010  # of the exposure, from picture to picture
CONTOUR = 1.6  # pixels; noise of depth is alike over so far
LONGEST_SMEAR = 15  # pixels, half of it
LONGEST = 28  # pixels, of a shadow of the projector
UNSEEN = np.float32(np.nan)


class Smear(NamedTuple):
    """A part of a picture that moves: its middle, half its size, and the way it makes while the
    shutter is open, each (x, y) in pixels."""

    middle: tuple[float, float]
    half: tuple[float, float]
    way: tuple[float, float]


class ColourLens:
    """Spoils colour pictures of one camera in one run."""

    def __init__(self, lens: Lens, grain: Grain, exposure: float, rng: np.random.Generator) -> None:
        """exposure: brightness of the run, 1 is right. rng: decides the rest."""
        self._rng = rng
        self._exposure = exposure
        self._blur = rng.uniform(*grain.blur)
        self._corners = _vignette(lens, rng.uniform(*grain.vignette))
        sigma = rng.uniform(*grain.grain)
        shape = (lens.height, lens.width, 3)
        drawn = (rng.normal(0.0, sigma, shape) for _ in range(POOL))
        self._noise = [np.clip(np.rint(n), -127, 127).astype(np.int16) for n in drawn]

    def spoil(self, picture: np.ndarray, smears: Iterable[Smear] = ()) -> np.ndarray:
        """Return the picture (H, W, 3) uint8 as this camera would deliver it.

        smears: what moved too fast for the shutter.
        """
        for smear in smears:
            picture = smeared(picture, smear)
        soft = cv2.GaussianBlur(picture, (0, 0), self._blur) if self._blur > 0.0 else picture
        gain = self._exposure * (1.0 + JITTER * self._rng.standard_normal())
        dim = cv2.multiply(soft, self._corners, scale=gain, dtype=cv2.CV_16S)
        noisy = cv2.add(dim, _shifted(self._noise, self._rng))
        return cv2.convertScaleAbs(np.maximum(noisy, 0, out=noisy))


class DepthSensor:
    """Spoils depth pictures of one camera in one run, as a projector of patterns does."""

    def __init__(self, lens: Lens, errors: DepthErrors, rng: np.random.Generator) -> None:
        """rng: decides noise and holes."""
        self._errors, self._rng = errors, rng
        self._width = int(rng.integers(errors.edge_width[0], errors.edge_width[1] + 1))
        self._dropout = rng.uniform(*errors.dropout)
        shape = (lens.height, lens.width)
        self._noise = [_contoured(rng, shape) for _ in range(POOL)]
        self._chance = [rng.random(shape, np.float32) for _ in range(POOL)]
        blotches = int(rng.integers(errors.blotches[0], errors.blotches[1] + 1))
        self._shiny = _blotches(rng, shape, blotches)

    def spoil(self, depth: np.ndarray) -> np.ndarray:
        """Return depth (H, W) m as this sensor would deliver it: float32, NaN where there is none.

        Noise and steps grow with the square of the distance.
        """
        e = self._errors
        square = depth * depth
        noisy = depth + e.sigma * square * _shifted(self._noise, self._rng)
        step = np.maximum(e.step * square, np.float32(1e-6))
        noisy = np.rint(noisy / step) * step
        holes = (depth < e.least) | (depth > e.most) | self._edges(depth) | self._shadows(depth)
        holes |= _shifted(self._chance, self._rng) < self._dropout
        holes |= self._shiny
        return np.where(holes, UNSEEN, noisy).astype(np.float32)

    def _edges(self, depth: np.ndarray) -> np.ndarray:
        """Where depth jumps, the pattern is torn."""
        size = 2 * self._width + 1
        kernel = np.ones((size, size), np.uint8)
        jump = cv2.morphologyEx(depth, cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8))
        return cv2.dilate((jump > self._errors.edge).astype(np.uint8), kernel[:, : size - 1]) > 0

    def _shadows(self, depth: np.ndarray) -> np.ndarray:
        """What the projector beside the camera does not reach: left of what is near."""
        near = np.float32(self._errors.shadow) / depth[::2, ::2]  # half as sharp is sharp enough
        shadow = np.zeros(near.shape, bool)
        for columns in range(2, LONGEST // 2, 2):
            shadow[:, :-columns] |= near[:, columns:] - near[:, :-columns] > 2 * columns
        whole = shadow.repeat(2, axis=0).repeat(2, axis=1)
        return whole[: depth.shape[0], : depth.shape[1]]


def smeared(picture: np.ndarray, smear: Smear) -> np.ndarray:
    """Return the picture with a part of it smeared; what moves by less than a pixel is sharp."""
    length = math.hypot(*smear.way)
    if length < 1.0:
        return picture
    (x, y), (a, b) = smear.middle, smear.half
    rows = slice(max(0, round(y - b)), max(0, round(y + b)))
    columns = slice(max(0, round(x - a)), max(0, round(x + a)))
    if not picture[rows, columns].size:
        return picture
    size = 2 * min(LONGEST_SMEAR, math.ceil(length / 2)) + 1
    reach = np.array(smear.way) / length * min(length, size - 1) / 2
    kernel = np.zeros((size, size), np.float32)
    start, end = ((size // 2 + s * reach).round().astype(int) for s in (-1, 1))
    cv2.line(kernel, start.tolist(), end.tolist(), 1.0)
    result = picture.copy()
    result[rows, columns] = cv2.filter2D(picture, -1, kernel / kernel.sum())[rows, columns]
    return result


def _shifted(pool: list[np.ndarray], rng: np.random.Generator) -> np.ndarray:
    """One of the pictures of noise, turned round or upside down at random."""
    picture = pool[int(rng.integers(len(pool)))]
    rows, columns = rng.choice((1, -1), 2)
    return picture[::rows, ::columns]


def _vignette(lens: Lens, darker: float) -> np.ndarray:
    """(H, W, 3) float32 factors: 1 in the middle, less towards the corners."""
    y, x = np.mgrid[-1.0 : 1.0 : lens.height * 1j, -1.0 : 1.0 : lens.width * 1j]
    factors = 1.0 - darker * (x * x + y * y) / 2.0
    return np.repeat(factors[:, :, None], 3, axis=2).astype(np.float32)


def _contoured(rng: np.random.Generator, shape: tuple[int, int]) -> np.ndarray:
    """Noise of standard deviation 1 that is alike over some pixels, float32."""
    noise = cv2.GaussianBlur(rng.standard_normal(shape).astype(np.float32), (0, 0), CONTOUR)
    return noise / noise.std()


def _blotches(rng: np.random.Generator, shape: tuple[int, int], count: int) -> np.ndarray:
    """(H, W) bool, True in small spots."""
    spots = np.zeros(shape, np.uint8)
    for _ in range(count):
        middle = (int(rng.integers(shape[1])), int(rng.integers(shape[0])))
        axes = (int(rng.integers(2, 7)), int(rng.integers(2, 5)))
        cv2.ellipse(spots, middle, axes, float(rng.uniform(0, 180)), 0, 360, 1, -1)
    return spots > 0
