# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of the tracker: one place for unit, range and default."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any


def _parameter(default: float, unit: str, low: float, high: float, text: str) -> Any:
    return field(default=default, metadata={"unit": unit, "range": (low, high), "text": text})


@dataclass(frozen=True)
class TrackingParameters:
    """How pictures become tracks; raises ValueError naming a bad value."""

    ground_margin: float = _parameter(
        0.008, "m", 0.0, 0.05, "pixels less than this above belt, table or container are ground"
    )
    least_area: int = _parameter(40, "pixels", 4, 5000, "smaller patches are noise")
    depth_share: float = _parameter(
        0.15, "1", 0.0, 1.0, "of a patch's pixels must have a depth, else its place is inferred"
    )
    cube_least: float = _parameter(
        0.35, "edges", 0.1, 1.0, "a patch narrower than this is no cube: side of an equal square"
    )
    cube_most: float = _parameter(
        1.5, "edges", 1.1, 3.0, "a wider one is several cubes in a container, and none elsewhere"
    )
    cube_noise: float = _parameter(
        0.003, "m", 1e-4, 0.05, "standard deviation of the place of a cube in full view"
    )
    cube_push: float = _parameter(
        0.5, "m/s^2", 0.01, 50.0, "how hard a cube on the belt may speed up (standard deviation)"
    )
    carried_push: float = _parameter(6.0, "m/s^2", 0.01, 50.0, "the same for a cube in a hand")
    gate: float = _parameter(
        0.9, "edges", 0.3, 3.0, "a cube may be so far from where it is expected"
    )
    lift: float = _parameter(0.5, "edges", 0.2, 2.0, "a cube so far above its ground is carried")
    hand_reach: float = _parameter(
        0.09, "m", 0.02, 0.3, "from the middle of the glove to a cube it can hold"
    )
    cup_reach: float = _parameter(
        0.025,
        "m",
        0.005,
        0.1,
        "from the end of the suction cup to the middle of a cube it can hold",
    )
    contact_memory: float = _parameter(
        1.5, "s", 0.1, 10.0, "how long ago a hand or the cup may have been at a cube that is gone"
    )
    trail: float = _parameter(
        3.0, "s", 0.5, 10.0, "how far back along a carrier's way a released cube is looked for"
    )
    birth_pictures: int = _parameter(
        2, "pictures", 1, 20, "in a row in which a new cube must be seen before it gets a number"
    )
    rest_pictures: int = _parameter(
        2, "pictures", 1, 20, "in a row in which a released cube must be seen lying"
    )
    rest_speed: float = _parameter(0.05, "m/s", 0.001, 0.5, "slower is lying still")
    lost_after: float = _parameter(
        1.0, "s", 0.1, 10.0, "a cube missing this long from a place in view is not reported"
    )
    doubt_time: float = _parameter(
        5.0, "s", 0.1, 60.0, "confidence falls by 1/e for every such time out of view"
    )
    glove_area: tuple[float, float] = (0.0030, 0.0300)
    glove_length: tuple[float, float] = (0.07, 0.30)
    glove_elongation: float = _parameter(
        4.0, "1", 1.0, 20.0, "a glove is at most so many times longer than wide"
    )
    glove_solidity: float = _parameter(
        0.55, "1", 0.0, 1.0, "a glove fills at least this share of its convex hull"
    )
    glove_height: float = _parameter(
        0.02, "m", 0.0, 0.3, "a glove's middle is at least so far above table, belt or container"
    )
    glove_relief: float = _parameter(
        0.004, "m", 0.0, 0.1, "a glove is not flat: spread of its heights, at least"
    )
    hand_noise: float = _parameter(
        0.006, "m", 1e-4, 0.1, "standard deviation of the measured place of the glove"
    )
    hand_push: float = _parameter(
        2.5, "m/s^2", 0.1, 100.0, "how hard a hand may speed up (standard deviation)"
    )
    hand_thickness: float = _parameter(
        0.02, "m", 0.0, 0.1, "from the seen side of the glove to its middle"
    )
    hand_gate: float = _parameter(
        0.35, "m", 0.05, 2.0, "a glove may be so far from where it is expected"
    )
    hand_lost: float = _parameter(
        0.5, "s", 0.05, 10.0, "a hand out of view this long is looked for anywhere"
    )
    step_delay: float = _parameter(
        2.5, "s", 0.1, 10.0, "a load cell tells of a cube at most so long after it was put down"
    )
    step_patience: float = _parameter(
        4.0, "s", 0.1, 30.0, "how long a load cell's step waits for the cube it belongs to"
    )
    unweighed_after: float = _parameter(
        4.0, "s", 0.1, 60.0, "a cube lying in a person's tray counts without a load cell after this"
    )
    stale_after: float = _parameter(0.5, "s", 0.01, 10.0, "older pictures are not used")

    def __post_init__(self) -> None:
        for item in fields(self):
            if item.metadata:
                _check(item.name, getattr(self, item.name), item)
            else:
                _check_span(item.name, getattr(self, item.name))


def load_parameters(values: Mapping[str, Any]) -> TrackingParameters:
    """Return the parameters of a mapping; what is not given keeps its default.

    Raises ValueError naming an unknown key or a value out of range.
    """
    known = {item.name: item for item in fields(TrackingParameters)}
    for name in values:
        if name not in known:
            raise ValueError(f"unknown parameter {name!r}; known are {', '.join(known)}")
    spans = {name for name, item in known.items() if not item.metadata}
    return TrackingParameters(
        **{
            name: tuple(value) if name in spans and isinstance(value, list) else value
            for name, value in values.items()
        }
    )


def _check(name: str, value: Any, item: Any) -> None:
    low, high = item.metadata["range"]
    whole = isinstance(item.default, int)
    if isinstance(value, bool) or not isinstance(value, int if whole else int | float):
        kind = "whole number" if whole else "number"
        raise ValueError(f"{name} is {value!r}; it must be a {kind}")
    if not math.isfinite(value):
        raise ValueError(f"{name} is {value}; it must be finite")
    if not low <= value <= high:
        raise ValueError(f"{name} is {value}; it must lie in {low}..{high}")


def _check_span(name: str, value: Any) -> None:
    two = isinstance(value, tuple) and len(value) == 2
    if not two or not all(isinstance(v, int | float) and math.isfinite(v) for v in value):
        raise ValueError(f"{name} is {value!r}; it must be two finite numbers")
    if not 0.0 < value[0] < value[1]:
        raise ValueError(f"{name} is {value!r}; it must be two growing numbers above zero")


def parameter_table() -> str:
    """Return the Markdown table of the parameters for the README."""
    lines = ["| parameter | default | unit | range | meaning |", "| --- | --- | --- | --- | --- |"]
    for item in fields(TrackingParameters):
        data = item.metadata or SPANS[item.name]
        low, high = data["range"]
        lines.append(
            f"| `{item.name}` | {item.default} | {data['unit']} | {low:g}..{high:g} "
            f"| {data['text']} |"
        )
    return "\n".join(lines)


SPANS = {
    "glove_area": {
        "unit": "m^2",
        "range": (0.0, math.inf),
        "text": "a smaller or larger yellow patch is no glove",
    },
    "glove_length": {
        "unit": "m",
        "range": (0.0, math.inf),
        "text": "the longer side of a glove",
    },
}
