# SPDX-License-Identifier: BSD-3-Clause
"""Numbers of the simulated cameras, out of camera.yaml, cameras.yaml and the helmet's file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fabric_sim.camera.place import rotation_of, turn
from fabric_sim.entries import ConfigError, Entries

CELL_FRAME = "cell_camera_color_optical_frame"
HEAD_FRAME = "head_camera_optical_frame"
TICK_RATE = 20  # ticks in a second of the cell
Span = tuple[float, float]


class Lens(NamedTuple):
    """A pinhole camera: size in pixels, focal length in pixels, the middle in the middle.

    frame: of its pictures. pose: (4, 4), takes points of that frame to frame cell, m.
    """

    frame: str
    width: int
    height: int
    focal: float
    pose: np.ndarray

    @property
    def K(self) -> np.ndarray:
        """Camera matrix, (3, 3)."""
        u, v = (self.width - 1) / 2.0, (self.height - 1) / 2.0
        return np.array([[self.focal, 0.0, u], [0.0, self.focal, v], [0.0, 0.0, 1.0]])


class Plate(NamedTuple):
    """A marker on the helmet. pose: (4, 4) in frame helmet, x out of its face, z to its top; m."""

    id: int
    size: float  # m, edge of the black square
    pose: np.ndarray


@dataclass(frozen=True)
class Looks:
    """Spans from which a run draws how things look. Hues in degrees, the rest 0 to 1."""

    ambient: Span
    lamp: Span
    warmth: Span
    exposure: Span
    cube_hue: Span
    cube_saturation: Span
    cube_value: Span
    cube_size: Span
    glove_hue: Span
    glove_saturation: Span
    glove_value: Span
    clutter: tuple[int, int]


@dataclass(frozen=True)
class Grain:
    """What a colour picture suffers; spans to draw from."""

    grain: Span  # standard deviation, of 255
    blur: Span  # pixels
    vignette: Span
    shutter: float  # s


@dataclass(frozen=True)
class DepthErrors:
    """What a depth picture suffers."""

    least: float  # m
    most: float  # m
    sigma: float  # m at 1 m
    step: float  # m at 1 m
    edge: float  # m
    edge_width: tuple[int, int]  # pixels
    shadow: float
    dropout: Span
    blotches: tuple[int, int]


@dataclass(frozen=True)
class CameraParameters:
    """Everything the renderer needs to know. rate: pictures in a second of the cell's time."""

    rate: float
    cell: Lens
    head: Lens
    looks: Looks
    grain: Grain
    depth: DepthErrors
    dictionary: str
    plates: tuple[Plate, ...]

    @property
    def every(self) -> int:
        """Ticks from one picture to the next."""
        return round(TICK_RATE / self.rate)

    @classmethod
    def load(cls, camera: str | Path, poses: str | Path, helmet: str | Path) -> CameraParameters:
        """Read camera.yaml, cameras.yaml and helmet.yaml.

        Raises ConfigError naming the file, the entry and its value.
        """
        entries, places = Entries.read(camera), _poses(Entries.read(poses))
        for frame in (CELL_FRAME, HEAD_FRAME):
            if frame not in places:
                raise ConfigError(f"{poses}: holds no camera {frame!r}, only {', '.join(places)}")
        dictionary, plates = _helmet(Entries.read(helmet))
        return cls(
            rate=_rate(entries),
            cell=_lens(entries.branch("cell"), CELL_FRAME, places[CELL_FRAME]),
            head=_lens(entries.branch("head"), HEAD_FRAME, places[HEAD_FRAME]),
            looks=_looks(entries),
            grain=_grain(entries.branch("noise")),
            depth=_depth(entries.branch("depth")),
            dictionary=dictionary,
            plates=plates,
        )


def _rate(entries: Entries) -> float:
    rate = entries.number("rate", 1.0, TICK_RATE)
    if TICK_RATE % rate != 0.0:
        raise entries.error("rate", f"a divisor of {TICK_RATE}")
    return rate


def _lens(entries: Entries, frame: str, pose: np.ndarray) -> Lens:
    width, height = entries.whole("width", 16), entries.whole("height", 16)
    return Lens(frame, width, height, entries.positive("focal"), pose)


def _poses(entries: Entries) -> dict[str, np.ndarray]:
    places = {}
    for item in entries.branches("cameras"):
        if item.word("parent") != "cell":
            raise item.error("parent", "cell")
        rotation = item.numbers("rotation", 4, -1.0, 1.0)
        if abs(np.linalg.norm(rotation) - 1.0) > 1e-3:
            raise item.error("rotation", "a quaternion of length 1")
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = rotation_of(rotation), item.numbers("translation", 3)
        places[item.word("frame")] = pose
    return places


def _helmet(entries: Entries) -> tuple[str, tuple[Plate, ...]]:
    plates = tuple(_plate(item) for item in entries.branches("markers"))
    if len({plate.id for plate in plates}) != len(plates):
        raise entries.error("markers", "ids that differ")
    return entries.word("dictionary"), plates


def _plate(entries: Entries) -> Plate:
    yaw, pitch, roll = (entries.number(key) for key in ("yaw", "pitch", "roll"))
    pose = np.eye(4)
    pose[:3, :3] = turn("z", yaw) @ turn("y", pitch) @ turn("x", roll)
    pose[:3, 3] = entries.numbers("position", 3)
    return Plate(entries.whole("id", 0), entries.positive("size"), pose)


def _looks(entries: Entries) -> Looks:
    light, cube, glove = (entries.branch(key) for key in ("light", "cube", "glove"))
    return Looks(
        ambient=light.span("ambient", 0.0, 1.0),
        lamp=light.span("lamp", 0.0, 1.0),
        warmth=light.span("warmth", -0.5, 0.5),
        exposure=light.span("exposure", 0.1, 3.0),
        cube_hue=cube.span("hue", -30.0, 30.0),
        cube_saturation=cube.span("saturation", 0.0, 1.0),
        cube_value=cube.span("value", 0.0, 1.0),
        cube_size=cube.span("size", 0.5, 2.0),
        glove_hue=glove.span("hue", 0.0, 360.0),
        glove_saturation=glove.span("saturation", 0.0, 1.0),
        glove_value=glove.span("value", 0.0, 1.0),
        clutter=_counts(entries, "clutter", 20),
    )


def _grain(entries: Entries) -> Grain:
    return Grain(
        grain=entries.span("grain", 0.0, 100.0),
        blur=entries.span("blur", 0.0, 10.0),
        vignette=entries.span("vignette", 0.0, 1.0),
        shutter=entries.number("shutter", 0.0, 0.1),
    )


def _depth(entries: Entries) -> DepthErrors:
    return DepthErrors(
        least=entries.number("least", 0.0),
        most=entries.positive("most"),
        sigma=entries.number("sigma", 0.0, 1.0),
        step=entries.number("step", 0.0, 1.0),
        edge=entries.positive("edge"),
        edge_width=_counts(entries, "edge_width", 20),
        shadow=entries.number("shadow", 0.0, 1000.0),
        dropout=entries.span("dropout", 0.0, 1.0),
        blotches=_counts(entries, "blotches", 1000),
    )


def _counts(entries: Entries, key: str, most: int) -> tuple[int, int]:
    low, high = entries.span(key, 0, most)
    if low % 1.0 or high % 1.0:
        raise entries.error(key, "whole numbers")
    return int(low), int(high)
