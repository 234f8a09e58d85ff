# SPDX-License-Identifier: BSD-3-Clause
"""Linear mixed models (REML) in which every person has a level of their own."""

import warnings
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from fabric_study.statistics.outcome import CONFIDENCE, Effect, NoResult, Outcome, Result

CONDITIONS = "mixed model"
LEARNING = "mixed model, task number"


def mixed_conditions(rows: pd.DataFrame) -> Outcome:
    """Return the effect of the condition, from all rows, also of people who miss a condition.

    rows: of `layout.rows_of`, `condition` categorical in the order to be reported. Random effects:
    person, and person x condition where people have several rows a condition. Degrees of freedom:
    (people - 1)(k - 1), which makes balanced data agree with the paired t test. Effects, for two
    conditions: mean difference first minus second.
    """
    rows = rows.assign(condition=rows["condition"].cat.remove_unused_categories())
    levels = list(rows["condition"].cat.categories)
    people = rows["person"].nunique()
    if people < 2 or len(levels) < 2:
        return NoResult(CONDITIONS, "needs two people and two conditions")
    repeated = bool(rows.duplicated(["person", "condition"]).any())
    several = {"person_condition": "0 + C(condition)"} if repeated else None
    fit = _fit(rows, "value ~ C(condition)", several)
    if isinstance(fit, str):
        return NoResult(CONDITIONS, fit)
    k = len(levels)
    b, V = _fixed(fit, slice(1, k))
    df = ((k - 1), float((people - 1) * (k - 1)))
    F = float(b @ np.linalg.solve(V, b)) / (k - 1)
    note = f"{len(rows)} rows"
    if k > 2:
        return Result(CONDITIONS, people, "F", F, df, float(stats.f.sf(F, *df)), note=note)
    return _t_result(CONDITIONS, people, -b[0], V[0, 0], "difference", note)


def learning(rows: pd.DataFrame) -> Outcome:
    """Return the change from task to task, from all rows, differences of conditions removed.

    rows: as in `mixed_conditions`. Random effects: level and slope of each person. Effect: slope
    per task; degrees of freedom: people - 1.
    """
    rows = rows.assign(
        condition=rows["condition"].cat.remove_unused_categories(),
        number=rows["number"] - rows["number"].mean(),
    )
    people = rows["person"].nunique()
    if people < 2 or rows["number"].nunique() < 3:
        return NoResult(LEARNING, "needs two people and three tasks")
    if _tied(rows):
        return NoResult(LEARNING, "conditions came in one order: order and condition look the same")
    several = "C(condition) + " if rows["condition"].nunique() > 1 else ""
    fit = _fit(rows, f"value ~ {several}number", {"slope": "0 + number"})
    if isinstance(fit, str):
        return NoResult(LEARNING, fit)
    b, V = _fixed(fit, slice(-1, None))
    return _t_result(LEARNING, people, b[0], V[0, 0], "slope", f"{len(rows)} rows")


def _tied(rows: pd.DataFrame) -> bool:
    """Whether the task number follows from the condition."""
    return bool((rows.groupby("condition", observed=True)["number"].nunique() == 1).all())


def _fit(rows: pd.DataFrame, formula: str, components: dict[str, str] | None) -> Any:
    """Return the fitted model, or the sentence that says why there is none."""
    if rows["value"].max() - rows["value"].min() <= 1e-12 * rows["value"].abs().max():
        return f"all {len(rows)} values are {rows['value'].iloc[0]:g}"
    import statsmodels.formula.api as formulas  # takes a second to load

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # variances at zero are told of, and are in order
        model = formulas.mixedlm(
            formula, rows, groups="person", re_formula="1", vc_formula=components
        )
        try:
            fit = model.fit(reml=True, method=["powell"], xtol=1e-10, ftol=1e-12)
        except (np.linalg.LinAlgError, ValueError):
            return "the likelihood has no maximum for these data"
    covariance = np.asarray(fit.cov_params())[: len(fit.fe_params), : len(fit.fe_params)]
    if not fit.converged or not np.isfinite(covariance).all() or fit.scale <= 0.0:
        return "the fit did not converge"
    return fit


def _fixed(fit: Any, part: slice) -> tuple[np.ndarray, np.ndarray]:
    """Return estimates and covariance of these fixed effects."""
    count = len(fit.fe_params)
    covariance = np.asarray(fit.cov_params())[:count, :count]
    return np.asarray(fit.fe_params)[part], covariance[part, part]


def _t_result(
    test: str, people: int, estimate: float, variance: float, name: str, note: str
) -> Outcome:
    error, df = float(np.sqrt(variance)), people - 1
    t, half = estimate / error, error * float(stats.t.ppf(0.5 + CONFIDENCE / 2.0, df))
    effect = Effect(name, float(estimate), float(estimate - half), float(estimate + half))
    p = float(2.0 * stats.t.sf(abs(t), df))
    return Result(test, people, "t", float(t), (df,), p, (effect,), note)
