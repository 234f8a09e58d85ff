# SPDX-License-Identifier: BSD-3-Clause
"""The figures of the short-term study as SVG: after Fig. 4.5 and 4.6, and a confusion matrix."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from scipy import stats

from fabric_sim.drift import NORMAL
from fabric_sim.experiments.robots import RUNNING, TITLES, Believed
from fabric_sim.experiments.short_term_table import Study
from fabric_study.figure import STYLE, WINDOW, plt, svg_of

COLOURS = {
    "proactive": "#0072B2",
    "reactive": "#D55E00",
    "none": "#777777",
    "never_help": "#CC79A7",
    "oracle": "#009E73",
    "patient": "#56B4E9",
    "eager": "#E69F00",
}
COURSES = ("proactive", "reactive", "none", "never_help", "oracle")  # drawn over the tasks
MOOD_COLOURS = ("#009E73", "#D55E00", "#0072B2", "#E69F00", "#CC79A7", "#56B4E9")
PERSON = {  # panels after Fig. 4.5: columns of seconds, title
    "evaluating": ("evaluating_s",),
    "no attention": ("no_attention_s",),
    "tired, or on a break": ("tired_s",),
    "failed to grasp": ("failed_to_grasp_s",),
    "warning the robot": ("warning_s",),
    "sum of all unanticipated": (
        "evaluating_s",
        "no_attention_s",
        "tired_s",
        "failed_to_grasp_s",
    ),
}
BANDWIDTH = 2.5  # tasks, of the smooth fit


def courses(
    study: Study, noise: float, robot: str, value: Callable[[Mapping], float]
) -> np.ndarray:
    """Return (n_scenarios, n_tasks): `value` of every task."""
    rows = study.task_rows(noise, robot)
    seeds = sorted({row["scenario_seed"] for row in rows})
    last = max(int(row["task"]) for row in rows)
    table = np.full((len(seeds), last), np.nan)
    for row in rows:
        table[seeds.index(row["scenario_seed"]), int(row["task"]) - 1] = value(row)
    return table


def moving(table: np.ndarray, window: int = WINDOW) -> np.ndarray:
    """Return the mean of the last `window` tasks to each, (n_scenarios, n_tasks), without NaN."""
    total = np.cumsum(np.nan_to_num(table), axis=1)
    count = np.cumsum(np.isfinite(table), axis=1).astype(float)
    total[:, window:] -= total[:, :-window].copy()
    count[:, window:] -= count[:, :-window].copy()
    return np.divide(total, count, out=np.full_like(total, np.nan), where=count > 0)


def smooth(table: np.ndarray, bandwidth: float = BANDWIDTH) -> np.ndarray:
    """Return a Gaussian kernel fit along the tasks, (n_scenarios, n_tasks)."""
    task = np.arange(table.shape[1])
    weight = np.exp(-0.5 * ((task[:, None] - task[None, :]) / bandwidth) ** 2)
    return table @ (weight / weight.sum(axis=1, keepdims=True)).T


def band(table: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean over scenarios and the half width of its 95 % interval, (n_tasks,) each."""
    n = np.isfinite(table).sum(axis=0)
    with warnings.catch_warnings():  # a task in which no scenario has a value stays NaN
        warnings.simplefilter("ignore", RuntimeWarning)
        mean = np.nanmean(table, axis=0)
        deviation = np.nanstd(table, axis=0, ddof=1)
    wide = stats.t.ppf(0.975, np.maximum(n - 1, 1)) * deviation / np.sqrt(np.maximum(n, 1))
    return mean, np.where(n > 1, wide, np.nan)


def person_figure(study: Study, noise: float) -> str:
    """Return Fig. 4.5: seconds a task that the person spends in a state, over the tasks."""
    shown = [robot for robot in ("proactive", "reactive", "none") if robot in study.robots]
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(2, 3, figsize=(11.0, 6.0), layout="constrained", sharex=True)
        for panel, (title, columns) in zip(axes.flat, PERSON.items(), strict=True):
            for robot in shown:
                _draw_state(panel, study, noise, robot, columns)
            panel.set_title(title)
            panel.set_ylim(bottom=0.0)
        for panel in axes[1]:
            panel.set_xlabel("task")
        for panel in axes[:, 0]:
            panel.set_ylabel("s a task")
        axes[0][0].legend(frameon=False)
        return svg_of(figure)


def _draw_state(
    panel: plt.Axes, study: Study, noise: float, robot: str, columns: Sequence[str]
) -> None:
    table = courses(study, noise, robot, lambda row: sum(float(row[name]) for name in columns))
    tasks = np.arange(1, table.shape[1] + 1)
    panel.plot(tasks, table.mean(axis=0), ".", color=COLOURS[robot], alpha=0.35, markersize=4)
    _draw_band(panel, smooth(table), robot)


def _draw_band(panel: plt.Axes, table: np.ndarray, robot: str) -> None:
    tasks = np.arange(1, table.shape[1] + 1)
    mean, half = band(table)
    panel.plot(tasks, mean, color=COLOURS[robot], label=TITLES[robot])
    panel.fill_between(tasks, mean - half, mean + half, color=COLOURS[robot], alpha=0.15, lw=0)


def _cumulative(name: str) -> Callable[[Study, float, str], np.ndarray]:
    return lambda study, noise, robot: np.cumsum(
        courses(study, noise, robot, lambda row: float(row[name] or 0.0)), axis=1
    )


def _moving(name: str) -> Callable[[Study, float, str], np.ndarray]:
    return lambda study, noise, robot: moving(
        courses(study, noise, robot, lambda row: float(row[name]))
    )


def moving_accuracy(study: Study, noise: float, robot: str) -> np.ndarray:
    """Return the share of right estimates in the last tasks, per scenario."""
    right, judged = (
        moving(courses(study, noise, robot, lambda row, k=k: row[f"all_{k}"]))
        for k in ("right", "judged")
    )
    return np.divide(right, judged, out=np.full_like(right, np.nan), where=judged > 0)


PANELS = (
    ("(a) reward, summed up", _cumulative("discounted_reward"), COURSES),
    (f"(b) success, mean of the last {WINDOW}", _moving("success"), COURSES),
    ("(c) warnings, summed up", _cumulative("warnings"), COURSES),
    (f"(d) duration in s, mean of the last {WINDOW}", _moving("duration_s"), COURSES),
    (f"(e) estimates right, mean of the last {WINDOW}", moving_accuracy, ("proactive",)),
)


def robots_figure(study: Study, noise: float) -> str:
    """Return Fig. 4.6 a-e: how the robots did over the tasks; and the moods of the people."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(2, 3, figsize=(11.0, 6.4), layout="constrained", sharex=True)
        for panel, (title, value, shown) in zip(axes.flat, PANELS, strict=False):
            for robot in shown:
                if robot in study.robots:
                    _draw_band(panel, value(study, noise, robot), robot)
            panel.set_title(title)
        for panel in (axes[0][1], axes[1][1]):
            panel.set_ylim(top=1.02)
        _draw_moods(axes[1][2], study, noise)
        for panel in axes[1]:
            panel.set_xlabel("task")
        axes[0][0].legend(frameon=False)
        return svg_of(figure)


def _draw_moods(panel: plt.Axes, study: Study, noise: float) -> None:
    rows = study.task_rows(noise, "proactive")
    moods = sorted({str(row["mood"]) for row in rows}, key=lambda mood: (mood != NORMAL, mood))
    shares = [
        courses(study, noise, "proactive", lambda row, mood=mood: row["mood"] == mood).mean(axis=0)
        for mood in moods
    ]
    tasks = np.arange(1, shares[0].size + 1)
    colours = [MOOD_COLOURS[index % len(MOOD_COLOURS)] for index in range(len(moods))]
    panel.stackplot(tasks, shares, labels=moods, colors=colours, alpha=0.6, step="mid")
    panel.set_title("moods of the people, share")
    panel.set_ylim(0.0, 1.0)
    panel.legend(loc="lower left", framealpha=0.8, edgecolor="none")


def confusion(believed: Mapping[Believed, int]) -> np.ndarray:
    """Return decisions (n_truth, n_belief) in the order of RUNNING."""
    counts = np.zeros((len(RUNNING), len(RUNNING)))
    for pair, n in believed.items():
        if pair.truth in RUNNING and pair.belief in RUNNING:
            counts[RUNNING.index(pair.truth), RUNNING.index(pair.belief)] += n
    return counts


def confusion_figure(study: Study, noise: float) -> str:
    """Return a heat map: what the proactive robot believed (columns) while what was true (rows)."""
    counts = confusion(study.believed[(noise, "proactive")])
    totals = counts.sum(axis=1, keepdims=True)
    shares = np.divide(counts, totals, out=np.zeros_like(counts), where=totals > 0)
    names = [name.replace("_", " ") for name in RUNNING]
    with plt.rc_context({**STYLE, "axes.spines.top": True}):
        figure, axes = plt.subplots(figsize=(8.6, 5.4), layout="constrained")
        axes.imshow(shares, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
        for (row, column), share in np.ndenumerate(shares):
            if totals[row, 0]:
                colour = "white" if share > 0.55 else "black"
                axes.text(column, row, f"{share:.2f}", ha="center", va="center", color=colour)
        axes.set_xticks(range(len(names)), names, rotation=30, ha="right")
        labels = [f"{name}  ({int(n)})" for name, n in zip(names, totals[:, 0], strict=True)]
        axes.set_yticks(range(len(names)), labels)
        axes.set_xlabel("believed likeliest by the robot")
        axes.set_ylabel("true (decisions)")
        return svg_of(figure)
