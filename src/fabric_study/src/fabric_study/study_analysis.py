# SPDX-License-Identifier: BSD-3-Clause
"""Every comparison of a study, made once; tables, figures and verdicts are drawn from it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy import stats

from fabric_study.protocol import Protocol
from fabric_study.statistics.compare import Comparison, compare
from fabric_study.statistics.layout import rows_of
from fabric_study.statistics.mixed import learning
from fabric_study.statistics.outcome import NoResult, Outcome
from fabric_study.statistics.power import PowerCurve, power_curve
from fabric_study.study_data import StudyData
from fabric_study.study_measures import (
    MEASURES,
    Measure,
    check_rates,
    conditions_of,
    conditions_with,
    protocol_of,
)

TLX = "nasa_tlx"
TLX_OVERALL = Measure("overall", "raw task load, mean of the six", digits=1)
TLX_WEIGHTED = Measure("weighted", "weighted task load", digits=1)
POWER_SEED = 20262
SCORED = ("likert", "tlx")


@dataclass(frozen=True)
class Studied:
    """One measure, statement or scale: its rows, its comparison, its change over the tasks."""

    measure: Measure
    rows: pd.DataFrame  # person, condition, number, in_condition, value, in the unit shown
    comparison: Comparison
    learning: Outcome | None  # None: not asked after tasks
    category: str = ""
    text: str = ""  # of a statement


@dataclass(frozen=True)
class Choice:
    """A question with a choice of answers, and how often each was given."""

    item: str
    text: str
    counts: Mapping[str, int]  # by answer, those never given too
    labels: Mapping[str, str]
    missing: int
    p: float | None  # exact binomial test against an even choice of two answers


@dataclass(frozen=True)
class Analysis:
    """A study without its aborted visits, compared in every way."""

    data: StudyData
    protocol: Protocol | None
    conditions: tuple[str, ...]
    aborted: tuple[str, ...]  # codes of people who are left out
    measures: Mapping[str, Studied]
    answers: Mapping[str, Studied]  # Likert statements
    task_load: Mapping[str, Studied]  # scales of the NASA-TLX, overall, weighted
    choices: Mapping[str, Choice]
    power: Mapping[tuple[str, str, str], tuple[np.ndarray, PowerCurve | NoResult]]  # see _power

    @property
    def simulated(self) -> bool:
        """Whether people and answers are made up."""
        return self.data.simulated


def analyse(whole: StudyData) -> Analysis:
    """Return the analysis of a study. Raises ValueError where its rates are not its counts."""
    check_rates(whole.tasks)
    data, aborted = _without_aborted(whole)
    protocol, conditions = protocol_of(data), conditions_of(data)
    measures = _measures(data.tasks, conditions)
    answers = _answers(data.answers, conditions, protocol)
    return Analysis(
        data=data,
        protocol=protocol,
        conditions=conditions,
        aborted=aborted,
        measures=measures,
        answers={name: item for name, item in answers.items() if item.category != TLX},
        task_load={
            **{name: item for name, item in answers.items() if item.category == TLX},
            **_overall_load(data.answers, conditions),
        },
        choices=_choices(data.answers, protocol),
        power=_power(measures),
    )


def _without_aborted(data: StudyData) -> tuple[StudyData, tuple[str, ...]]:
    aborted = tuple(data.people.loc[data.people["status"] == "aborted", "person"].astype(str))
    frames = (frame[~frame["person"].isin(aborted)] for frame in (data.tasks, data.answers))
    return StudyData(data.meta, data.people, *frames), aborted


def _measures(tasks: pd.DataFrame, conditions: Sequence[str]) -> dict[str, Studied]:
    found = {}
    for measure in MEASURES:
        met = conditions_with(measure, tasks, conditions)
        if met:
            found[measure.column] = studied(measure, tasks, met)
    return found


def studied(
    measure: Measure,
    frame: pd.DataFrame,
    conditions: Sequence[str],
    ordinal: bool = False,
    category: str = "",
    text: str = "",
) -> Studied:
    """Return everything about a column of a table, in the unit of the measure."""
    scaled = frame[frame["condition"].isin(list(conditions))].copy()
    scaled["value"] = pd.to_numeric(scaled[measure.column]).astype(float) * measure.factor
    rows = rows_of(scaled, "value", conditions)
    rows["condition"] = pd.Categorical(rows["condition"], list(conditions), ordered=True)
    after_tasks = bool((rows["number"] > 0).all()) and rows["number"].nunique() > 1
    rows["in_condition"] = rows.groupby(["person", "condition"], observed=True)["number"].rank()
    return Studied(
        measure=measure,
        rows=rows,
        comparison=compare(scaled, "value", conditions, ordinal),
        learning=learning(rows) if after_tasks else None,
        category=category,
        text=text,
    )


def _answers(
    answers: pd.DataFrame, conditions: Sequence[str], protocol: Protocol | None
) -> dict[str, Studied]:
    """Return statements and scales; one that several instruments ask counts as one."""
    asked = answers[answers["kind"].isin(SCORED)].copy()
    if len(conditions) == 1:  # what is asked at the end is about the one condition
        asked["condition"] = conditions[0]
    found = {}
    for item, rows in asked.groupby("item", sort=False):
        known = rows[rows["value"].notna()]
        met = [name for name in conditions if (known["condition"] == name).any()]
        if not met:  # asked once at the end, about all conditions
            rows = rows.assign(condition="overall")
            met = ["overall"]
        scale = rows["kind"].iloc[0] == "tlx"
        title = str(item).replace("_", " ")
        measure = Measure("value", title, digits=1 if scale else 2)
        category = TLX if scale else str(rows["category"].iloc[0])
        text = item_text(protocol, str(rows["instrument"].iloc[0]), str(item))
        found[str(item)] = studied(measure, rows, met, not scale, category, text)
    return found


def item_text(protocol: Protocol | None, instrument: str, item: str) -> str:
    """Return the English wording of an item, or its id in words."""
    if protocol is None or instrument not in protocol.instruments:
        return item.replace("_", " ")
    return protocol.instruments[instrument].item(item).text["en"]


def _overall_load(answers: pd.DataFrame, conditions: Sequence[str]) -> dict[str, Studied]:
    """Return the mean of the six scales of each task, and the weighted one where pairs were asked.

    Raw: Hart (2006). Weighted: each scale counts as often as the person chose it in the 15 pairs.
    """
    scales = answers[answers["kind"] == "tlx"]
    if scales.empty:
        return {}
    table = scales.assign(value=pd.to_numeric(scales["value"])).pivot_table(
        index=["person", "condition", "number"], columns="item", values="value"
    )
    table = table[table.notna().all(axis=1)]
    frame = table.index.to_frame(index=False)
    frame["overall"] = table.mean(axis=1).to_numpy()
    pairs = answers[(answers["kind"] == "pair") & answers["value"].notna()]
    weights = pairs.groupby(["person", "value"]).size().unstack(fill_value=0)
    weights = weights.reindex(index=frame["person"], columns=table.columns).fillna(0.0).to_numpy()
    complete = weights.sum(axis=1) == 15
    weighted = (weights * table.to_numpy()).sum(axis=1) / 15.0
    frame["weighted"] = np.where(complete, weighted, np.nan)
    found = {}
    for measure in (TLX_OVERALL, TLX_WEIGHTED):
        met = conditions_with(measure, frame, conditions)
        if met:
            found[measure.column] = studied(measure, frame, met, category=TLX)
    return found


def _choices(answers: pd.DataFrame, protocol: Protocol | None) -> dict[str, Choice]:
    found = {}
    asked = answers[(answers["kind"] == "choice") & (answers["instrument"] != "demographics")]
    for item, rows in asked.groupby("item", sort=False):
        instrument = str(rows["instrument"].iloc[0])
        given = rows["value"].dropna()
        labels = _labels(protocol, instrument, str(item)) or {
            str(value): str(value) for value in sorted(given.unique())
        }
        counts = {value: int((given == value).sum()) for value in labels}
        two = list(counts.values()) if len(counts) == 2 and sum(counts.values()) else None
        found[str(item)] = Choice(
            item=str(item),
            text=item_text(protocol, instrument, str(item)),
            counts=counts,
            labels=labels,
            missing=int(rows["value"].isna().sum()),
            p=float(stats.binomtest(two[0], sum(two)).pvalue) if two else None,
        )
    return found


def _labels(protocol: Protocol | None, instrument: str, item: str) -> dict[str, str]:
    if protocol is None or instrument not in protocol.instruments:
        return {}
    labels = protocol.instruments[instrument].item(item).labels
    return {str(value): words["en"] for value, words in labels.items()}


def _power(
    measures: Mapping[str, Studied],
) -> dict[tuple[str, str, str], tuple[np.ndarray, PowerCurve | NoResult]]:
    """Return per-person differences and power curve by measure, first and second condition."""
    found = {}
    for name, item in measures.items():
        means = item.comparison.means
        for pair in item.comparison.pairs:
            seen = (means[pair.first] - means[pair.second]).dropna().to_numpy(float)
            found[name, pair.first, pair.second] = (seen, power_curve(seen, POWER_SEED))
    return found
