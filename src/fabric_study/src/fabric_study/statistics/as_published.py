# SPDX-License-Identifier: BSD-3-Clause
"""The tests of the publication, for comparison only: they treat rows as independent.

Every person gives several rows, so these p-values are wrong in either direction; docs/statistics.md
says by how much.
"""

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy import stats

from fabric_study.statistics.outcome import Effect, NoResult, Outcome, Result

ANOVA = "one-way ANOVA, rows as independent"
TUKEY = "Tukey HSD, rows as independent"


class PairOutcome(NamedTuple):
    """A test of two conditions."""

    first: str
    second: str
    outcome: Outcome


def one_way_anova(samples: Sequence[np.ndarray]) -> Outcome:
    """Return the one-way ANOVA of samples (n_i,), two or more; effect: eta squared."""
    sizes = [len(sample) for sample in samples]
    n, k = sum(sizes), len(sizes)
    if k < 2 or min(sizes) < 1 or n <= k:
        return NoResult(ANOVA, f"needs values in each condition, there are {sizes}")
    values = np.concatenate(samples)
    within = sum(float(((sample - sample.mean()) ** 2).sum()) for sample in samples)
    total = float(((values - values.mean()) ** 2).sum())
    if within <= 1e-24 * float((values**2).sum()):
        return NoResult(ANOVA, "the values do not vary within the conditions")
    F = (total - within) / (k - 1) / (within / (n - k))
    p = float(stats.f.sf(F, k - 1, n - k))
    eta = Effect("eta2", (total - within) / total)
    return Result(ANOVA, n, "F", F, (k - 1, n - k), p, (eta,), unit="rows")


def tukey_hsd(samples: Sequence[np.ndarray], names: Sequence[str]) -> list[PairOutcome]:
    """Return Tukey's test (Tukey-Kramer) of all pairs of samples; effect: difference of means."""
    pairs = list(combinations(range(len(names)), 2))
    overall = one_way_anova(samples)
    if isinstance(overall, NoResult):
        return [PairOutcome(names[i], names[j], NoResult(TUKEY, overall.reason)) for i, j in pairs]
    if min(map(len, samples)) < 2:
        reason = "a condition has a single row"
        return [PairOutcome(names[i], names[j], NoResult(TUKEY, reason)) for i, j in pairs]
    told = stats.tukey_hsd(*samples)
    interval = told.confidence_interval()
    within, q = overall.df[1], _studentized(samples)
    found = []
    for i, j in pairs:
        ends = (told.statistic[i, j], interval.low[i, j], interval.high[i, j])
        effect = Effect("difference", *(float(end) for end in ends))
        p = float(told.pvalue[i, j])
        result = Result(
            TUKEY, overall.n, "q", q[i, j], (len(names), within), p, (effect,), unit="rows"
        )
        found.append(PairOutcome(names[i], names[j], result))
    return found


def _studentized(samples: Sequence[np.ndarray]) -> np.ndarray:
    """Return the studentized range statistic of each pair, (k, k)."""
    sizes = np.array([len(sample) for sample in samples], float)
    means = np.array([sample.mean() for sample in samples])
    within = sum(((sample - sample.mean()) ** 2).sum() for sample in samples)
    variance = within / (sizes.sum() - len(samples))
    error = np.sqrt(variance / 2.0 * (1.0 / sizes[:, None] + 1.0 / sizes[None, :]))
    return np.abs(means[:, None] - means[None, :]) / error


def published_pairs(
    rows: pd.DataFrame, conditions: Sequence[str], of_people: bool = False
) -> list[PairOutcome]:
    """Return a one-way ANOVA of every pair of conditions, on the rows the publication used.

    rows: of `layout.rows_of`. Rows are tasks where people have equally many in both conditions
    (F(1, 82) in Fig. 6.18e), else means of people (F(1, 26)); always the latter with of_people.
    """
    counts = rows.groupby(["person", "condition"], observed=True).size().unstack(fill_value=0)
    most = counts.reindex(columns=list(conditions), fill_value=0).max()
    means = rows.groupby(["person", "condition"], observed=True)["value"].mean().reset_index()
    found = []
    for first, second in combinations(conditions, 2):
        table = means if of_people or most[first] != most[second] else rows
        samples = [_values(table, name) for name in (first, second)]
        found.append(PairOutcome(first, second, one_way_anova(samples)))
    return found


def _values(rows: pd.DataFrame, condition: str) -> np.ndarray:
    return rows.loc[rows["condition"] == condition, "value"].to_numpy(float)
