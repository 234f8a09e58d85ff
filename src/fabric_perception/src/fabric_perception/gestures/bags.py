# SPDX-License-Identifier: BSD-3-Clause
"""Recorded bags as labelled recordings: what the tracker published, and a table of what was done.

Beside `P07_monday.bag` lies `P07_monday.csv`: columns start, end (s since the first message of the
hand) and label (idle, grasp, warn or other). The person is what stands before the first underscore.
Moments in no row of the table are not used.
"""

import csv
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fabric_perception.gestures.checks import Array
from fabric_perception.gestures.features import FeatureSettings
from fabric_perception.gestures.recogniser import object_of_interest
from fabric_perception.gestures.recording import LABELS, UNLABELLED, Recording

HAND, CUBES = "human/hand", "cell/cubes"
COLUMNS = ("start", "end", "label")


class RecordingError(ValueError):
    """A recording cannot be used; the message names the file, the row and what is wrong."""


def read_folder(folder: str | Path, features: FeatureSettings) -> list[Recording]:
    """Return every labelled bag of a folder, in the order of their names.

    Raises RecordingError when there is none, a table is missing, or a file cannot be used.
    """
    bags = sorted(Path(folder).glob("*.bag"))
    if not bags:
        raise RecordingError(f"{folder}: holds no .bag")
    return [read_bag(path, features) for path in bags]


def read_bag(path: Path, features: FeatureSettings) -> Recording:
    """Return one bag with the labels of the table beside it. Raises RecordingError."""
    rows = read_labels(path.with_suffix(".csv"))
    t, hand, target = _read_messages(path, np.array(features.pick_point))
    labels = np.full(len(t), UNLABELLED)
    for start, end, label in rows:
        labels[(t - t[0] >= start) & (t - t[0] < end)] = label
    if np.all(labels == UNLABELLED):
        raise RecordingError(f"{path}: no row of its table falls into its {t[-1] - t[0]:.1f} s")
    try:
        return Recording(path.stem.split("_")[0], t, hand, target, labels)
    except ValueError as error:
        raise RecordingError(f"{path}: {error}") from None


def read_labels(path: Path) -> list[tuple[float, float, int]]:
    """Return the rows (start s, end s, index into LABELS) of a table, in order of time.

    Raises RecordingError naming file, row and value.
    """
    try:
        with path.open(newline="", encoding="utf-8") as file:
            lines = list(csv.reader(file))
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror}") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise RecordingError(f"{path}: is no table: {error}") from None
    if not lines or tuple(lines[0]) != COLUMNS:
        raise RecordingError(f"{path}: the first line must be {','.join(COLUMNS)}")
    rows: list[tuple[float, float, int]] = []
    for number, line in enumerate(lines[1:], 2):
        if line:
            rows.append(_row(f"{path} line {number}", line, rows[-1][1] if rows else 0.0))
    return rows


def _row(where: str, line: list[str], after: float) -> tuple[float, float, int]:
    if len(line) != len(COLUMNS):
        raise RecordingError(f"{where}: has {len(line)} columns; {len(COLUMNS)} are needed")
    try:
        start, end = float(line[0]), float(line[1])
    except ValueError:
        raise RecordingError(f"{where}: start and end are {line[0]!r}, {line[1]!r}") from None
    if not (math.isfinite(start) and math.isfinite(end) and after <= start < end):
        raise RecordingError(f"{where}: {start} to {end} s does not follow on {after} s")
    if line[2] not in LABELS:
        raise RecordingError(
            f"{where}: label is {line[2]!r}; it must be one of {', '.join(LABELS)}"
        )
    return start, end, LABELS.index(line[2])


def _read_messages(path: Path, pick_point: Array) -> tuple[Array, Array, Array]:
    """Times (n,) s, hand and object of interest (n, 3) m, of the stamps of the hand's messages."""
    nothing, target = np.full(3, np.nan), np.full(3, np.nan)
    times, hands, targets = [], [], []
    try:
        for topic, message, _ in _messages(path):
            if topic.endswith(CUBES):
                found = object_of_interest(message.cubes, pick_point)
                target = nothing if found is None else found
            elif not times or message.header.stamp.to_sec() > times[-1]:
                times.append(message.header.stamp.to_sec())
                hands.append(_hand(message))
                targets.append(target)
    except ValueError as error:
        raise RecordingError(f"{path}: {error}") from None
    if not times:
        raise RecordingError(f"{path}: has no messages of {HAND}; run it through the tracker first")
    return np.array(times), np.array(hands), np.array(targets)


def _messages(path: Path) -> Iterator[tuple[str, Any, Any]]:
    """Topic, message and time of arrival of everything that counts in a bag."""
    import rosbag  # noqa: PLC0415

    try:
        with rosbag.Bag(str(path)) as bag:
            yield from bag.read_messages(topics=_spelled(HAND) + _spelled(CUBES))
    except (OSError, rosbag.ROSBagException) as error:
        raise RecordingError(f"{path}: cannot be read: {error}") from None


def _spelled(topic: str) -> list[str]:
    return [topic, f"/{topic}"]


def _hand(message: Any) -> Array:
    at = message.position
    return np.array([at.x, at.y, at.z]) if message.visible else np.full(3, np.nan)
