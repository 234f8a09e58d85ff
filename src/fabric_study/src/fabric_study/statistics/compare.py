# SPDX-License-Identifier: BSD-3-Clause
"""One measure over the conditions of a study: the default tests, and those of the publication."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import pandas as pd

from fabric_study.statistics.as_published import (
    PairOutcome,
    one_way_anova,
    published_pairs,
    tukey_hsd,
)
from fabric_study.statistics.descriptive import Description, describe
from fabric_study.statistics.holm import holm
from fabric_study.statistics.layout import person_means, rows_of, split_complete
from fabric_study.statistics.mixed import mixed_conditions
from fabric_study.statistics.outcome import Outcome, Result
from fabric_study.statistics.pairs import paired_t, wilcoxon
from fabric_study.statistics.repeated import friedman, mauchly, repeated_anova


@dataclass(frozen=True)
class Pair:
    """The default test of two conditions; `p_holm` is None where there was no test."""

    first: str
    second: str
    outcome: Outcome
    p_holm: float | None = None


@dataclass(frozen=True)
class Comparison:
    """All that is said about one measure."""

    measure: str
    conditions: tuple[str, ...]
    descriptions: dict[str, Description]  # of the means of people
    rows: dict[str, int]  # a condition
    means: pd.DataFrame  # people by conditions
    incomplete: tuple[str, ...]  # people without a value in some condition
    omnibus: Outcome | None  # three and more conditions
    sphericity: Outcome | None
    pairs: tuple[Pair, ...]
    mixed: Outcome | None  # all rows, incomplete people too
    published_omnibus: Outcome | None
    published: tuple[PairOutcome, ...]
    tukey: tuple[PairOutcome, ...]


def compare(
    frame: pd.DataFrame, measure: str, conditions: Sequence[str], ordinal: bool = False
) -> Comparison:
    """Return the comparison of a column over conditions.

    frame: one row a task or answer with person, condition and `measure`; NaN is missing. One value
    a person and condition is tested, the mean of the person's rows, over the people who have all
    conditions. ordinal: a single Likert item (Wilcoxon, Friedman) instead of a measure (paired t,
    repeated-measures ANOVA). Raises ValueError as `rows_of`.
    """
    rows = rows_of(frame, measure, conditions)
    rows["condition"] = pd.Categorical(rows["condition"], list(conditions))
    means = person_means(rows, conditions)
    complete, incomplete = split_complete(means)
    table = complete.to_numpy(float)
    several = len(conditions) > 2
    samples = [rows.loc[rows["condition"] == name, "value"].to_numpy(float) for name in conditions]
    return Comparison(
        measure=measure,
        conditions=tuple(conditions),
        descriptions={name: describe(means[name]) for name in conditions},
        rows={name: len(sample) for name, sample in zip(conditions, samples, strict=True)},
        means=means,
        incomplete=incomplete,
        omnibus=(friedman(table) if ordinal else repeated_anova(table)) if several else None,
        sphericity=mauchly(table) if several and not ordinal else None,
        pairs=_pairs(complete, ordinal),
        mixed=None if ordinal or len(conditions) < 2 else mixed_conditions(rows),
        published_omnibus=one_way_anova(samples) if several else None,
        published=tuple(published_pairs(rows, conditions, of_people=ordinal)),
        tukey=tuple(tukey_hsd(samples, conditions)) if several else (),
    )


def _pairs(table: pd.DataFrame, ordinal: bool) -> tuple[Pair, ...]:
    test = wilcoxon if ordinal else paired_t
    found = [
        Pair(first, second, test(np.asarray(table[first] - table[second], float)))
        for first, second in combinations(table.columns, 2)
    ]
    adjusted = iter(holm([pair.outcome.p for pair in found if isinstance(pair.outcome, Result)]))
    return tuple(
        replace(pair, p_holm=next(adjusted)) if isinstance(pair.outcome, Result) else pair
        for pair in found
    )
