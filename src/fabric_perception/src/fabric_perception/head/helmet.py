# SPDX-License-Identifier: BSD-3-Clause
"""The markers on a helmet: ids, sizes and places, from config/helmet.yaml.

Frame helmet: origin in the middle of the head, x the way the face points, y left, z up. A marker's
own frame has x out of its face, z to its top.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import yaml

KEYS = ("id", "size", "position", "yaw", "pitch", "roll")
UNIT_CORNERS = np.array(  # y, z in the marker's frame: clockwise from its top left, as OpenCV's
    [[-0.5, 0.5], [0.5, 0.5], [0.5, -0.5], [-0.5, -0.5]]
)


class HelmetError(ValueError):
    """A helmet that cannot be; the message names file, marker, element and value."""


@dataclass(frozen=True)
class HelmetMarker:
    """One marker. Raises HelmetError naming a bad element."""

    id: int
    size: float  # m, edge of the black square
    pose: np.ndarray  # (4, 4), marker's frame to frame helmet, m

    @cached_property
    def corners(self) -> np.ndarray:
        """(4, 3) m in frame helmet, clockwise from its top left."""
        own = np.column_stack([np.zeros(4), self.size * UNIT_CORNERS])
        return own @ self.pose[:3, :3].T + self.pose[:3, 3]


@dataclass(frozen=True)
class Helmet:
    """All markers of one helmet, by id, and the name of their dictionary."""

    dictionary: str
    markers: Mapping[int, HelmetMarker]

    @cached_property
    def corners(self) -> np.ndarray:
        """(4 n, 3) m, every corner in frame helmet."""
        return np.concatenate([marker.corners for marker in self.markers.values()])


def rotation(yaw: float, pitch: float, roll: float) -> np.ndarray:
    """Return Rz(yaw) Ry(pitch) Rx(roll), (3, 3); rad, fixed axes as in REP-103."""
    cy, sy = math.cos(yaw), math.sin(yaw)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cr, sr = math.cos(roll), math.sin(roll)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def marker_of(values: Any) -> HelmetMarker:
    """Return the marker of a mapping with the keys of KEYS; raises HelmetError."""
    if not isinstance(values, Mapping) or set(values) != set(KEYS):
        raise HelmetError(f"is {values!r}; it must have {', '.join(KEYS)}")
    if isinstance(values["id"], bool) or not isinstance(values["id"], int) or values["id"] < 0:
        raise HelmetError(f"id is {values['id']!r}; it must be a whole number, 0 or more")
    position = values["position"]
    if not isinstance(position, list) or len(position) != 3:
        raise HelmetError(f"position is {position!r}; it must be three numbers")
    size = _number("size", values["size"])
    if size <= 0.0:
        raise HelmetError(f"size is {size}; it must be above 0")
    pose = np.eye(4)
    pose[:3, :3] = rotation(*(_number(name, values[name]) for name in ("yaw", "pitch", "roll")))
    pose[:3, 3] = [_number(f"position[{i}]", value) for i, value in enumerate(position)]
    return HelmetMarker(values["id"], size, pose)


def helmet_of(values: Any) -> Helmet:
    """Return the helmet of a mapping `dictionary`, `markers`; raises HelmetError."""
    if not isinstance(values, Mapping) or set(values) != {"dictionary", "markers"}:
        raise HelmetError("a helmet has a dictionary and markers, nothing else")
    if not isinstance(values["markers"], list) or not values["markers"]:
        raise HelmetError("a helmet needs a list of markers")
    markers: dict[int, HelmetMarker] = {}
    for number, entry in enumerate(values["markers"], 1):
        try:
            marker = marker_of(entry)
        except HelmetError as error:
            raise HelmetError(f"marker {number}: {error}") from None
        if marker.id in markers:
            raise HelmetError(f"marker {number}: id {marker.id} is there already")
        markers[marker.id] = marker
    return Helmet(str(values["dictionary"]), markers)


def load_helmet(path: str | Path) -> Helmet:
    """Return the helmet of a YAML file; raises HelmetError naming the file."""
    try:
        return helmet_of(yaml.safe_load(Path(path).read_text(encoding="utf-8")))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise HelmetError(f"{path}: cannot be read: {error}") from None
    except HelmetError as error:
        raise HelmetError(f"{path}: {error}") from None


def _number(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise HelmetError(f"{name} is {value!r}; it must be a finite number")
    return float(value)
