# SPDX-License-Identifier: BSD-3-Clause
"""How many people the next study needs, from the differences that this one found in people."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from fabric_study.statistics.outcome import ALPHA, NoResult
from fabric_study.statistics.pairs import spread, t_statistic

SIZES = (4, 6, 8, 10, 12, 14, 16, 20, 24, 32, 40)
TARGET = 0.8
STUDIES = 2000  # simulated a size, for the curve
OUTER, INNER = 200, 200  # resampled populations, studies in each: for the interval
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class PowerCurve:
    """Chance of p < .05 in the paired t test, for each number of people."""

    sizes: tuple[int, ...]
    power: tuple[float, ...]  # if people are as those seen
    low: tuple[float, ...]  # 95 % interval: those seen are a sample themselves
    high: tuple[float, ...]
    needed: int | None  # smallest size with power >= TARGET; None: more than the largest


def power_curve(
    differences: ArrayLike, seed: int, sizes: Sequence[int] = SIZES
) -> PowerCurve | NoResult:
    """Return the power curve of per-person differences (n_people,), by bootstrap.

    Studies draw people with replacement from those seen, whose spread is widened by
    sqrt(n / (n - 1)) so that it equals the unbiased estimate. The interval repeats this with
    resampled people.
    """
    values = np.asarray(differences, float)
    if values.size < 3 or spread(values) == 0.0:
        return NoResult("power", "needs three people and differences that are not all equal")
    random = np.random.default_rng(seed)
    resampled = values[random.integers(values.size, size=(OUTER, values.size))]
    power, low, high = [], [], []
    for size in sizes:
        power.append(float(_power(values[np.newaxis], size, STUDIES, random)[0]))
        ends = np.percentile(_power(resampled, size, INNER, random), (2.5, 97.5))
        low.append(float(ends[0]))
        high.append(float(ends[1]))
    needed = next(
        (size for size, chance in zip(sizes, power, strict=True) if chance >= TARGET), None
    )
    return PowerCurve(tuple(sizes), tuple(power), tuple(low), tuple(high), needed)


def _power(populations: Floats, size: int, studies: int, random: np.random.Generator) -> Floats:
    """Return the power of each population (populations, n) at this number of people."""
    n = populations.shape[-1]
    mean = populations.mean(axis=-1, keepdims=True)
    widened = mean + (populations - mean) * np.sqrt(n / (n - 1))
    chosen = random.integers(n, size=(len(populations), studies, size))
    drawn = np.take_along_axis(widened[:, np.newaxis, :], chosen, axis=-1)
    critical = stats.t.ppf(1.0 - ALPHA / 2.0, size - 1)
    return np.mean(np.abs(np.nan_to_num(t_statistic(drawn))) > critical, axis=-1)
