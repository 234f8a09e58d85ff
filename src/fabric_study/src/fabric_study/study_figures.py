# SPDX-License-Identifier: BSD-3-Clause
"""The figures of a study's report, as SVG. Colours can be told apart by the colour-blind."""

import textwrap
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from fabric_study.figure import STYLE, plt, svg_of
from fabric_study.results import mean_interval
from fabric_study.statistics.descriptive import moving_average
from fabric_study.study_analysis import Studied

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")  # Okabe and Ito
AGREEMENT = ("#a6611a", "#dfc27d", "#d9d9d9", "#80cdc1", "#018571")  # 1 .. 5
AGREEMENT_WORDS = ("strongly disagree", "disagree", "neither", "agree", "strongly agree")
SIMULATED = "SIMULATED people and answers"
PANELS_A_ROW = 4
WINDOW = 3  # tasks
PAPER = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}  # behind words on a line
PANEL = (2.9, 2.7)  # inches
LEGEND = 0.3  # inches, below all panels
STYLE = {**STYLE, "axes.spines.right": False, "axes.titlesize": 9}


def shown(condition: str) -> str:
    """Return a condition as it is written in figures and tables."""
    return condition.replace("_", " ")


def colours_of(conditions: Sequence[str]) -> dict[str, str]:
    """Return the colour that each condition has in all figures of a report."""
    return {name: COLOURS[index % len(COLOURS)] for index, name in enumerate(conditions)}


def boxes_svg(items: Sequence[Studied], conditions: Sequence[str], simulated: bool) -> str:
    """Return box plots of the means of people, a panel a measure; a grey line is a person."""
    colours = colours_of(conditions)
    with plt.rc_context(STYLE):
        figure, axes = _grid(len(items), simulated)
        for panel, item in zip(axes, items, strict=False):
            means = item.comparison.means
            places = np.arange(len(means.columns))
            for row in means.to_numpy(float):
                panel.plot(places, row, color="#999999", linewidth=0.6, alpha=0.7, zorder=1)
            for place, name in zip(places, means.columns, strict=True):
                _box(panel, place, means[name].dropna().to_numpy(float), colours.get(name, "#555"))
            panel.set_xticks(places, [shown(name) for name in means.columns])
            panel.set_xlim(-0.6, len(places) - 0.4)
            panel.set_title(_wrapped(item))
        return svg_of(figure)


def _box(panel: plt.Axes, place: float, values: np.ndarray, colour: str) -> None:
    if not values.size:
        return
    line = {"color": colour, "linewidth": 1.2}
    panel.boxplot(
        [values],
        positions=[place],
        widths=0.5,
        showfliers=False,
        medianprops={"color": "black", "linewidth": 1.4},
        boxprops=line,
        whiskerprops=line,
        capprops=line,
        zorder=2,
    )
    panel.plot(np.full(values.size, place), values, ".", color=colour, markersize=5, zorder=3)


def courses_svg(items: Sequence[Studied], conditions: Sequence[str], simulated: bool) -> str:
    """Return the course over the tasks of a condition: means of people with their 95 % intervals
    (points), and the moving average of the means (lines)."""
    colours = colours_of(conditions)
    with plt.rc_context(STYLE):
        figure, axes = _grid(len(items), simulated)
        for panel, item in zip(axes, items, strict=False):
            groups = list(item.rows.groupby("condition", observed=True))
            for index, (name, rows) in enumerate(groups):
                _course(panel, rows, colours[name], shown(name), 0.08 * (index - len(groups) / 2))
            panel.set_title(_wrapped(item))
            panel.set_xlabel("task in the condition" if len(conditions) > 1 else "task")
            panel.xaxis.set_major_locator(plt.MaxNLocator(integer=True))
        handles = {label: line for panel in axes for line, label in _legend(panel)}
        if len(handles) > 1:
            _legend_below(figure, list(handles.values()), list(handles))
        return svg_of(figure)


def _course(panel: plt.Axes, rows: pd.DataFrame, colour: str, label: str, shift: float) -> None:
    tasks = sorted(rows["in_condition"].unique())
    told = [
        mean_interval(rows.loc[rows["in_condition"] == task, "value"].tolist()) for task in tasks
    ]
    means = [float(mean) for mean, _ in told if mean is not None]
    halves = [half or 0.0 for _, half in told]
    places = np.asarray(tasks) + shift
    panel.errorbar(places, means, halves, fmt="o", color=colour, markersize=3.5, linewidth=0.9)
    panel.plot(places, moving_average(means, WINDOW), color=colour, linewidth=1.8, label=label)


def _legend(panel: plt.Axes) -> list[tuple[plt.Artist, str]]:
    return list(zip(*panel.get_legend_handles_labels(), strict=True))


def statements_svg(items: Sequence[Studied], simulated: bool) -> str:
    """Return diverging stacked bars of the answers 1..5 to statements, "neither" in the middle.

    The mean is written at the right.
    """
    bars: list[tuple[float, str, pd.Series]] = []
    headings: list[tuple[float, str]] = []
    y = 0.0
    for item in items:
        lines = textwrap.wrap(item.text, 110)
        headings.append((y, "\n".join(lines)))
        y += 0.75 * len(lines) + 0.15
        for name, rows in item.rows.groupby("condition", observed=True):
            bars.append((y, shown(str(name)), rows["value"]))
            y += 1.0
        y += 0.5
    with plt.rc_context({**STYLE, "axes.spines.left": False}):
        figure, panel = plt.subplots(figsize=(10.5, 0.24 * y + 1.0), layout="constrained")
        for place, _, answers in bars:
            _stack(panel, place, answers)
        for place, text in headings:
            panel.text(-1.0, place - 0.45, text, fontsize=9, va="top", weight="bold", bbox=PAPER)
        _finish_statements(figure, panel, bars, y)
        if simulated:
            figure.suptitle(SIMULATED, fontsize=10, color="#8a6d00", weight="bold")
        return svg_of(figure)


def _stack(panel: plt.Axes, place: float, answers: pd.Series) -> None:
    shares = np.array([(answers.round() == step).mean() for step in range(1, 6)])
    left = -(shares[0] + shares[1] + shares[2] / 2.0)
    for share, colour in zip(shares, AGREEMENT, strict=True):
        panel.barh(place, share, left=left, height=0.8, color=colour)
        left += share
    text = f"{answers.mean():.2f}  (n {len(answers)})"
    panel.text(1.03, place, text, va="center", fontsize=8)


def _finish_statements(
    figure: plt.Figure, panel: plt.Axes, bars: Sequence[tuple[float, str, pd.Series]], end: float
) -> None:
    panel.axvline(0.0, color="black", linewidth=0.6)
    panel.set_yticks([place for place, _, _ in bars], [name for _, name, _ in bars])
    panel.tick_params(axis="y", length=0)
    panel.set(xlim=(-1.0, 1.0), ylim=(end, -0.8))
    ticks = (-1.0, -0.5, 0.0, 0.5, 1.0)
    panel.set_xticks(ticks, [f"{abs(tick):.0%}" for tick in ticks])
    panel.set_xlabel("share of answers; right of the line: agreement")
    panel.text(1.03, -0.75, "mean", va="bottom", fontsize=8)
    patches = [plt.Rectangle((0, 0), 1, 1, color=colour) for colour in AGREEMENT]
    _legend_below(figure, patches, AGREEMENT_WORDS)


def changes_svg(
    rates: Mapping[int, float], entropy: Mapping[int, tuple[float | None, float | None]],
    people: int, simulated: bool,
) -> str:  # fmt: skip
    """Return how often another policy was chosen before each task, and the entropy of the belief
    over types (nats, mean over people, 95 % interval) after each."""
    with plt.rc_context(STYLE):
        figure, axes = _grid(2 if entropy else 1, simulated, width=4.5)
        axes[0].bar(list(rates), [100.0 * rate for rate in rates.values()], color=COLOURS[0])
        axes[0].set(ylim=(0.0, 100.0), xlabel="before task", ylabel="people [%]")
        axes[0].set_title(f"another policy was chosen (n = {people})")
        axes[0].xaxis.set_major_locator(plt.MaxNLocator(integer=True))
        if entropy:
            tasks = list(entropy)
            means = [float(mean or 0.0) for mean, _ in entropy.values()]
            halves = [half or 0.0 for _, half in entropy.values()]
            axes[1].errorbar(tasks, means, halves, fmt="o-", color=COLOURS[1], capsize=2)
            axes[1].set(xlabel="after task", ylabel="nats")
            axes[1].set_ylim(bottom=0.0)
            axes[1].set_title("entropy of the belief over types")
        return svg_of(figure)


def _grid(
    count: int, simulated: bool, width: float = PANEL[0]
) -> tuple[plt.Figure, list[plt.Axes]]:
    """Return a figure with `count` visible panels, marked when the study is simulated."""
    columns = min(count, PANELS_A_ROW)
    rows = -(-count // PANELS_A_ROW)
    size = (width * columns, PANEL[1] * rows + 0.5)
    figure, axes = plt.subplots(rows, columns, figsize=size, layout="constrained", squeeze=False)
    panels = list(axes.flat)
    for panel in panels[count:]:
        panel.set_visible(False)
    if simulated:
        figure.suptitle(SIMULATED, fontsize=10, color="#8a6d00", weight="bold")
    return figure, panels[:count]


def _legend_below(figure: plt.Figure, handles: Sequence[plt.Artist], labels: Sequence[str]) -> None:
    share = LEGEND / figure.get_figheight()
    figure.get_layout_engine().set(rect=(0.0, share, 1.0, 1.0 - share))
    figure.legend(handles, labels, loc="lower center", ncols=6, frameon=False)


def _wrapped(item: Studied) -> str:
    return "\n".join(textwrap.wrap(item.measure.label, 34))
