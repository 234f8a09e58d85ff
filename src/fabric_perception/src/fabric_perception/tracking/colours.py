# SPDX-License-Identifier: BSD-3-Clause
"""Which HSV values are which colour, kept in a YAML file.

Hue, saturation and value as OpenCV scales them for 8 bits: 0..179, 0..255, 0..255. A span of hues
may wrap at red: [172, 8] is 172..179 and 0..8.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import yaml

from fabric_msgs.msg import Cube
from fabric_perception.tracking.settings import Settings, SettingsError

HUES = 180
GLOVE = "glove"
CUBES = {"red": Cube.COLOUR_RED, "green": Cube.COLOUR_GREEN, "blue": Cube.COLOUR_BLUE}
NAMES = (*CUBES, GLOVE)


class Limits(NamedTuple):
    """What counts as one colour; spans are inclusive."""

    hue: tuple[int, int]  # from, to; wraps when from > to
    saturation: tuple[int, int]
    value: tuple[int, int]

    def hue_spans(self) -> list[tuple[int, int]]:
        """The hues as one or two spans that do not wrap."""
        low, high = self.hue
        return [(low, high)] if low <= high else [(low, HUES - 1), (0, high)]

    def hues(self) -> np.ndarray:
        """(180,) bool: whether a hue belongs to the colour."""
        belongs = np.zeros(HUES, dtype=bool)
        for low, high in self.hue_spans():
            belongs[low : high + 1] = True
        return belongs

    def matches(self, hsv: np.ndarray) -> np.ndarray:
        """Return (...,) bool for HSV values (..., 3) uint8."""
        inside = self.hues()[np.minimum(hsv[..., 0], HUES - 1)]
        for channel, (low, high) in ((1, self.saturation), (2, self.value)):
            inside &= (hsv[..., channel] >= low) & (hsv[..., channel] <= high)
        return inside


@dataclass(frozen=True)
class Palette:
    """Limits of the three colours of cubes and of the glove.

    Raises SettingsError naming a missing colour, an empty span, or two colours that share hues.
    """

    limits: Mapping[str, Limits]
    source: str = "the palette"

    def __post_init__(self) -> None:
        for name in NAMES:
            if name not in self.limits:
                raise SettingsError(f"{self.source}: colour {name} is missing")
        for name, limits in self.limits.items():
            if name not in NAMES:
                known = ", ".join(NAMES)
                raise SettingsError(f"{self.source}: unknown colour {name!r}; known are {known}")
            _check(self.source, name, limits)
        self._check_overlaps()

    @classmethod
    def load(cls, path: str | Path) -> "Palette":
        """Read a file. Raises SettingsError naming file, entry and value."""
        file = Settings.read(path)
        colours = file.branch("colours")
        return cls({name: _limits(colours.branch(name)) for name in colours.names()}, str(path))

    def save(self, path: str | Path) -> None:
        """Write the limits; an existing file is replaced in one step or stays as it is."""
        lines = [
            "# SPDX-License-Identifier: BSD-3-Clause",
            "# Colours as OpenCV's HSV: hue 0..179 (a span may wrap, as red does), saturation and",
            "# value 0..255. Written by tune_colours.py, which docs/cameras.md explains.",
            "colours:",
        ]
        width = max(map(len, self.limits)) + 1
        for name, limits in self.limits.items():
            spans = (f"{key}: [{a}, {b}]" for key, (a, b) in limits._asdict().items())
            lines.append(f"  {name + ':':{width}} {{{', '.join(spans)}}}")
        text = "\n".join(lines) + "\n"
        yaml.safe_load(text)
        part = Path(path).with_name(f".{Path(path).name}.part")
        part.write_text(text, encoding="utf-8")
        os.replace(part, path)

    def _check_overlaps(self) -> None:
        owners: dict[int, str] = {}
        for name, limits in self.limits.items():
            for hue in np.flatnonzero(limits.hues()):
                other = owners.setdefault(int(hue), name)
                if other != name:
                    raise SettingsError(f"{self.source}: hue {hue} is both {other} and {name}")


def _limits(entries: Settings) -> Limits:
    return Limits(
        entries.span("hue", HUES - 1), entries.span("saturation", 255), entries.span("value", 255)
    )


def _check(source: str, name: str, limits: Limits) -> None:
    spans = {"saturation": (limits.saturation, 255), "value": (limits.value, 255)}
    for key, ((low, high), top) in spans.items():
        if not 0 <= low <= high <= top:
            raise SettingsError(
                f"{source}: {name}.{key} is [{low}, {high}]; want 0 <= from <= to <= {top}"
            )
    if not all(0 <= hue < HUES for hue in limits.hue):
        raise SettingsError(f"{source}: {name}.hue is {list(limits.hue)}; want 0..{HUES - 1}")
