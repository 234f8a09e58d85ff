# SPDX-License-Identifier: BSD-3-Clause
"""Two conditions met by the same people: paired t and Wilcoxon's signed-rank test."""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize, stats

from fabric_study.statistics.descriptive import bootstrap_interval, midranks, snap
from fabric_study.statistics.outcome import CONFIDENCE, Effect, NoResult, Outcome, Result

TAIL = (1.0 - CONFIDENCE) / 2.0
LARGEST_EXACT = 60  # differences; beyond it the normal approximation is as good
BOOTSTRAP_SEED = 20260

Floats = NDArray[np.float64]


def t_statistic(differences: Floats) -> Floats:
    """Return t of differences (..., n_people), (...,); NaN where all are equal."""
    mean, sd = differences.mean(axis=-1), spread(differences)
    empty = np.full(np.shape(mean), np.nan)
    return np.divide(mean * np.sqrt(differences.shape[-1]), sd, out=empty, where=sd > 0.0)


def t_p(t: ArrayLike, df: int) -> Floats:
    """Return the two-sided p of t, NaN of NaN."""
    return 2.0 * stats.t.sf(np.abs(t), df)


def spread(values: Floats) -> Floats:
    """Return the standard deviation over the last axis; rounding among equal values counts as 0."""
    sd = values.std(axis=-1, ddof=1)
    return np.where(sd <= 1e-12 * np.abs(values).max(axis=-1), 0.0, sd)


def paired_t(differences: ArrayLike) -> Outcome:
    """Return the paired t test of differences (n_people,), finite.

    Effects: mean difference (interval: Student's t) and Cohen's dz = mean / sd (interval: inverted
    noncentral t).
    """
    values = _checked(differences)
    n = values.size
    if reason := _degenerate(values):
        return NoResult("paired t", reason)
    t = float(t_statistic(values))
    mean = float(values.mean())
    half = float(stats.t.ppf(1.0 - TAIL, n - 1) * values.std(ddof=1) / np.sqrt(n))
    low, high = noncentral_interval(t, n - 1)
    effects = (
        Effect("difference", mean, mean - half, mean + half),
        Effect("dz", t / np.sqrt(n), low / np.sqrt(n), high / np.sqrt(n)),
    )
    return Result("paired t", n, "t", t, (n - 1,), float(t_p(t, n - 1)), effects)


def noncentral_interval(t: float, df: int) -> tuple[float, float]:
    """Return the 95 % interval of the noncentrality of an observed t, by inverting its test."""
    reach = 8.0 + 2.0 * abs(t)

    def bound(share: float) -> float:
        def miss(noncentrality: float) -> float:
            return float(stats.nct.cdf(abs(t), df, noncentrality)) - share

        return float(optimize.brentq(miss, abs(t) - reach, abs(t) + reach, xtol=1e-12))

    with np.errstate(divide="ignore"):  # chances too small for a float are zero
        low, high = bound(1.0 - TAIL), bound(TAIL)
    return (low, high) if t >= 0.0 else (-high, -low)


def wilcoxon(differences: ArrayLike) -> Outcome:
    """Return Wilcoxon's signed-rank test of differences (n_people,), finite.

    Zeros keep their ranks but take no side (Pratt). The p-value is exact given the ranks, ties
    and zeros included, up to LARGEST_EXACT differences. Effects: mean difference, and the
    rank-biserial correlation (rank sum for minus rank sum against, over all ranks; interval:
    bootstrap over people).
    """
    name = "Wilcoxon signed-rank"
    values = snap(_checked(differences))
    n = values.size
    if n < 2:
        return NoResult(name, f"needs at least two people, there {_are(n)}")
    if not values.any():
        return NoResult(name, f"all {n} differences are zero")
    up, p = signed_rank(values)
    low, high = bootstrap_interval(values, rank_biserial, BOOTSTRAP_SEED)
    effects = (
        Effect("difference", float(values.mean())),
        Effect("r_rb", float(rank_biserial(values)), low, high),
    )
    note = "exact" if n <= LARGEST_EXACT else "normal approximation"
    return Result(name, n, "W+", up, (), p, effects, note)


def signed_rank(differences: Floats) -> tuple[float, float]:
    """Return the rank sum of the positive differences (n,) and its two-sided p, see `wilcoxon`."""
    doubled = np.rint(2.0 * midranks(np.abs(differences))).astype(int)
    up = int(doubled[differences > 0.0].sum())
    sides = doubled[differences != 0.0]
    exact = differences.size <= LARGEST_EXACT
    return up / 2.0, _exact_p(sides, up) if exact else _normal_p(sides, up)


def rank_biserial(differences: Floats) -> Floats:
    """Return the matched-pairs rank-biserial correlation of differences (..., n), Pratt ranks."""
    ranks = midranks(np.abs(differences))
    return (ranks * np.sign(differences)).sum(axis=-1) / ranks.sum(axis=-1)


def _exact_p(doubled: NDArray[np.int_], up: int) -> float:
    """Two-sided p of the doubled rank sum `up` over all signs of these doubled ranks."""
    ways = np.zeros(int(doubled.sum()) + 1)
    ways[0] = 1.0
    for rank in doubled:
        shifted = np.zeros_like(ways)
        shifted[rank:] = ways[: ways.size - rank]
        ways = 0.5 * (ways + shifted)
    return float(min(1.0, 2.0 * min(ways[: up + 1].sum(), ways[up:].sum())))


def _normal_p(doubled: NDArray[np.int_], up: int) -> float:
    z = (up - 0.5 * doubled.sum()) / np.sqrt(0.25 * (doubled.astype(float) ** 2).sum())
    return float(2.0 * stats.norm.sf(abs(z)))


def _checked(differences: ArrayLike) -> Floats:
    values = np.asarray(differences, float)
    if values.ndim != 1 or not np.isfinite(values).all():
        raise ValueError(f"differences must be finite, one a person: {values}")
    return values


def _degenerate(values: Floats) -> str:
    if values.size < 2:
        return f"needs at least two people, there {_are(values.size)}"
    if spread(values) == 0.0:
        return f"all {values.size} differences are {values[0]:g}, without any spread"
    return ""


def _are(n: int) -> str:
    return "is one" if n == 1 else "is none"
