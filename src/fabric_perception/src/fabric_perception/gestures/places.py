# SPDX-License-Identifier: BSD-3-Clause
"""The places that features refer to, from the cell's own file."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from fabric_perception.gestures.features import FeatureSettings
from fabric_perception.tracking.settings import Settings
from fabric_perception.tracking.workspace import Frame


def in_cell(features: FeatureSettings, path: str | Path) -> FeatureSettings:
    """Return the features with pick point and resting place of a cell.yaml, m in frame cell.

    Raises SettingsError (a ValueError) naming file, entry and value.
    """
    file = Settings.read(path)
    frames = file.branch("frames")
    rest = _numbers(file.branch("person").branch("rest"), "xyz")
    pick_point = np.array([0.0, 0.0, file.branch("cube").number("edge", 0.005, 0.2) / 2])
    return replace(
        features,
        pick_point=_place(frames.branch("conveyor"), pick_point),
        rest=_place(frames.branch("person"), rest),
    )


def _place(frame: Settings, point: np.ndarray) -> tuple[float, ...]:
    there = Frame(*_numbers(frame, Frame._fields)).to_cell(point)
    return tuple(round(float(x), 9) for x in there)


def _numbers(entries: Settings, names: str | tuple[str, ...]) -> np.ndarray:
    return np.array([entries.number(name) for name in names])
