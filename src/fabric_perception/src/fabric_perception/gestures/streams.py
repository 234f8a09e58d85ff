# SPDX-License-Identifier: BSD-3-Clause
"""Labelled streams: one recording, in which gestures follow on each other."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fabric_perception.gestures.checks import Array, check_sequence
from fabric_perception.gestures.model import with_context

LEAST_FRAMES = 2  # of a stretch that teaches anything


class Stream(NamedTuple):
    """frames: (n, D), rows of NaN where nothing was seen. labels: (n,) names, "" where unknown."""

    frames: Array
    labels: Sequence[str]


def segments(stream: Stream, lags: Sequence[int]) -> list[tuple[str, Array]]:
    """Return the stretches of one label, (label, frames (m, L D) with their context).

    Frames in which nothing was seen are left out; as context, what was seen last stands in for
    them. Raises ValueError when lengths differ or a number is not finite.
    """
    frames = np.asarray(stream.frames, dtype=float)
    if frames.ndim != 2 or len(frames) != len(stream.labels) or not len(frames):
        raise ValueError(f"frames {frames.shape} and {len(stream.labels)} labels are no stream")
    seen = ~np.isnan(frames).all(axis=1)
    if not seen.any():
        return []
    check_sequence(frames[seen], name="stream")
    last = np.maximum.accumulate(np.where(seen, np.arange(len(frames)), -1))
    filled = frames[np.where(last < 0, int(np.argmax(seen)), last)]
    context = with_context(filled, np.array(lags))
    names = np.array(stream.labels, dtype=object)
    borders = np.flatnonzero(names[1:] != names[:-1]) + 1
    found = []
    for first, end in zip([0, *borders], [*borders, len(frames)], strict=True):
        mine = context[first:end][seen[first:end]]
        if names[first] and len(mine) >= LEAST_FRAMES:
            found.append((str(names[first]), mine))
    return found
