# SPDX-License-Identifier: BSD-3-Clause
"""Paired comparisons: the same scenarios under two robots."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy import optimize, stats

CONFIDENCE = 0.95
QUANTILES = 4000  # of the chi distribution, in place of an integral


@dataclass(frozen=True)
class Interval:
    """An estimate with its 95 % interval; the ends are NaN where there is none."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Comparison:
    """First minus second over n pairs.

    difference: mean with its interval (Student's t). t, p_t: paired t test, two-sided.
    p_wilcoxon: signed-rank test, two-sided. effect: d_z with its interval (noncentral t). gain:
    difference as a share of the magnitude of the second's mean. p_holm: the larger of both p,
    corrected for the family it was tested in once `holm` was applied.
    """

    n: int
    difference: Interval
    t: float
    p_t: float
    p_wilcoxon: float
    effect: Interval
    gain: float
    p_holm: float


def mean_of(values: Sequence[float]) -> Interval:
    """Return the mean of finite values with its 95 % interval (Student's t)."""
    array = np.asarray(values, dtype=float)
    if array.size == 0 or not np.isfinite(array).all():
        raise ValueError(f"a mean needs finite values, got {array.tolist()}")
    mean = float(array.mean())
    if array.size == 1:
        return Interval(mean, math.nan, math.nan)
    half = stats.t.ppf(0.5 + CONFIDENCE / 2.0, array.size - 1) * stats.sem(array)
    return Interval(mean, mean - float(half), mean + float(half))


def compare(first: Sequence[float], second: Sequence[float]) -> Comparison:
    """Compare pairs, (n,) each, n >= 2. Raises ValueError for other shapes, NaN and infinity."""
    a, b = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        raise ValueError(f"pairs need finite values, got {a.tolist()} and {b.tolist()}")
    if a.shape != b.shape or a.ndim != 1 or a.size < 2:
        raise ValueError(f"pairs need equal lengths of 2 or more, got {a.shape} and {b.shape}")
    difference = a - b
    spread = float(difference.std(ddof=1))
    equal = spread <= 1e-12 * max(1.0, float(np.abs(difference).max()))
    if equal:
        t, p_t = (0.0, 1.0) if abs(difference.mean()) < 1e-12 else (math.inf, 0.0)
        effect = Interval(math.nan, math.nan, math.nan)
    else:
        test = stats.ttest_rel(a, b)
        t, p_t = float(test.statistic), float(test.pvalue)
        effect = effect_size(t, a.size)
    p_wilcoxon = signed_rank(difference)
    base = abs(float(b.mean()))
    gain = float(difference.mean()) / base if base > 0.0 else math.nan
    worse = max(p_t, p_wilcoxon)
    return Comparison(a.size, mean_of(difference), t, p_t, p_wilcoxon, effect, gain, worse)


def signed_rank(differences: np.ndarray) -> float:
    """Return the two-sided p of Wilcoxon's signed-rank test; zeros are dropped, 1 if all are."""
    differences = differences[np.abs(differences) > 1e-12]
    return float(stats.wilcoxon(differences).pvalue) if differences.size else 1.0


def effect_size(t: float, n: int) -> Interval:
    """Return d_z = t / sqrt(n) with its 95 % interval, by inverting the noncentral t."""
    tail = (1.0 - CONFIDENCE) / 2.0
    ends = [_noncentrality(t, n - 1, p) / math.sqrt(n) for p in (1.0 - tail, tail)]
    return Interval(t / math.sqrt(n), *ends)


def noncentral_t_cdf(t: float, degrees: int, noncentrality: float) -> float:
    """Return P(T <= t): the mean of a normal probability over the quantiles of the chi spread.

    scipy's own gives NaN far from the centre.
    """
    return float(stats.norm.cdf(t * _chi_quantiles(degrees) - noncentrality).mean())


@cache
def _chi_quantiles(degrees: int) -> np.ndarray:
    middles = (np.arange(QUANTILES) + 0.5) / QUANTILES
    return np.sqrt(stats.chi2.ppf(middles, degrees) / degrees)


def _noncentrality(t: float, degrees: int, probability: float) -> float:
    """Return the noncentrality under which t is the `probability` quantile."""

    def miss(noncentrality: float) -> float:
        return noncentral_t_cdf(t, degrees, noncentrality) - probability

    reach = 4.0 + abs(t)
    while miss(t - reach) < 0.0 or miss(t + reach) > 0.0:
        reach *= 2.0
    return float(optimize.brentq(miss, t - reach, t + reach))


def holm(comparisons: dict[str, Comparison]) -> dict[str, Comparison]:
    """Return the comparisons with p_holm corrected over the family (Holm 1979)."""
    order = sorted(comparisons, key=lambda name: comparisons[name].p_holm)
    corrected, least = {}, 0.0
    for place, name in enumerate(order):
        factor = len(order) - place
        least = max(least, min(1.0, factor * comparisons[name].p_holm))
        corrected[name] = replace(comparisons[name], p_holm=least)
    return {name: corrected[name] for name in comparisons}


def share_of_way(
    values: Sequence[float], start: Sequence[float], end: Sequence[float], seed: int
) -> Interval:
    """Return how far `values` lie on the way from `start` (0) to `end` (1), by their means.

    values, start, end: (n,), paired. The interval is a percentile bootstrap over the pairs. NaN
    where `start` and `end` cannot be told apart: the interval of their difference contains 0.
    """
    way = mean_of(np.subtract(end, start))
    if not (way.low > 0.0 or way.high < 0.0):
        return Interval(math.nan, math.nan, math.nan)
    table = np.array([values, start, end], dtype=float)
    draws = np.random.default_rng(seed).integers(table.shape[1], size=(4000, table.shape[1]))
    means = table[:, draws].mean(axis=2)
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = (means[0] - means[1]) / (means[2] - means[1])
    value, begin, goal = table.mean(axis=1)
    low, high = np.percentile(shares[np.isfinite(shares)], [2.5, 97.5])
    return Interval(float((value - begin) / (goal - begin)), float(low), float(high))
