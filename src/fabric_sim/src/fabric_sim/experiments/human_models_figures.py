# SPDX-License-Identifier: BSD-3-Clause
"""Figures of the human-models experiment, as SVG text."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fabric_sim.experiments.dial_fit import DIALS
from fabric_sim.experiments.people_fit import PeopleResult, PersonResult
from fabric_sim.experiments.recovery import Recovery
from fabric_study.figure import STYLE, plt, svg_of

ENDS = {
    "expertise": ("beginner", "expert"),
    "stamina": ("tired", "rested"),
    "attention": ("distracted", "attentive"),
    "collaborativeness": ("noncollaborative", "collaborative"),
}


def heat_map(
    table: np.ndarray,
    rows: Sequence[str],
    columns: Sequence[str],
    left: str,
    top: str,
) -> str:
    """Return likelihoods (n, m) as coloured cells with numbers; the largest of a row is framed."""
    with plt.rc_context({**STYLE, "axes.spines.right": False, "axes.spines.left": False}):
        size = (2.2 + 0.52 * len(columns), 1.3 + 0.33 * len(rows))
        figure, axes = plt.subplots(figsize=size, layout="constrained")
        shades = table / table.max(axis=1, keepdims=True)
        axes.imshow(shades, cmap="Blues", vmin=0.0, vmax=1.25, aspect="auto")
        for i, j in np.ndindex(table.shape):
            best = j == int(table[i].argmax())
            shade = "white" if shades[i, j] > 0.8 else "#223"
            weight = "bold" if best else "normal"
            text = _number(table[i, j])
            axes.text(j, i, text, ha="center", va="center", size=7.5, color=shade, weight=weight)
            if best:
                frame = plt.Rectangle((j - 0.5, i - 0.5), 1, 1, fill=False, ec="#d95f02", lw=1.6)
                axes.add_patch(frame)
        axes.set_xticks(range(len(columns)), columns, rotation=45 if len(columns) > 8 else 0)
        axes.set_yticks(range(len(rows)), rows)
        axes.tick_params(length=0)
        axes.xaxis.tick_top()
        axes.xaxis.set_label_position("top")
        axes.set_xlabel(top)
        axes.set_ylabel(left)
        axes.spines["bottom"].set_visible(False)
        return svg_of(figure)


def _number(value: float) -> str:
    """Three decimals without the leading zero, as in Fig. 6.29."""
    return f"{value:.3f}".lstrip("0") if value >= 0.0005 else "0"


def dials_figure(people: Sequence[PersonResult]) -> str:
    """Return the four dials of each person with their 95 % intervals."""
    with plt.rc_context(STYLE):
        height = 1.2 + 0.3 * len(people)
        figure, axes = plt.subplots(1, 4, figsize=(11.0, height), sharey=True, layout="constrained")
        for d, name in enumerate(DIALS):
            panel = axes[d]
            for i, person in enumerate(people):
                fit = person.fit
                panel.plot((fit.least[d], fit.most[d]), (i, i), color="#9db8d6", lw=6, zorder=1)
                panel.plot(fit.best[d], i, "o", color="#1f4e8c", ms=6, zorder=2)
            _dial_axis(panel, name)
            panel.spines["right"].set_visible(False)
        axes[0].set_yticks(range(len(people)), [person.name for person in people])
        axes[0].set_ylim(len(people) - 0.5, -0.5)
        return svg_of(figure)


def _dial_axis(panel: plt.Axes, name: str) -> None:
    low, high = ENDS[name]
    panel.set_xlim(-0.05, 1.05)
    panel.set_xticks((0.0, 0.5, 1.0), ("0", "0.5", "1"), size=7.5)
    panel.set_xlabel(f"{low}  ↔  {high}", size=7.5)
    panel.set_title(name)
    panel.set_axisbelow(True)
    panel.grid(axis="x", color="#eee", zorder=0)


def recovery_figure(recovery: Recovery) -> str:
    """Return true against fitted dials, with intervals; those that miss the truth in red."""
    with plt.rc_context({**STYLE, "axes.spines.right": False}):
        figure, axes = plt.subplots(1, 4, figsize=(11.0, 3.4), sharey=True, layout="constrained")
        for d, name in enumerate(DIALS):
            panel = axes[d]
            panel.plot((0, 1), (0, 1), color="#bbb", lw=1)
            for row, fit in enumerate(recovery.fits):
                colour = "#1f4e8c" if recovery.covered[row, d] else "#c0392b"
                true = recovery.true[row, d]
                panel.plot(
                    (true, true), (fit.least[d], fit.most[d]), color=colour, lw=1.5, alpha=0.5
                )
                panel.plot(true, fit.best[d], "o", color=colour, ms=4.5)
            panel.set_title(
                f"{name}\nerror {recovery.error[d]:.2f}, r {recovery.correlation[d]:.2f}"
            )
            panel.set_xlim(-0.05, 1.05)
            panel.set_ylim(-0.05, 1.05)
            panel.set_xlabel("true")
        axes[0].set_ylabel("fitted, with 95 % interval")
        return svg_of(figure)


def prediction_figure(result: PeopleResult) -> str:
    """Return what the fitted dials gain over other predictors on held-out tasks."""
    comparisons = [c for c in result.comparisons() if c.baseline != "uniform"]
    table = result.predictions
    gains = {
        "best known type": table[:, 0] - table[:, 1],
        "persistence": table[:, 0] - table[:, 3],
    }
    with plt.rc_context({**STYLE, "axes.spines.right": False}):
        figure, axes = plt.subplots(1, 2, figsize=(11.0, 2.8), layout="constrained")
        for panel, (name, values) in zip(axes, gains.items(), strict=True):
            comparison = next(c for c in comparisons if c.baseline == name)
            start = 0
            for index, person in enumerate(p for p in result.people if p.predictions is not None):
                own = len(person.predictions)
                at = range(start, start + own)
                panel.bar(
                    at, values[start : start + own], color=f"C{index % 10}", label=person.name
                )
                start += own
            panel.axhline(0.0, color="black", lw=0.7)
            panel.axhline(comparison.mean, color="#555", lw=1, ls="--")
            panel.set_title(
                f"gain over {name}, mean {comparison.mean:+.2f} ± {comparison.half:.2f}"
            )
            panel.set_xlabel("held-out task")
        axes[0].set_ylabel("nats")
        if len(result.people) <= 8:
            axes[1].legend(frameon=False, fontsize=7.5, bbox_to_anchor=(1.0, 1.0), loc="upper left")
        return svg_of(figure)
