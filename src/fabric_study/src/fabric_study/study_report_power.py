# SPDX-License-Identifier: BSD-3-Clause
"""The part of a study's report that power.csv of a rehearsal gives: how many people are needed.

power.csv has a row for each measure, pair of conditions and number of people. It comes from many
more simulated people than the study has, and says so.
"""

from collections.abc import Mapping
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  # the back end is chosen first
import numpy as np  # noqa: E402
import pandas as pd  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from fabric_study.figure import STYLE, svg_of  # noqa: E402
from fabric_study.page import heading, html_figure, html_table, paragraph  # noqa: E402
from fabric_study.statistics.outcome import NoResult  # noqa: E402
from fabric_study.statistics.power import TARGET, PowerCurve  # noqa: E402
from fabric_study.study_measures import MEASURES  # noqa: E402

POWER_FILE = "power.csv"
GROUP = ["measure", "first", "second"]
NUMBERS = ["simulated_people", "difference", "sd", "people", "power", "low_95", "high_95"]
TOLD = (8, 14, 20, 40)  # numbers of people that the table tells of
PANELS_A_ROW = 3  # panels side by side
LEGEND = 0.2  # share of the figure's height
TITLES = {measure.column: measure.title for measure in MEASURES}
NOTE = (
    "Power: the chance that a study of n people finds the difference by the paired t test at 5 % "
    "(means of people, one test, no correction for several). Studies of n were drawn again and "
    "again from {people} simulated people; in brackets the 95 % interval, because these are a "
    "sample, too. All of it holds for the simulated people and their answers, and for nobody else."
)
OBSERVED = (
    "Power: the chance that a study of n people finds the difference by the paired t test at 5 % "
    "(means of people, one test, no correction for several), if people are as the {people} here. "
    "Studies were drawn from these; the 95 % interval in brackets says how little that tells. It "
    "is for planning the next study: of this one it says nothing that its p-values do not."
)
Floats = NDArray[np.float64]


def read_power(path: Path) -> pd.DataFrame:
    """Return a power.csv. Raises ValueError naming file, line, column and value."""
    try:
        table = pd.read_csv(path)
    except (pd.errors.ParserError, pd.errors.EmptyDataError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: {error}") from error
    if list(table.columns) != [*GROUP, *NUMBERS]:
        expected = ", ".join([*GROUP, *NUMBERS])
        raise ValueError(f"{path}: columns are {', '.join(table.columns)}; must be {expected}")
    for column in NUMBERS:
        numbers = pd.to_numeric(table[column], errors="coerce").astype(float)
        least, most = (0.0, 1.0) if column in ("power", "low_95", "high_95") else (-1e12, 1e12)
        wrong = ~numbers.between(least, most)  # NaN is not between
        if wrong.any():
            line = int(wrong.idxmax())
            raise ValueError(f"{path}, line {line + 2}: {column} is {table[column][line]}")
        table[column] = numbers
    return table


def power_parts(folder: Path) -> list[str]:
    """Return the HTML parts for a study folder, none without a power.csv.

    Raises as `read_power`.
    """
    path = folder / POWER_FILE
    if not path.exists():
        return []
    table = read_power(path)
    most = int(table["simulated_people"].max()) if len(table) else 0
    caption = f"simulated people: power against the number of people; dashed: {TARGET:.0%}"
    return [
        heading("How many people, by simulated ones"),
        paragraph(NOTE.format(people=most), "note"),
        *([html_figure(power_svg(table, "simulated: "), caption)] if len(table) else []),
        html_table(_lines(table), "wide", "simulated people: what a study of n people would find"),
    ]


def observed_power_parts(
    curves: Mapping[tuple[str, str, str], tuple[Floats, PowerCurve | NoResult]], simulated: bool
) -> list[str]:
    """Return the HTML parts from the people of the study itself, none without any curve.

    curves: per-person differences and curve, by measure, first and second condition.
    """
    rows = [
        (*key, len(seen), seen.mean(), seen.std(ddof=1), *point)
        for key, (seen, curve) in curves.items()
        if isinstance(curve, PowerCurve)
        for point in zip(curve.sizes, curve.power, curve.low, curve.high, strict=True)
    ]
    if not rows:
        return []
    table = pd.DataFrame(rows, columns=[*GROUP, *NUMBERS])
    mark = "simulated: " if simulated else ""
    caption = f"{mark}power against the number of people; dashed: {TARGET:.0%}"
    return [
        heading("How many people the next study needs"),
        paragraph(OBSERVED.format(people=int(table["simulated_people"].max())), "note"),
        html_figure(power_svg(table, mark), caption),
        html_table(_lines(table), "wide", f"{mark}what a study of n people would find"),
    ]


def _lines(table: pd.DataFrame) -> list[list[str]]:
    told = [n for n in TOLD if n in set(table["people"])]
    target = f"people for {TARGET:.0%}"
    lines = [["", "conditions", "difference", "sd", target, *(f"n = {n}" for n in told)]]
    for (measure, first, second), rows in table.groupby(GROUP, sort=False):
        mean, sd = rows["difference"].iloc[0], rows["sd"].iloc[0]
        cells = [_title(measure), f"{first} - {second}", f"{mean:.2f}", f"{sd:.2f}"]
        lines.append([*cells, _needed(rows), *(_chance(rows, n) for n in told)])
    return lines


def _title(measure: str) -> str:
    return TITLES.get(measure, measure.replace("_", " "))


def _needed(rows: pd.DataFrame) -> str:
    enough = rows.loc[rows["power"] >= TARGET, "people"]
    return f"{enough.min():.0f}" if len(enough) else f"more than {rows['people'].max():.0f}"


def _chance(rows: pd.DataFrame, people: int) -> str:
    row = rows[rows["people"] == people].iloc[0]
    return f"{row['power']:.0%} [{row['low_95']:.0%}, {row['high_95']:.0%}]"


def power_svg(table: pd.DataFrame, mark: str) -> str:
    """Return the curves of the measures of tasks as SVG, a panel for each pair of conditions.

    mark: what every title begins with.
    """
    shown = table[table["measure"].isin(TITLES)]
    groups = list(shown.groupby(["first", "second"], sort=False))
    rows = -(-len(groups) // PANELS_A_ROW)
    with plt.rc_context(STYLE):
        size = (11.0, 3.6 * max(rows, 1))
        figure, axes = plt.subplots(
            max(rows, 1), min(len(groups), PANELS_A_ROW) or 1, figsize=size, squeeze=False,
            sharey=True, layout="constrained",
        )  # fmt: skip
        for panel, ((first, second), curves) in zip(axes.flat, groups, strict=False):
            _draw(panel, f"{mark}{first} - {second}", curves)
        for panel in list(axes.flat)[len(groups) :]:
            panel.set_visible(False)
        handles = {name: line for panel in axes.flat for line, name in _drawn(panel)}
        figure.get_layout_engine().set(rect=(0.0, LEGEND, 1.0, 1.0 - LEGEND))
        figure.legend(handles.values(), handles.keys(), loc="lower center", ncols=3, frameon=False)
        return svg_of(figure)


def _draw(panel: plt.Axes, title: str, curves: pd.DataFrame) -> None:
    for measure, curve in curves.groupby("measure", sort=False):
        colour = f"C{list(TITLES).index(measure)}"
        panel.plot(curve["people"], curve["power"], ".-", color=colour, label=TITLES[measure])
        panel.fill_between(
            curve["people"], curve["low_95"], curve["high_95"], color=colour, alpha=0.1, linewidth=0
        )
    panel.axhline(TARGET, color="black", linewidth=0.6, linestyle="--")
    panel.set(title=title, xlabel="people", ylabel="power", ylim=(0.0, 1.0))


def _drawn(panel: plt.Axes) -> list[tuple[plt.Artist, str]]:
    return list(zip(*panel.get_legend_handles_labels(), strict=True))
