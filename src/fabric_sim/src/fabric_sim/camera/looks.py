# SPDX-License-Identifier: BSD-3-Clause
"""How one run looks: light, colours, cloth, wood, what lies about. A seed decides it."""

from __future__ import annotations

import colorsys
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from fabric_msgs.msg import Cube
from fabric_sim.camera.parameters import Looks, Span
from fabric_sim.character import named_generator
from fabric_sim.geometry import CellGeometry

HUES = {Cube.COLOUR_RED: 0.0, Cube.COLOUR_GREEN: 125.0, Cube.COLOUR_BLUE: 222.0}  # degrees
SHIRTS = ((0.25, 0.27, 0.31), (0.55, 0.56, 0.58), (0.33, 0.30, 0.27), (0.72, 0.72, 0.70))
SKINS = ((0.86, 0.68, 0.57), (0.72, 0.52, 0.40), (0.45, 0.31, 0.23))
HELMETS = ((0.93, 0.93, 0.91), (0.80, 0.82, 0.85))
TABLES = ((0.72, 0.62, 0.50), (0.78, 0.76, 0.72), (0.55, 0.56, 0.57), (0.85, 0.82, 0.76))
THINGS = ((0.86, 0.74, 0.12), (0.92, 0.52, 0.15), (0.30, 0.30, 0.33), (0.90, 0.90, 0.88))
CORNERS = ((0.62, -0.34), (0.60, 0.36), (0.40, -0.36), (0.45, 0.36), (-0.10, 0.30))  # m, free
Colour = tuple[float, float, float]


class Thing(NamedTuple):
    """Something that lies on the table: middle, half sizes in m, yaw in rad."""

    at: tuple[float, float, float]
    half: tuple[float, float, float]
    yaw: float
    colour: Colour
    round: bool


@dataclass(frozen=True)
class Appearance:
    """What a run draws. Colours are red, green, blue, 0 to 1; lengths m."""

    table: Colour
    table_texture: np.ndarray  # (512, 512, 3) uint8, red first
    belt_texture: np.ndarray
    shirt: Colour
    skin: Colour
    helmet: Colour
    glove: Colour
    cubes: dict[int, Colour]  # by Cube.COLOUR_*
    cube_size: float  # times the usual edge
    ambient: Colour
    lamp: Colour
    lamp_at: tuple[float, float, float]
    exposure: float
    things: tuple[Thing, ...]

    @classmethod
    def draw(cls, looks: Looks, geometry: CellGeometry, seed: int) -> Appearance:
        """Return how the run of this root seed looks."""
        rng = named_generator(seed, "looks")
        warmth = rng.uniform(*looks.warmth)
        tint = np.array([1.0 + warmth, 1.0, 1.0 - warmth])
        table = _pick(rng, TABLES)
        return cls(
            table=table,
            table_texture=_grained(rng, 0.06, stretch=int(rng.integers(1, 12))),
            belt_texture=_grained(rng, 0.10, stretch=1),
            shirt=_pick(rng, SHIRTS),
            skin=_pick(rng, SKINS),
            helmet=_pick(rng, HELMETS),
            glove=_hsv(rng, looks.glove_hue, looks.glove_saturation, looks.glove_value),
            cubes={
                colour: _hsv(
                    rng,
                    (hue + looks.cube_hue[0], hue + looks.cube_hue[1]),
                    looks.cube_saturation,
                    looks.cube_value,
                )
                for colour, hue in HUES.items()
            },
            cube_size=rng.uniform(*looks.cube_size),
            ambient=tuple(rng.uniform(*looks.ambient) * tint),
            lamp=tuple(rng.uniform(*looks.lamp) * tint),
            lamp_at=(rng.uniform(-0.2, 0.7), rng.uniform(-0.7, 0.7), rng.uniform(1.6, 2.2)),
            exposure=rng.uniform(*looks.exposure),
            things=_things(rng, looks.clutter),
        )


def _pick(rng: np.random.Generator, colours: tuple[Colour, ...]) -> Colour:
    """One of the colours, a little lighter or darker."""
    base = np.array(colours[int(rng.integers(len(colours)))])
    return tuple(np.clip(base * rng.uniform(0.9, 1.08), 0.0, 1.0))


def _hsv(rng: np.random.Generator, hue: Span, saturation: Span, value: Span) -> Colour:
    h, s, v = rng.uniform(*hue), rng.uniform(*saturation), rng.uniform(*value)
    return colorsys.hsv_to_rgb((h % 360.0) / 360.0, s, v)


def _grained(rng: np.random.Generator, contrast: float, stretch: int) -> np.ndarray:
    """A cloudy, streaky grey texture around white, (512, 512, 3) uint8."""
    size = 512
    layers = np.zeros((size, size), np.float32)
    for cells in (12, 48, 192):
        small = rng.standard_normal((cells, max(2, cells // stretch))).astype(np.float32)
        layers += cv2.resize(small, (size, size), interpolation=cv2.INTER_CUBIC)
    layers += 0.5 * rng.standard_normal((size, size)).astype(np.float32)
    grey = np.clip(235.0 + 255.0 * contrast * layers / 1.8, 0.0, 255.0).astype(np.uint8)
    return cv2.cvtColor(grey, cv2.COLOR_GRAY2RGB)


def _things(rng: np.random.Generator, count: tuple[int, int]) -> tuple[Thing, ...]:
    number = min(int(rng.integers(count[0], count[1] + 1)), len(CORNERS))
    places = rng.permutation(len(CORNERS))[:number]
    return tuple(_thing(rng, CORNERS[place]) for place in places)


def _thing(rng: np.random.Generator, corner: tuple[float, float]) -> Thing:
    x, y = np.array(corner) + rng.uniform(-0.02, 0.02, 2)
    half = (rng.uniform(0.01, 0.03), rng.uniform(0.02, 0.045), rng.uniform(0.004, 0.015))
    is_round = bool(rng.random() < 0.4)
    return Thing((x, y, half[2]), half, rng.uniform(0.0, 3.1), _pick(rng, THINGS), is_round)
