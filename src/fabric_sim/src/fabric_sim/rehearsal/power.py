# SPDX-License-Identifier: BSD-3-Clause
"""How many people a study needs: many simulated people, drawn again and again into studies of n.

Power is the chance that the paired t test finds the difference of two conditions at 5 %. It holds
for the simulated people and their answers only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pandas as pd

from fabric_abps import child_seed
from fabric_study.statistics.layout import person_means, rows_of, split_complete
from fabric_study.statistics.outcome import NoResult
from fabric_study.statistics.power import PowerCurve, power_curve

SIZES = tuple(range(6, 41, 2))  # people of a study
FIRST, LAST = "first half", "second half"  # of the tasks, where there is one condition only


@dataclass(frozen=True)
class Measured:
    """A measure of a study.

    rows: with person, condition, in_condition and `value`. without: conditions in which it means
    nothing, as warnings do without a robot.
    """

    name: str
    rows: pd.DataFrame
    without: tuple[str, ...] = ()


@dataclass(frozen=True)
class Contrast:
    """Two conditions in one measure. difference, sd: of first - second over the simulated people
    who have both; curve: NoResult where the two cannot differ."""

    measure: str
    first: str
    second: str
    people: int
    difference: float
    sd: float
    curve: PowerCurve | NoResult


def contrasts(measures: Sequence[Measured], conditions: Sequence[str], seed: int) -> list[Contrast]:
    """Return every pair of conditions in every measure; with one condition, the halves of its
    tasks. Measures that fewer than two people have are left out."""
    found: list[Contrast] = []
    for measure in measures:
        met = [name for name in conditions if name not in measure.without]
        rows = measure.rows
        if len(met) == 1:
            rows, met = _halves(rows[rows["condition"] == met[0]]), [FIRST, LAST]
        table, _ = split_complete(person_means(rows_of(rows, "value", met), met))
        if len(table) >= 2:
            found += [_contrast(measure.name, table, a, b, seed) for a, b in combinations(met, 2)]
    return found


def _contrast(measure: str, table: pd.DataFrame, first: str, second: str, seed: int) -> Contrast:
    differences = (table[first] - table[second]).to_numpy(float)
    mean, sd = float(differences.mean()), float(differences.std(ddof=1))
    own = child_seed(seed, "power", measure, first, second)
    curve = power_curve(differences, own, SIZES)
    return Contrast(measure, first, second, len(differences), mean, sd, curve)


def _halves(rows: pd.DataFrame) -> pd.DataFrame:
    """Call the two halves of a condition's tasks conditions; a task in the middle is left out."""
    middle = (rows["in_condition"].min() + rows["in_condition"].max()) / 2.0
    half = np.where(rows["in_condition"] < middle, FIRST, LAST)
    return rows.assign(condition=half)[rows["in_condition"] != middle]


def table_of(found: Sequence[Contrast]) -> pd.DataFrame:
    """Return the curves, one row a contrast and number of people."""
    rows = [
        {
            "measure": contrast.measure,
            "first": contrast.first,
            "second": contrast.second,
            "simulated_people": contrast.people,
            "difference": round(contrast.difference, 6),
            "sd": round(contrast.sd, 6),
            "people": size,
            "power": power,
            "low_95": low,
            "high_95": high,
        }
        for contrast in found
        if isinstance(contrast.curve, PowerCurve)
        for size, power, low, high in zip(
            contrast.curve.sizes,
            contrast.curve.power,
            contrast.curve.low,
            contrast.curve.high,
            strict=True,
        )
    ]
    return pd.DataFrame(rows)
