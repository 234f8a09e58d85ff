# SPDX-License-Identifier: BSD-3-Clause
"""Means, spreads, intervals and moving averages."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fabric_study.results import mean_interval


@dataclass(frozen=True)
class Description:
    """What there is to say about a sample; None where it is not defined."""

    n: int
    mean: float | None
    half_width: float | None  # of the 95 % interval of the mean, Student's t
    sd: float | None  # n - 1
    minimum: float | None
    quartile_1: float | None  # linear interpolation (type 7)
    median: float | None
    quartile_3: float | None
    maximum: float | None


def describe(values: ArrayLike) -> Description:
    """Return the description of the values that are not NaN; of nothing n is 0, the rest None."""
    sample = np.asarray(values, float)
    sample = sample[~np.isnan(sample)]
    if sample.size == 0:
        return Description(0, *[None] * 8)
    mean, half = mean_interval(sample.tolist())
    sd = float(sample.std(ddof=1)) if sample.size > 1 else None
    five = (float(value) for value in np.percentile(sample, (0, 25, 50, 75, 100)))
    return Description(int(sample.size), mean, half, sd, *five)


def moving_average(values: Sequence[float], window: int) -> list[float]:
    """Return the mean of the last `window` values up to each one.

    Raises ValueError for a window below 1.
    """
    if window < 1:
        raise ValueError(f"the window is {window}; it must be at least 1")
    return [
        sum(values[max(0, end - window) : end]) / min(end, window)
        for end in range(1, len(values) + 1)
    ]


def snap(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the values without rounding noise: means that are equal on paper tie in ranks."""
    scale = np.abs(values).max(initial=0.0)
    return np.round(values / scale, 10) * scale if scale > 0.0 else values


def midranks(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the ranks from 1 along the last axis, (..., n); ties share their mean rank."""
    one, other = values[..., :, np.newaxis], values[..., np.newaxis, :]
    return 0.5 * ((other < one).sum(axis=-1) + (other <= one).sum(axis=-1) + 1)


def bootstrap_interval(
    table: NDArray[np.float64],
    statistic: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    seed: int,
    resamples: int = 2000,
) -> tuple[float | None, float | None]:
    """Return the 95 % percentile interval of a statistic over resampled people.

    table: (n_people, ...); statistic: takes (resamples, n_people, ...), returns (resamples,), NaN
    where it is not defined. None when it is undefined in more than one resample in twenty.
    """
    chosen = np.random.default_rng(seed).integers(len(table), size=(resamples, len(table)))
    values = statistic(table[chosen])
    values = values[np.isfinite(values)]
    if values.size < 0.95 * resamples:
        return None, None
    low, high = np.percentile(values, (2.5, 97.5))
    return float(low), float(high)
