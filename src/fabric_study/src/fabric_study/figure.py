# SPDX-License-Identifier: BSD-3-Clause
"""The figure of a report: how reward, warnings and duration went over the tasks."""

import io
from collections.abc import Sequence

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  # the back end is chosen first

from fabric_study.results import Row, by_policy, column, mean_interval  # noqa: E402
from fabric_study.statistics.descriptive import moving_average  # noqa: E402

PANELS = (
    ("discounted_reward", "discounted reward"),
    ("warnings", "warnings"),
    ("duration_s", "duration [s]"),
)
STYLE = {"svg.hashsalt": "fabric", "font.size": 9, "axes.spines.top": False}
WINDOW = 10  # tasks


def svg_of(figure: plt.Figure) -> str:
    """Return a figure as SVG text without a date, and close it."""
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None})
    plt.close(figure)
    text = buffer.getvalue()
    return text[text.index("<svg") :]


def results_svg(rows: Sequence[Row]) -> str:
    """Return an SVG: over the tasks above, means with 95 % intervals below."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(2, len(PANELS), figsize=(11.0, 5.5), layout="constrained")
        for index, (name, title) in enumerate(PANELS):
            _draw_course(axes[0][index], rows, name, title)
            _draw_means(axes[1][index], rows, name)
        axes[0][0].legend(frameon=False)
        return svg_of(figure)


def _draw_course(axes: plt.Axes, rows: Sequence[Row], name: str, title: str) -> None:
    for index, (policy, group) in enumerate(by_policy(rows).items()):
        values = column(group, name)
        tasks = range(1, len(values) + 1)
        axes.plot(tasks, values, ".", color=f"C{index}", alpha=0.35)
        axes.plot(tasks, moving_average(values, WINDOW), color=f"C{index}", label=policy)
    axes.set_title(title)
    axes.set_xlabel(f"task (line: mean of the last {WINDOW})")


def _draw_means(axes: plt.Axes, rows: Sequence[Row], name: str) -> None:
    groups = by_policy(rows)
    for index, group in enumerate(groups.values()):
        mean, half = mean_interval(column(group, name))
        if mean is not None:
            axes.bar(index, mean, yerr=half, color=f"C{index}", alpha=0.8, capsize=4)
    axes.set_xticks(range(len(groups)), list(groups))
    axes.axhline(0.0, color="black", linewidth=0.6)
