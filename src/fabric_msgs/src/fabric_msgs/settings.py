# SPDX-License-Identifier: BSD-3-Clause
"""Settings as fields of frozen dataclasses: one place for default, unit, range and meaning.

@dataclass(frozen=True)
class HandSettings:
    lost: float = setting(0.5, "s", 0.05, 10.0, "out of view this long, looked for anywhere")

    def __post_init__(self) -> None:
        check_settings(self)
"""

import math
from collections.abc import Mapping
from dataclasses import field, fields
from typing import Any, TypeVar

Settings = TypeVar("Settings")


def setting(default: Any, unit: str, low: float, high: float, text: str) -> Any:
    """A field that is checked: a number from low to high, or a span, two numbers that grow."""
    return field(default=default, metadata={"unit": unit, "range": (low, high), "text": text})


def check_settings(settings: Any) -> None:
    """Raise ValueError naming the first `setting` that is of another kind or out of its range."""
    for item in fields(settings):
        if "range" in item.metadata:
            value = getattr(settings, item.name)
            if isinstance(item.default, tuple):
                _check_span(item.name, value, item.metadata["range"])
            else:
                _check_number(item.name, value, item.metadata["range"], type(item.default))


def settings_from(kind: type[Settings], values: Mapping[str, Any]) -> Settings:
    """Return settings of this kind; what is not given keeps its default, a list is a tuple.

    Raises ValueError naming an unknown key or a bad value.
    """
    known = [item.name for item in fields(kind)]  # type: ignore[arg-type]
    for name in values:
        if name not in known:
            raise ValueError(f"unknown parameter {name!r}; known are {', '.join(known)}")
    return kind(**{k: tuple(v) if isinstance(v, list) else v for k, v in values.items()})


def settings_table(kind: type) -> str:
    """Return the Markdown table of the settings for a README."""
    lines = ["| parameter | default | unit | range | meaning |", "| --- | --- | --- | --- | --- |"]
    for item in fields(kind):
        low, high = item.metadata["range"]
        lines.append(
            f"| `{item.name}` | {item.default} | {item.metadata['unit']} | {low:g}..{high:g} "
            f"| {item.metadata['text']} |"
        )
    return "\n".join(lines)


def _check_number(name: str, value: Any, bounds: tuple[float, float], kind: type) -> None:
    numeric = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not numeric or (kind is int and not isinstance(value, int)):
        raise ValueError(f"{name} is {value!r}; it must be of type {kind.__name__}")
    if not math.isfinite(value):
        raise ValueError(f"{name} is {value}; it must be finite")
    if not bounds[0] <= value <= bounds[1]:
        raise ValueError(f"{name} is {value}; it must lie in {bounds[0]:g}..{bounds[1]:g}")


def _check_span(name: str, value: Any, bounds: tuple[float, float]) -> None:
    if not isinstance(value, tuple) or len(value) != 2:
        raise ValueError(f"{name} is {value!r}; it must be two numbers")
    for number in value:
        _check_number(name, number, bounds, float)
    if not value[0] < value[1]:
        raise ValueError(f"{name} is {value!r}; the second number must be larger")
