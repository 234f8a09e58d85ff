# SPDX-License-Identifier: BSD-3-Clause
"""Solving a model offline while telling how the bounds move, and their picture."""

import argparse
import math
from collections.abc import Sequence
from pathlib import Path

import fabric_planner as fp

Moment = tuple[float, float, float]  # CPU seconds, lower and upper bound at the initial belief


def relative_gap(lower: float, upper: float) -> float:
    """Share of the lower bound's size."""
    return (upper - lower) / abs(lower) if lower else math.inf


class Progress:
    """Prints a moment whenever the gap has shrunk by a tenth since the last."""

    def __init__(self) -> None:
        self.gap = math.inf

    def __call__(self, seconds: float, lower: float, upper: float) -> None:
        if upper - lower < 0.9 * self.gap:
            self.gap = upper - lower
            print(moment((seconds, lower, upper)), flush=True)


def solve_aloud(model: fp.Pomdp, arguments: argparse.Namespace) -> tuple[fp.Solution, dict]:
    """Solves as the options say; prints how the bounds move unless --json was given."""
    options = {} if arguments.gap is None else {"gap": arguments.gap}
    progress = None if arguments.json else Progress()
    solution = fp.solve(model, time=arguments.solve, progress=progress, **options)
    history = [tuple(row) for row in solution.history[:, [0, 2, 3]].tolist()]
    if arguments.plot:
        write_bounds_plot(history, arguments.plot, f"{Path(model.name).stem}: bounds over time")
    told = {
        "lower_bound": solution.lower_value,
        "upper_bound": solution.upper_value,
        "gap": solution.gap,
        "relative_gap": relative_gap(solution.lower_value, solution.upper_value),
        "history": history,
    }
    return solution, told


def moment(at: Moment) -> str:
    seconds, lower, upper = at
    return (
        f"{seconds:8.2f} s  lower {lower:<10.6g} upper {upper:<10.6g} "
        f"gap {upper - lower:.4g} ({100.0 * relative_gap(lower, upper):.2f} %)"
    )


def describe_solution(told: dict) -> str:
    last = told["history"][-1]
    return f"solved      {moment(tuple(last)).strip()}"


def write_bounds_plot(history: Sequence[Moment], path: "str | Path", title: str) -> None:
    """A PNG of both bounds over CPU time, which is logarithmic; between them is the optimum."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 4.5), constrained_layout=True)
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    times = [max(1e-4, seconds) for seconds, _, _ in history]
    lower, upper = [low for _, low, _ in history], [high for _, _, high in history]
    axes.fill_between(times, lower, upper, step="post", color="0.9", label="the optimal value")
    axes.step(times, upper, where="post", color="tab:red", label=f"upper bound, {upper[-1]:.6g}")
    axes.step(times, lower, where="post", color="tab:blue", label=f"lower bound, {lower[-1]:.6g}")
    axes.set_xscale("log")
    axes.set_xlim(times[0], max(times[-1], 2.0 * times[0]))
    axes.set_ylim(_limits(lower, upper))
    axes.set_xlabel("CPU time (s)")
    axes.set_ylabel("value at the initial belief")
    axes.set_title(title)
    axes.legend()
    figure.savefig(path, dpi=110)


def _limits(lower: Sequence[float], upper: Sequence[float]) -> tuple[float, float]:
    """Room for where the bounds end, so that their first guesses do not flatten the picture."""
    room = max(4.0 * (upper[-1] - lower[-1]), 0.02 * abs(lower[-1]), 1e-6)
    return max(min(lower), lower[-1] - room), min(max(upper), upper[-1] + room)
