# SPDX-License-Identifier: BSD-3-Clause
"""How many people a study needs: many simulated people, drawn again and again into studies of n.

Power is the chance that the paired t test finds the difference of two conditions at 5 %. It holds
for the simulated people and their answers only.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from fabric_abps import child_seed
from fabric_sim.experiments.jobs import run_jobs
from fabric_study.statistics.layout import person_means, rows_of, split_complete
from fabric_study.statistics.power import PowerCurve, power_curve
from fabric_study.study_data import StudyData
from fabric_study.study_measures import MEASURES, conditions_of, conditions_with

SIZES = (6, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40)  # people of a study
FIRST, LAST = "first half", "second half"  # of the tasks, where there is one condition only
SCALES = ("likert", "tlx")  # kinds of items whose means are compared


class Measured(NamedTuple):
    """A measure: rows with person, condition, number and `value`."""

    name: str
    rows: pd.DataFrame


class Pair(NamedTuple):
    """Two conditions in one measure; differences: first - second, (n_people,)."""

    measure: str
    first: str
    second: str
    differences: NDArray[np.float64]


@dataclass(frozen=True)
class Contrast:
    """The power of a comparison. people: simulated ones with both conditions; difference, sd: of
    first - second among them."""

    measure: str
    first: str
    second: str
    people: int
    difference: float
    sd: float
    curve: PowerCurve


def contrasts(study: StudyData, seed: int, processes: int) -> list[Contrast]:
    """Return every pair of conditions in every measure; equal whatever `processes` is.

    With one condition only, the halves of its tasks are compared. Pairs in which people do not
    differ are left out.
    """
    conditions = conditions_of(study)
    pairs = [pair for measure in measures_of(study) for pair in _pairs(measure, conditions)]
    jobs = [(pair, seed) for pair in pairs]
    found = run_jobs(_contrast, jobs, processes, "power")
    return [contrast for contrast in found if contrast is not None]


def measures_of(study: StudyData) -> Iterator[Measured]:
    """Yield what a study measures: results of tasks, and answers on scales."""
    for measure in MEASURES:
        met = conditions_with(measure, study.tasks, conditions_of(study))
        rows = study.tasks[study.tasks["condition"].isin(met)]
        yield Measured(measure.column, rows.assign(value=rows[measure.column].astype(float)))
    answers = study.answers[study.answers["kind"].isin(SCALES)]
    for name, rows in answers.groupby("item", sort=False):
        yield Measured(str(name), rows.assign(value=rows["value"].astype(float)))


def _pairs(measure: Measured, conditions: Sequence[str]) -> Iterator[Pair]:
    rows = measure.rows
    met = [name for name in conditions if name in set(rows["condition"])]
    if met and len(conditions) == 1:
        rows, met = _halves(rows[rows["condition"] == met[0]]), [FIRST, LAST]
    if len(met) < 2:
        return
    table, _ = split_complete(person_means(rows_of(rows, "value", met), met))
    for first, second in combinations(met, 2):
        differences = (table[first] - table[second]).to_numpy(float)
        yield Pair(measure.name, first, second, differences)


def _halves(rows: pd.DataFrame) -> pd.DataFrame:
    """Call the two halves of a condition's tasks conditions; a task in the middle is left out."""
    middle = (rows["number"].min() + rows["number"].max()) / 2.0
    half = np.where(rows["number"] < middle, FIRST, LAST)
    return rows.assign(condition=half)[rows["number"] != middle]


def _contrast(job: tuple[Pair, int]) -> Contrast | None:
    pair, seed = job
    own = child_seed(seed, "power", pair.measure, pair.first, pair.second)
    curve = power_curve(pair.differences, own, SIZES)
    if not isinstance(curve, PowerCurve):
        return None
    mean, sd = float(pair.differences.mean()), float(pair.differences.std(ddof=1))
    return Contrast(*pair[:3], len(pair.differences), mean, sd, curve)


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
        for size, power, low, high in zip(
            contrast.curve.sizes,
            contrast.curve.power,
            contrast.curve.low,
            contrast.curve.high,
            strict=True,
        )
    ]
    return pd.DataFrame(rows)
