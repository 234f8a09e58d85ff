# SPDX-License-Identifier: BSD-3-Clause
"""Figures of the comparison with the recorded types, as SVG."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from fabric_sim.experiments.recorded_types import Line
from fabric_sim.worker_parameters import STATES
from fabric_study.figure import STYLE, plt, svg_of

_VERDICT = {True: "C2", False: "C3", None: "C0"}  # gate met, not met, none
_COLOURS = dict(zip(STATES, plt.get_cmap("tab20").colors, strict=False))
_WORTH_A_LABEL = 0.06  # share of the time


def comparison(lines: Sequence[Line]) -> str:
    """A panel for each measure: dots with intervals over bars of recorded values."""
    measures = list(dict.fromkeys(line.measure for line in lines))
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(2, 3, figsize=(11.0, 6.0), layout="constrained", sharey=True)
        for panel, measure in zip(axes.flat, measures, strict=True):
            _panel(panel, measure, [line for line in lines if line.measure == measure])
        axes[0][0].invert_yaxis()
        return svg_of(figure)


def _panel(axes: plt.Axes, measure: str, lines: Sequence[Line]) -> None:
    for row, line in enumerate(lines):
        least, most = line.recorded
        axes.plot([least, most], [row, row], color="0.7", linewidth=9, solid_capstyle="butt")
        axes.plot([(least + most) / 2], [row], "|", color="0.4", markersize=12)
        if math.isfinite(line.ours):
            half = line.half if math.isfinite(line.half) else 0.0
            axes.errorbar(line.ours, row, xerr=half, fmt="o", color=_VERDICT[line.met], capsize=3)
    axes.set_yticks(range(len(lines)), [line.type for line in lines])
    axes.set_title(measure)
    axes.set_xlim(left=0.0)
    axes.grid(axis="x", alpha=0.3)


def occupancy(shares: Mapping[str, Mapping[str, float]]) -> str:
    """One bar for each type, divided by the states in which its time went."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(11.0, 3.6), layout="constrained")
        left = [0.0] * len(shares)
        for state in STATES:
            widths = [share[state] for share in shares.values()]
            if max(widths) < 0.005:
                continue
            name = state.replace("_", " ")
            bars = axes.barh(list(shares), widths, left=left, color=_COLOURS[state], label=name)
            told = [f"{100 * w:.0f}" if w >= _WORTH_A_LABEL else "" for w in widths]
            axes.bar_label(bars, told, label_type="center", fontsize=8)
            left = [a + b for a, b in zip(left, widths, strict=True)]
        axes.invert_yaxis()
        axes.set_xlim(0.0, 1.0)
        axes.set_xlabel("share of the time (numbers in %)")
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.18), ncols=6, frameon=False)
        return svg_of(figure)
