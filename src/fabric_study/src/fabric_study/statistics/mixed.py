# SPDX-License-Identifier: BSD-3-Clause
"""Linear mixed models (REML) in which every person has a level of their own.

statsmodels' MixedLM gives the same where it converges; with variances at zero, which small studies
often have, its optimisers stop early or take seconds. The models here have two variances only, so
that all rows fit into one matrix.
"""

from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import linalg, optimize, stats

from fabric_study.statistics.outcome import CONFIDENCE, Effect, NoResult, Outcome, Result

CONDITIONS = "mixed model"
LEARNING = "mixed model, task number"
LEAST_VARIANCE = 1e-10  # of the residuals, as a share of that of the values
Floats = NDArray[np.float64]


class Fit(NamedTuple):
    """Fixed effects of a mixed model."""

    b: Floats  # (n_effects,)
    V: Floats  # covariance, (n_effects, n_effects)


def mixed_conditions(rows: pd.DataFrame) -> Outcome:
    """Return the effect of the condition, from all rows, also of people who miss a condition.

    rows: of `layout.rows_of`, `condition` categorical in the order to be reported. Random effects:
    person, and person x condition where people have several rows a condition. Degrees of freedom:
    (people - 1)(k - 1), which makes balanced data agree with the paired t test. Effects, for two
    conditions: mean difference first minus second.
    """
    rows = rows.assign(condition=rows["condition"].cat.remove_unused_categories())
    people, k = rows["person"].nunique(), len(rows["condition"].cat.categories)
    if people < 2 or k < 2:
        return NoResult(CONDITIONS, "needs two people and two conditions")
    met = _conditions(rows)
    cells = pd.factorize(pd.MultiIndex.from_frame(rows[["person", "condition"]]))[0]
    repeated = cells.max() + 1 < len(rows)
    fit = _fit(rows, met, _same(cells) if repeated else None)
    if isinstance(fit, str):
        return NoResult(CONDITIONS, fit)
    b, V = fit.b[1:], fit.V[1:, 1:]
    df, note = (k - 1, (people - 1) * (k - 1)), f"{len(rows)} rows"
    if k == 2:
        return _t_result(CONDITIONS, people, -b[0], V[0, 0], "difference", note)
    F = float(b @ np.linalg.solve(V, b)) / (k - 1)
    return Result(CONDITIONS, people, "F", F, df, float(stats.f.sf(F, *df)), note=note)


def learning(rows: pd.DataFrame) -> Outcome:
    """Return the change from task to task, from all rows, differences of conditions removed.

    rows: as in `mixed_conditions`. Random effects: level and slope of each person. Effect: slope
    per task; degrees of freedom: people - 1.
    """
    rows = rows.assign(condition=rows["condition"].cat.remove_unused_categories())
    people = rows["person"].nunique()
    if people < 2 or rows["number"].nunique() < 3:
        return NoResult(LEARNING, "needs two people and three tasks")
    if (rows.groupby("condition", observed=True)["number"].nunique() == 1).all():
        return NoResult(LEARNING, "conditions came in one order: order and condition look the same")
    number = (rows["number"] - rows["number"].mean()).to_numpy(float)
    X = np.column_stack([_conditions(rows), number])
    fit = _fit(rows, X, _same(rows["person"].to_numpy()) * np.outer(number, number))
    if isinstance(fit, str):
        return NoResult(LEARNING, fit)
    return _t_result(LEARNING, people, fit.b[-1], fit.V[-1, -1], "slope", f"{len(rows)} rows")


def _conditions(rows: pd.DataFrame) -> Floats:
    """Return the intercept and one column for each condition but the first."""
    codes = rows["condition"].cat.codes.to_numpy()
    others = np.arange(1, len(rows["condition"].cat.categories))
    return np.column_stack([np.ones(len(rows)), (codes[:, np.newaxis] == others).astype(float)])


def _same(groups: NDArray) -> Floats:
    """Return 1 where two rows are of one group, else 0, (n_rows, n_rows)."""
    return (groups[:, np.newaxis] == groups[np.newaxis, :]).astype(float)


def _fit(rows: pd.DataFrame, X: Floats, second: Floats | None) -> Fit | str:
    """Return the REML fit, or the sentence that says why there is none.

    X: fixed effects, (n_rows, p). second: covariance of the second random effect for unit
    variance, (n_rows, n_rows); the first one is the level of the person.
    """
    y = rows["value"].to_numpy(float)
    n, p = X.shape
    if np.ptp(y) <= 1e-12 * np.abs(y).max():
        return f"all {n} values are {y[0]:g}"
    if n <= p or np.linalg.matrix_rank(X) < p:
        return f"{n} rows cannot tell {p} effects apart"
    parts = [_same(rows["person"].to_numpy())] + ([] if second is None else [second])
    scale = float(y.std())
    data = np.column_stack([X, (y - y.mean()) / scale])

    def criterion(ratios: Floats) -> float:
        return _reml(ratios, parts, data)[0]

    start, precise = np.full(len(parts), 0.5), {"xatol": 1e-9, "fatol": 1e-13, "maxiter": 4000}
    found = optimize.minimize(criterion, start, method="Nelder-Mead", options=precise)
    _, b, V, residual = _reml(found.x, parts, data)
    if not found.success or residual < LEAST_VARIANCE:
        return "people and conditions explain all values: nothing is left to judge them by"
    b = b * scale
    b[0] += y.mean()
    return Fit(b, V * scale**2)


def _reml(ratios: Floats, parts: list[Floats], data: Floats) -> tuple[float, Floats, Floats, float]:
    """Return -2 log restricted likelihood, fixed effects, their covariance, residual variance.

    ratios: standard deviations of the random effects over that of the residuals; their sign does
    not matter, so that the search needs no border at zero. data: X and y side by side.
    """
    n, p = data.shape[0], data.shape[1] - 1
    V = np.eye(n)
    for ratio, part in zip(ratios, parts, strict=True):
        V += ratio**2 * part
    L = linalg.cholesky(V, lower=True, check_finite=False)
    white = linalg.solve_triangular(L, data, lower=True, check_finite=False)
    R = np.linalg.qr(
        white, mode="r"
    )  # of X and y side by side: its last entry is what X leaves of y
    diagonal = np.abs(np.diag(R))
    residual = max(diagonal[p] ** 2, 1e-300) / (n - p)
    value = (n - p) * np.log(residual)
    value += 2.0 * np.log(np.diag(L)).sum() + 2.0 * np.log(diagonal[:p]).sum()
    inverse = linalg.solve_triangular(R[:p, :p], np.eye(p))
    return float(value), inverse @ R[:p, p], residual * inverse @ inverse.T, float(residual)


def _t_result(
    test: str, people: int, estimate: float, variance: float, name: str, note: str
) -> Outcome:
    error, df = float(np.sqrt(variance)), people - 1
    t, half = float(estimate / error), error * float(stats.t.ppf(0.5 + CONFIDENCE / 2.0, df))
    effect = Effect(name, float(estimate), float(estimate - half), float(estimate + half))
    return Result(test, people, "t", t, (df,), float(2.0 * stats.t.sf(abs(t), df)), (effect,), note)
