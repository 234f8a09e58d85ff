# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of the observation agent: one place for unit, range and default."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any


def _parameter(default: Any, unit: str, low: float, high: float, text: str) -> Any:
    return field(default=default, metadata={"unit": unit, "range": (low, high), "text": text})


@dataclass(frozen=True)
class ObservationParameters:
    """How percepts become observations (Fig. 6.5); raises ValueError naming a bad value."""

    same_action_timeout: float = _parameter(
        3.0, "s", 0.1, 60.0, "an observation is due this long after the last one (6.3.1.3)"
    )
    action_threshold: float = _parameter(
        0.5, "1", 0.25, 1.0, "a gesture counts only with at least this posterior probability"
    )
    action_percepts: int = _parameter(
        2, "percepts", 1, 20, "equal percepts in a row before another gesture is believed"
    )
    detection_percepts: int = _parameter(
        2, "percepts", 1, 50, "percepts in a row before the person counts as come or gone"
    )
    head_percepts: int = _parameter(
        2, "percepts", 1, 50, "percepts in a row before looking around begins or ends"
    )
    warning_hold: float = _parameter(
        1.0, "s", 0.0, 10.0, "a warning told by the fast road lasts at least this long"
    )
    settling_time: float = _parameter(
        2.0, "s", 0.0, 10.0, "time for a placement to be reported before an attempt has failed"
    )
    evidence_age_limit: float = _parameter(
        1.0, "s", 0.1, 10.0, "gesture evidence older than this is not used"
    )

    pairing_tolerance: float = _parameter(
        0.0,
        "s",
        0.0,
        0.5,
        "hands and head seen so far apart are of one moment; 0: equal stamps",
    )

    def __post_init__(self) -> None:
        for item in fields(self):
            _check(item.name, getattr(self, item.name), type(item.default), item.metadata["range"])


def _check(name: str, value: Any, kind: type, bounds: Any) -> None:
    numeric = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not numeric or (kind is int and not isinstance(value, int)):
        raise ValueError(f"{name} is {value!r}; it must be of type {kind.__name__}")
    if not math.isfinite(value):
        raise ValueError(f"{name} is {value}; it must be finite")
    if not bounds[0] <= value <= bounds[1]:
        raise ValueError(f"{name} is {value}; it must lie in {bounds[0]}..{bounds[1]}")


def load_parameters(values: Mapping[str, Any]) -> ObservationParameters:
    """Return the parameters of a mapping; what is not given keeps its default.

    Raises ValueError naming an unknown key or a value out of range.
    """
    known = [item.name for item in fields(ObservationParameters)]
    for name in values:
        if name not in known:
            raise ValueError(f"unknown parameter {name!r}; known are {', '.join(known)}")
    return ObservationParameters(**values)


def parameter_table() -> str:
    """Return the Markdown table of the parameters for the README."""
    lines = ["| parameter | default | unit | range | meaning |", "| --- | --- | --- | --- | --- |"]
    for item in fields(ObservationParameters):
        low, high = item.metadata["range"]
        lines.append(
            f"| `{item.name}` | {item.default} | {item.metadata['unit']} | {low:g}..{high:g} "
            f"| {item.metadata['text']} |"
        )
    return "\n".join(lines)
