# SPDX-License-Identifier: BSD-3-Clause
"""A plain classifier to compare with: the nearest training window by dynamic time warping."""

from collections.abc import Sequence

import numpy as np

from fabric_perception.gestures.checks import Array, check_sequence, check_sequences

BAND = 3  # frames that the warping path may leave the diagonal (Sakoe and Chiba)


class NearestWindow:
    """1-NN DTW over windows of one length; labels are whole numbers."""

    def __init__(self, windows: Sequence[Array], labels: Sequence[int]) -> None:
        """windows: each (W, D). Raises ValueError naming a bad window."""
        checked = np.array(check_sequences(windows, labels))
        frames = checked.reshape(-1, checked.shape[2])
        self._centre, scale = frames.mean(axis=0), frames.std(axis=0)
        self._scale = np.where(scale > 0.0, scale, 1.0)
        self._windows = (checked - self._centre) / self._scale
        self._labels = np.array(labels)

    def predict(self, window: Array) -> int:
        """Label of the nearest training window. Raises ValueError for a bad window (W, D)."""
        frames = check_sequence(window, self._windows.shape[2], "window")
        if len(frames) != self._windows.shape[1]:
            raise ValueError(f"window has {len(frames)} frames, want {self._windows.shape[1]}")
        distance = warped_distances((frames - self._centre) / self._scale, self._windows)
        return int(self._labels[int(np.argmin(distance))])


def warped_distances(window: Array, windows: Array) -> Array:
    """(n,) squared DTW distances of a window (W, D) to windows (n, W, D), within BAND."""
    count, size, _ = windows.shape
    local = ((windows[:, None, :, :] - window[None, :, None, :]) ** 2).sum(axis=3)
    cost = np.full((size + 1, size + 1, count), np.inf)
    cost[0, 0] = 0.0
    for i in range(size):
        for j in range(max(0, i - BAND), min(size, i + BAND + 1)):
            before = np.minimum(np.minimum(cost[i, j], cost[i, j + 1]), cost[i + 1, j])
            cost[i + 1, j + 1] = local[:, i, j] + before
    return cost[size, size]
