# SPDX-License-Identifier: BSD-3-Clause
"""The figures of a run as lines, as one table and as one picture."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fabric_planner.bench_record import Figure

HEAD = ("figure", "model", "ours", "target", "met", "reference", "baseline of this run")
SAID_BEFORE = ("bench", "figure", "detail", "model", "value", "unit")
LEAST = 1e-4  # multiple of a target below which a bar is not told from zero


def number(value: object) -> str:
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:.5g}"
    return str(value)


def label(figure: Figure) -> str:
    """Name and detail, e.g. "deadline_overrun at 5 ms"."""
    return f"{figure['figure']} {figure.get('detail', '')}".strip()


def line(figure: Figure) -> str:
    """One figure as it was measured, with all that was told about it."""
    shown = [
        f"{key}={number(value)}"
        for key, value in figure.items()
        if key not in SAID_BEFORE and not isinstance(value, list | dict)
    ]
    value = f"{number(figure.get('value'))} {figure.get('unit', '')}" if "value" in figure else ""
    return f"{label(figure):<26} {figure.get('model', ''):<22} {value:<14} " + " ".join(shown)


def table(figures: Sequence[Figure]) -> str:
    """All figures that have a value, ours beside target, reference and baseline."""
    rows = [HEAD] + [_row(figure) for figure in figures if "value" in figure]
    widths = [max(len(row[i]) for row in rows) for i in range(len(HEAD))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
             for row in rows]  # fmt: skip
    lines.insert(1, "-" * (sum(widths) + 2 * len(widths) - 2))
    judged = [figure for figure in figures if "met" in figure]
    lines.append(f"{sum(bool(f['met']) for f in judged)} of {len(judged)} targets met")
    return "\n".join(lines)


def _row(figure: Figure) -> tuple[str, ...]:
    error = figure.get("standard_error")
    value = number(figure["value"]) + (f" +- {number(error)}" if error is not None else "")
    target = f"{figure['sense']} {number(figure['target'])}" if "target" in figure else ""
    baseline = ""
    if "baseline" in figure:
        ratio = figure["baseline_over_ours"]
        baseline = f"{number(figure['baseline_value'])} ({figure['baseline']}"
        baseline += f", {number(ratio)} x ours)" if ratio is not None else ")"
    return (
        label(figure),
        str(figure["model"]),
        f"{value} {figure['unit']}",
        target,
        _verdict(figure),
        _reference(figure),
        baseline,
    )


def _reference(figure: Figure) -> str:
    if "reference" not in figure:
        return ""
    return f"{number(figure['reference'])} {figure.get('reference_at', '')}".rstrip()


def _verdict(figure: Figure) -> str:
    if "missed_by_errors" in figure:
        return f"NO, by {figure['missed_by_errors']:.1f} se"
    return {True: "yes", False: "NO"}.get(figure.get("met"), "")


def write_plot(figures: Sequence[Figure], path: "str | Path") -> None:
    """A PNG: above, costs as multiples of their targets; below, returns beside the reference."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Picture

    costs = [f for f in figures if f.get("sense") == "<=" and f["value"] is not None]
    returns = [f for f in figures if f["figure"] == "return"]
    height = 1.6 + 0.3 * len(costs) + 0.42 * len(returns)
    picture = Picture(figsize=(11, max(4.0, height)), constrained_layout=True)
    FigureCanvasAgg(picture)
    parts = [part for part in ((_draw_costs, costs), (_draw_returns, returns)) if part[1]]
    if parts:
        ratios = [len(part[1]) + 2 for part in parts]
        panels = picture.subplots(len(parts), 1, height_ratios=ratios, squeeze=False)[:, 0]
        for axes, (draw, shown) in zip(panels, parts, strict=True):
            draw(axes, shown)
    picture.savefig(path, dpi=110)


def _positive(value: object) -> bool:
    return isinstance(value, float | int) and value > 0 and math.isfinite(value)


def _draw_costs(axes: Any, figures: Sequence[Figure]) -> None:
    """Bars on a logarithmic axis around the target, 1."""
    for row, f in enumerate(figures):
        own = max(LEAST, f["value"] / f["target"])
        colour = "lightgreen" if f["met"] else "salmon"
        axes.barh(row, own - LEAST, left=LEAST, color=colour)
        axes.text(1.4 * LEAST, row, f"{number(f['value'])} {f['unit']}", va="center", fontsize=8)
        for key, mark in (("reference", "D"), ("baseline_value", "|")):
            if _positive(f.get(key)):
                axes.scatter(f[key] / f["target"], row, marker=mark, color="black", s=28, zorder=3)
    axes.set_xscale("log")
    shown = ("value", "reference", "baseline_value")
    seen = [f[key] / f["target"] for f in figures for key in shown if _positive(f.get(key))]
    axes.set_xlim(LEAST, max([10.0, *seen]) * 4)
    axes.axvline(1.0, color="black", lw=1)
    axes.set_yticks(range(len(figures)), [f"{label(f)}, {f['model']}" for f in figures])
    axes.tick_params(axis="y", labelsize=8)
    axes.set_ylim(len(figures) - 0.4, -0.6)
    axes.set_xlabel("multiple of the target (line at 1; less is better)")
    axes.scatter(
        [], [], marker="D", color="black", s=28, label="reference planner, on its machine and model"
    )
    axes.scatter([], [], marker="|", color="black", s=40, label="plain baseline of this run")
    axes.legend(fontsize="small", loc="lower right")


def _draw_returns(axes: Any, figures: Sequence[Figure]) -> None:
    for row, f in enumerate(figures):
        axes.barh(
            row, f["value"], height=0.6, xerr=f.get("standard_error"), capsize=3,
            color={True: "lightgreen", False: "salmon"}.get(f.get("met"), "lightgrey"),
        )  # fmt: skip
        for key, mark in (("reference", "D"), ("target", "|")):
            if f.get(key) is not None:
                axes.scatter(f[key], row, marker=mark, color="black", s=40, zorder=3)
    labels = [f"{f['model']}, {f.get('detail', '')}" for f in figures]
    axes.set_yticks(range(len(figures)), labels)
    axes.tick_params(axis="y", labelsize=8)
    axes.set_ylim(len(figures) - 0.4, -0.6)
    axes.axvline(0.0, color="black", lw=0.8)
    axes.set_xlabel("mean discounted return +- standard error")
    axes.scatter(
        [],
        [],
        marker="D",
        color="black",
        s=40,
        label="reference planner, at the budget the table tells",
    )
    axes.scatter([], [], marker="|", color="black", s=60, label="target")
    axes.legend(fontsize="small", loc="lower right")
