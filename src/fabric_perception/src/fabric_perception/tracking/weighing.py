# SPDX-License-Identifier: BSD-3-Clause
"""The load cells of several trays: raw readings become cubes that were put in or taken out."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any, NamedTuple

from fabric_perception.load_cells import ScaleParameters, TrayScale


class TrayChange(NamedTuple):
    """So many cubes were put into a tray, or taken out if negative, at t (s)."""

    tray: int
    t: float
    cubes: int


class Scales:
    """One scale a tray, made when the first reading of it comes. The trays start empty."""

    def __init__(self, parameters: ScaleParameters) -> None:
        self._parameters = parameters
        self.reset()

    def reset(self) -> None:
        """The trays were emptied."""
        self._scales: dict[int, TrayScale] = {}

    def read(
        self, t: float, period: float, trays: Sequence[int], counts: Sequence[int]
    ) -> list[TrayChange]:
        """Take the readings since the last call; return what changed, in order.

        t: s, of the last reading. period: s between two. trays: ids. counts: reading by reading, in
        each a value for every tray. Raises ValueError when they do not fit or t is not later.
        """
        if not trays or len(counts) % len(trays):
            raise ValueError(f"{len(counts)} counts are not whole readings of {len(trays)} trays")
        readings = len(counts) // len(trays)
        changes = []
        for number in range(readings):
            moment = t - (readings - 1 - number) * period
            for place, tray in enumerate(trays):
                scale = self._scales.setdefault(tray, TrayScale(self._parameters))
                change = scale.step(moment, counts[number * len(trays) + place])
                if change is not None:
                    changes.append(TrayChange(tray, change.t, change.cubes))
        return changes


def scale_parameters(values: Mapping[str, Any]) -> ScaleParameters:
    """Return the parameters of a mapping. Raises ValueError naming an unknown or missing key."""
    known = [item.name for item in fields(ScaleParameters)]
    for name, value in values.items():
        if name not in known:
            raise ValueError(f"unknown parameter {name!r}; known are {', '.join(known)}")
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ValueError(f"{name} is {value!r}; it must be a number")
    for name in ("counts_per_gram", "cube"):
        if name not in values:
            raise ValueError(f"{name} is missing")
    return ScaleParameters(**values)
