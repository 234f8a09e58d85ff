# SPDX-License-Identifier: BSD-3-Clause
"""Three and more conditions met by the same people: repeated-measures ANOVA and Friedman's test."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import linalg, stats

from fabric_study.statistics.descriptive import bootstrap_interval, midranks, snap
from fabric_study.statistics.outcome import Effect, NoResult, Outcome, Result

BOOTSTRAP_SEED = 20261
Floats = NDArray[np.float64]


class Anova(NamedTuple):
    """Arrays (...,), NaN where there is no spread."""

    F: Floats
    epsilon: Floats  # Greenhouse-Geisser, 1 / (k - 1) .. 1
    p: Floats  # with epsilon
    ges: Floats  # generalized eta squared


def anova_statistics(tables: Floats) -> Anova:
    """Return the repeated-measures ANOVA of tables (..., n_people, k conditions).

    F = MS(condition) / MS(condition x person); its degrees of freedom are multiplied by epsilon
    = tr(S)^2 / ((k - 1) tr(S^2)), S the double-centred covariance of the conditions; ges
    = SS(condition) / (SS(condition) + SS(person) + SS(condition x person)).
    """
    n, k = tables.shape[-2:]
    grand = tables.mean(axis=(-2, -1), keepdims=True)
    people = tables.mean(axis=-1, keepdims=True) - grand
    conditions = tables.mean(axis=-2, keepdims=True) - grand
    rest = tables - grand - people - conditions
    ss_condition = n * (conditions**2).sum(axis=(-2, -1))
    ss_person = k * (people**2).sum(axis=(-2, -1))
    ss_rest = (rest**2).sum(axis=(-2, -1))
    ss_rest = np.where(ss_rest <= 1e-24 * (tables**2).sum(axis=(-2, -1)), 0.0, ss_rest)
    S = np.swapaxes(rest, -1, -2) @ rest  # proportional: its scale cancels
    with np.errstate(divide="ignore", invalid="ignore"):
        epsilon = np.trace(S, axis1=-2, axis2=-1) ** 2 / ((k - 1) * (S**2).sum(axis=(-2, -1)))
        F = np.where(ss_rest > 0.0, (n - 1) * ss_condition / ss_rest, np.nan)
        ges = ss_condition / (ss_condition + ss_person + ss_rest)
    p = stats.f.sf(F, epsilon * (k - 1), epsilon * (k - 1) * (n - 1))
    return Anova(F, epsilon, p, ges)


def repeated_anova(table: ArrayLike) -> Outcome:
    """Return the ANOVA of a complete table (n_people, k >= 3), Greenhouse-Geisser corrected.

    Effects: generalized eta squared (interval: bootstrap over people) and epsilon.
    """
    name = "repeated-measures ANOVA"
    values = _checked(table)
    n, k = values.shape
    if n < 2:
        return NoResult(name, f"needs at least two people with every condition, there {_are(n)}")
    anova = Anova(*(float(part) for part in anova_statistics(values)))
    if not np.isfinite(anova.F):
        return NoResult(name, "the conditions differ by the same amount in all people")
    df = (anova.epsilon * (k - 1), anova.epsilon * (k - 1) * (n - 1))
    interval = bootstrap_interval(
        values, lambda tables: anova_statistics(tables).ges, BOOTSTRAP_SEED
    )
    effects = (Effect("ges", anova.ges, *interval), Effect("epsilon", anova.epsilon))
    return Result(name, n, "F", anova.F, df, anova.p, effects, "Greenhouse-Geisser")


def mauchly(table: ArrayLike) -> Outcome:
    """Return Mauchly's test of sphericity of a complete table (n_people, k >= 3)."""
    name = "Mauchly"
    values = _checked(table)
    n, k = values.shape
    if n <= k:
        return NoResult(name, f"needs more people than the {k} conditions, there are {n}")
    contrasts = linalg.helmert(k)
    S = contrasts @ np.cov(values, rowvar=False) @ contrasts.T
    trace = float(np.trace(S))
    determinant = float(np.linalg.det(S / trace)) if trace > 0.0 else 0.0
    if determinant <= 1e-14:
        return NoResult(name, "some conditions differ by the same amount in all people")
    d = k - 1
    W = determinant * d**d
    scale = n - 1 - (2.0 * d * d + d + 2.0) / (6.0 * d)
    df = d * (d + 1) / 2 - 1
    chi2 = -scale * np.log(W)
    return Result(name, n, "W", W, (df,), _box_p(chi2, df, d, n - 1, scale), note=f"χ² {chi2:.2f}")


def _box_p(chi2: float, df: float, d: int, m: int, scale: float) -> float:
    """Upper tail of chi2 with Box's second-order term (Anderson 1958, 10.7.4)."""
    rho = scale / m
    omega = (d + 2) * (d - 1) * (d - 2) * (2 * d**3 + 6 * d**2 + 3 * d + 2)
    omega /= 288.0 * (m * d * rho) ** 2
    first, second = stats.chi2.sf(chi2, df), stats.chi2.sf(chi2, df + 4)
    return float(np.clip(first + omega * (second - first), 0.0, 1.0))


def kendall_w(tables: Floats) -> Floats:
    """Return Kendall's W of tables (..., n_people, k), corrected for ties; NaN if all tie."""
    n, k = tables.shape[-2:]
    ranks = midranks(tables) - (k + 1) / 2.0
    between = (ranks.mean(axis=-2) ** 2).sum(axis=-1)
    largest = (ranks**2).sum(axis=(-2, -1)) / n
    return np.divide(between, largest, out=np.full(np.shape(between), np.nan), where=largest > 0.0)


def friedman(table: ArrayLike) -> Outcome:
    """Return Friedman's test of a complete table (n_people, k >= 3); chi2 = n (k - 1) W.

    Effect: Kendall's W (interval: bootstrap over people).
    """
    name = "Friedman"
    values = snap(_checked(table))
    n, k = values.shape
    if n < 2:
        return NoResult(name, f"needs at least two people with every condition, there {_are(n)}")
    W = float(kendall_w(values))
    if not np.isfinite(W):
        return NoResult(name, f"all {n} people are the same in all conditions")
    chi2 = n * (k - 1) * W
    effect = Effect("W", W, *bootstrap_interval(values, kendall_w, BOOTSTRAP_SEED))
    return Result(name, n, "χ²", chi2, (k - 1,), float(stats.chi2.sf(chi2, k - 1)), (effect,))


def _checked(table: ArrayLike) -> Floats:
    values = np.asarray(table, float)
    if values.ndim != 2 or values.shape[1] < 3 or not np.isfinite(values).all():
        raise ValueError(f"the table must be finite, people by three or more conditions: {values}")
    return values


def _are(n: int) -> str:
    return "is one" if n == 1 else "is none"
