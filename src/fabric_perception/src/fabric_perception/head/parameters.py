# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of the head tracker: one place for unit, range and default."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any


def _parameter(default: Any, unit: str, low: float, high: float, text: str) -> Any:
    return field(default=default, metadata={"unit": unit, "range": (low, high), "text": text})


@dataclass(frozen=True)
class HeadParameters:
    """How pictures become poses, and poses looks; raises ValueError naming a bad value."""

    window: int = _parameter(23, "pixels", 3, 99, "odd; of the one adaptive threshold")
    corner_noise: float = _parameter(
        0.8, "pixels", 0.01, 10.0, "of a corner of a moving head, in the choice between two poses"
    )
    largest_error: float = _parameter(
        4.0, "pixels", 0.1, 50.0, "root mean square of a pose's corners; one above is no pose"
    )
    turn_rate: float = _parameter(
        3.0, "rad/s", 0.1, 50.0, "how fast a head turns, in the choice by continuity"
    )
    upright: float = _parameter(0.5, "rad", 0.05, 3.0, "how far a head leans, as a rule")
    memory: float = _parameter(
        1.0, "s", 0.05, 10.0, "a head not seen for so long is a head never seen"
    )
    search_growth: float = _parameter(
        0.3, "1", 0.1, 10.0, "of the helmet's size in the picture, searched around where it was"
    )
    work_x: float = _parameter(0.30, "m", -5.0, 5.0, "middle of the work area, in frame cell")
    work_y: float = _parameter(0.0, "m", -5.0, 5.0, "middle of the work area, in frame cell")
    work_z: float = _parameter(0.10, "m", -5.0, 5.0, "middle of the work area, in frame cell")
    yaw_limit: float = _parameter(
        0.70, "rad", 0.05, 3.1, "a face further aside from the work area looks around"
    )
    pitch_limit: float = _parameter(
        0.95, "rad", 0.05, 1.6, "a face further above or below the work area looks around"
    )
    margin: float = _parameter(
        0.10, "rad", 0.0, 0.5, "further inside than the limits, a face is back at the work area"
    )
    look_frames: int = _parameter(
        2, "frames", 1, 50, "seen frames in a row before looking around begins or ends"
    )

    picture_age: float = _parameter(
        0.5, "s", 0.05, 10.0, "pictures older than this, or from the future, are not used"
    )

    def __post_init__(self) -> None:
        for item in fields(self):
            _check(item.name, getattr(self, item.name), type(item.default), item.metadata["range"])
        if not self.window % 2:
            raise ValueError(f"window is {self.window}; it must be odd")
        if self.margin >= min(self.yaw_limit, self.pitch_limit):
            raise ValueError(f"margin is {self.margin}; it must be below both limits")


def load_parameters(values: Mapping[str, Any]) -> HeadParameters:
    """Return the parameters of a mapping; what is not given keeps its default.

    Raises ValueError naming an unknown key or a value out of range.
    """
    known = [item.name for item in fields(HeadParameters)]
    for name in values:
        if name not in known:
            raise ValueError(f"unknown parameter {name!r}; known are {', '.join(known)}")
    return HeadParameters(**values)


def parameter_table() -> str:
    """Return the Markdown table of the parameters for the README."""
    lines = ["| parameter | default | unit | range | meaning |", "| --- | --- | --- | --- | --- |"]
    for item in fields(HeadParameters):
        low, high = item.metadata["range"]
        lines.append(
            f"| `{item.name}` | {item.default} | {item.metadata['unit']} | {low:g}..{high:g} "
            f"| {item.metadata['text']} |"
        )
    return "\n".join(lines)


def _check(name: str, value: Any, kind: type, bounds: Any) -> None:
    numeric = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not numeric or (kind is int and not isinstance(value, int)):
        raise ValueError(f"{name} is {value!r}; it must be of type {kind.__name__}")
    if not math.isfinite(value):
        raise ValueError(f"{name} is {value}; it must be finite")
    if not bounds[0] <= value <= bounds[1]:
        raise ValueError(f"{name} is {value}; it must lie in {bounds[0]}..{bounds[1]}")
