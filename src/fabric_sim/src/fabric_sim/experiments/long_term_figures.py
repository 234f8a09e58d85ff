# SPDX-License-Identifier: BSD-3-Clause
"""The figures of the long-term study as SVG: after Fig. 5.2, 5.3 and 5.4, and what lies behind."""

from __future__ import annotations

from collections import Counter

import numpy as np

from fabric_sim.experiments.long_term_ablation import ablation_lines
from fabric_sim.experiments.long_term_run import ABPS, BASE, BEST, ORACLE, Adaptation
from fabric_sim.experiments.long_term_shifts import MEASURES
from fabric_sim.experiments.long_term_stats import (
    BY_TASK,
    NEAR,
    WINDOW,
    approach,
    moving_mean,
    ranking,
)
from fabric_sim.experiments.long_term_table import Study
from fabric_sim.experiments.paired import mean_of
from fabric_sim.experiments.scenario import OCCUPIED
from fabric_sim.experiments.short_term_figures import band
from fabric_study.figure import STYLE, plt, svg_of

COLOURS = {ABPS: "#0072B2", "best": "#D55E00", ORACLE: "#009E73", "random": "#777777"}
OCCUPATIONS = ("evaluating", "no attention", "tired, or on a break", "failed to grasp", "warning")
STATE_COLOURS = ("#0072B2", "#E69F00", "#CC79A7", "#D55E00", "#000000")
COURSE_WINDOW = 10  # tasks, of the moving means of Fig. 5.3 and 5.4
FAR = -1.0  # points; what lies further off is written in figures


def convergence_figure(study: Study) -> str:
    """Return Fig. 5.2: the moving regret, the rewards behind it, and what ABPS chose."""
    found, near = study.convergence, approach(study.convergence)
    tasks = np.arange(1, len(near.share) + 1)
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(1, 3, figsize=(11.0, 3.6), layout="constrained")
        axes[0].fill_between(tasks, 100 * near.low, 100 * near.high, color=COLOURS[ABPS], alpha=0.2)
        axes[0].plot(tasks, 100 * near.share, color=COLOURS[ABPS], label="ABPS")
        always = 100 * approach(found, BASE).share
        axes[0].plot(tasks, always, color=COLOURS["random"], label="the base policy, kept")
        axes[0].legend(frameon=False)
        axes[0].axhline(0.0, color="black", linewidth=0.6)
        axes[0].axhline(100 * NEAR, color="black", linewidth=0.6, linestyle="--")
        axes[0].axvline(BY_TASK, color="black", linewidth=0.6, linestyle=":")
        axes[0].set_title(f"moving regret (last {WINDOW} tasks), % of the best")
        for name, title in ((ABPS, "ABPS"), (BEST, "best policy for the person")):
            colour = COLOURS[ABPS if name == ABPS else ORACLE]
            table = moving_mean(found.rewards[name].mean(axis=1))
            _draw_band(axes[1], table, colour, title)
        axes[1].set_title(f"reward, mean of the last {WINDOW}")
        axes[1].legend(frameon=False)
        axes[2].plot(tasks, 100 * found.chosen.mean(axis=(0, 1)), color=COLOURS[ABPS])
        axes[2].set_title("that very policy chosen, % of tasks")
        axes[2].set_ylim(0.0, 100.0)
        for panel in axes:
            panel.set_xlabel("task with the new person")
        return svg_of(figure)


def _draw_band(panel: plt.Axes, table: np.ndarray, colour: str, title: str, **line: object) -> None:
    """table: (n, n_tasks); draw the mean over n with its 95 % interval."""
    mean, half = band(table)
    tasks = np.arange(1, table.shape[1] + 1)
    panel.plot(tasks, mean, color=colour, label=title, **line)
    panel.fill_between(tasks, mean - half, mean + half, color=colour, alpha=0.15, lw=0)


def _shown(found: Adaptation) -> list[tuple[str, str, str]]:
    """Strategies that the courses show: name, colour, title."""
    best = found.best_constant()
    return [
        (ABPS, COLOURS[ABPS], "ABPS"),
        (best, COLOURS["best"], f"best constant ({best})"),
        (ORACLE, COLOURS[ORACLE], "oracle"),
    ]


def _table(found: Adaptation, name: str, measure: str) -> np.ndarray:
    """(n_orders, n_tasks)."""
    return found.figures[name][:, :, list(MEASURES).index(measure)]


def _mark_shifts(panel: plt.Axes, found: Adaptation) -> None:
    tasks = found.shift_tasks
    for place in range(1, len(found.shifts[0])):
        panel.axvline(place * tasks + 0.5, color="#bbbbbb", linewidth=0.6, zorder=0)


def order_figure(study: Study) -> str:
    """Return Fig. 5.3 for the first order: its people, the rewards, belief and choices of ABPS."""
    found, course = study.adaptation, study.adaptation.courses[ABPS][0]
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(
            4, 1, figsize=(11.0, 11.0), layout="constrained", height_ratios=(2, 2, 2.4, 2)
        )
        seconds = moving_mean(course.seconds.T, COURSE_WINDOW)
        tasks = np.arange(1, seconds.shape[1] + 1)
        for values, title, colour in zip(seconds, OCCUPATIONS, STATE_COLOURS, strict=True):
            axes[0].plot(tasks, values, label=title, color=colour)
        axes[0].set_title(f"(a) what the person is seen to do, s a task, last {COURSE_WINDOW}")
        axes[0].legend(frameon=False, ncols=len(OCCUPIED), loc="upper right", fontsize=7)
        for name, colour, title in _shown(found):
            rewards = moving_mean(_table(found, name, "reward")[0], COURSE_WINDOW)
            axes[1].plot(tasks, rewards, color=colour, label=title)
        axes[1].set_title(f"(b) reward, mean of the last {COURSE_WINDOW}")
        axes[1].legend(frameon=False, ncols=3, loc="lower right")
        _draw_types(axes[2], study, course.types)
        _draw_choices(axes[3], found, course.policies)
        for panel in axes:
            _mark_shifts(panel, found)
            panel.set_xlim(0.5, len(tasks) + 0.5)
        axes[3].set_xlabel("task; a line where another person takes over, which nobody tells ABPS")
        return svg_of(figure)


def _draw_types(panel: plt.Axes, study: Study, types: np.ndarray) -> None:
    names = [name.replace("_", " ") for name in study.types]
    panel.imshow(
        types.T,
        aspect="auto",
        cmap="Blues",
        vmin=0.0,
        vmax=1.0,
        interpolation="none",
        extent=(0.5, len(types) + 0.5, len(names) - 0.5, -0.5),
    )
    panel.set_yticks(range(len(names)), names, fontsize=6)
    panel.set_title("(c) belief over the known types after each task (dark: certain)")


def _draw_choices(panel: plt.Axes, found: Adaptation, policies: list[str]) -> None:
    people, tasks = len(found.shifts[0]), found.shift_tasks
    best = found.hindsight.best[:people]
    names = sorted({*policies, *best}, key=found.library.index)
    panel.plot(
        range(1, len(policies) + 1),
        [names.index(name) for name in policies],
        ".",
        color=COLOURS[ABPS],
    )
    for place, name in enumerate(best):
        ends = (place * tasks + 0.5, (place + 1) * tasks + 0.5)
        panel.plot(ends, [names.index(name)] * 2, color=COLOURS[ORACLE], linewidth=3, alpha=0.5)
    panel.set_yticks(range(len(names)), names)
    panel.set_ylim(len(names) - 0.5, -0.5)
    panel.set_title("(d) dots: policy that ABPS chose; bars: best one for the person in hindsight")


def courses_figure(study: Study) -> str:
    """Return Fig. 5.4 a-d over all orders, and the reward by tasks since the change."""
    found = study.adaptation
    panels = (
        ("(a) reward, summed up", "reward", None),
        ("(b) warnings, summed up", "warnings", None),
        (f"(c) success, mean of the last {COURSE_WINDOW}", "success", COURSE_WINDOW),
        (f"(d) duration in s, mean of the last {COURSE_WINDOW}", "duration_s", COURSE_WINDOW),
    )
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(2, 3, figsize=(11.0, 6.4), layout="constrained")
        spots = (axes[0][0], axes[0][1], axes[1][0], axes[1][1])
        for panel, (title, measure, window) in zip(spots, panels, strict=True):
            for name, colour, label in _shown(found):
                table = _table(found, name, measure)
                course = np.cumsum(table, axis=1) if window is None else moving_mean(table, window)
                _draw_band(panel, course, colour, label)
            panel.set_title(title)
            panel.set_xlabel("task")
        axes[0][0].legend(frameon=False)
        _draw_since_change(axes[0][2], found)
        _draw_people(axes[1][2], found)
        return svg_of(figure)


def _draw_since_change(panel: plt.Axes, found: Adaptation) -> None:
    orders, people, tasks = len(found.seeds), len(found.shifts[0]), found.shift_tasks
    for name, colour, title in _shown(found):
        table = _table(found, name, "reward").reshape(orders, people, tasks)
        later = table[:, 1:] if people > 1 else table
        _draw_band(panel, moving_mean(later.mean(axis=1)), colour, title)
    panel.set_title(f"(e) reward since the change, last {WINDOW} tasks")
    panel.set_xlabel("task of the shift")


def _draw_people(panel: plt.Axes, found: Adaptation) -> None:
    best, (orders, people) = found.best_constant(), (len(found.seeds), len(found.shifts[0]))
    means = {
        name: _table(found, name, "reward").reshape(orders * people, -1).mean(axis=1)
        for name in (ABPS, ORACLE, best)
    }
    possible, gained = means[ORACLE] - means[best], means[ABPS] - means[best]
    panel.plot(possible, gained, ".", color=COLOURS[ABPS], alpha=0.5)
    ends = [min(possible.min(), gained.min()), max(possible.max(), gained.max())]
    panel.plot(ends, ends, color="black", linewidth=0.6, linestyle="--")
    panel.axhline(0.0, color="black", linewidth=0.6)
    panel.set_title("(f) a dot a person: points gained")
    panel.set_xlabel("oracle")
    panel.set_ylabel("ABPS")


def strategies_figure(study: Study) -> str:
    """Return what every strategy earns more or less than the best constant, with 95 % intervals."""
    found, best = study.adaptation, study.adaptation.best_constant()
    base = found.per_order(best, "reward")
    names = sorted(ranking(found), key=lambda name: -found.per_order(name, "reward").mean())
    with plt.rc_context(STYLE):
        height = 1.0 + 0.22 * len(names)
        figure, panel = plt.subplots(figsize=(9.0, height), layout="constrained")
        for row, name in enumerate(names):
            gained = mean_of(found.per_order(name, "reward") - base)
            colour, half = _colour(found, name), (gained.high - gained.low) / 2.0
            if gained.value < FAR:
                panel.text(FAR, row, f"  {gained.value:+.2f}", color=colour, va="center")
            else:
                panel.errorbar(gained.value, row, xerr=half, fmt="o", color=colour, capsize=3)
        panel.set_yticks(range(len(names)), [study.title(name) for name in names])
        panel.set_ylim(len(names) - 0.5, -0.5)
        panel.set_xlim(left=FAR)
        panel.axvline(0.0, color="black", linewidth=0.6)
        panel.set_xlabel(f"points a task, minus the best constant ({best}), paired by order")
        return svg_of(figure)


def _colour(found: Adaptation, name: str) -> str:
    if name in (ABPS, ORACLE):
        return COLOURS[name]
    if name == found.best_constant():
        return COLOURS["best"]
    if name in found.courses:
        return "#56B4E9"
    return "#888888" if name in found.library else "#CC79A7"


def choices_figure(study: Study) -> str:
    """Return how often ABPS chose a policy beside how often it is the best one for a person."""
    found = study.adaptation
    chosen = Counter(name for course in found.courses[ABPS] for name in course.policies)
    best = Counter(found.hindsight.best)
    rows = np.arange(len(found.library))
    with plt.rc_context(STYLE):
        figure, panel = plt.subplots(figsize=(9.0, 1.0 + 0.28 * len(rows)), layout="constrained")
        for offset, counts, colour, title in (
            (-0.2, chosen, COLOURS[ABPS], "chosen by ABPS, share of tasks"),
            (0.2, best, COLOURS[ORACLE], "best in hindsight, share of people"),
        ):
            total = max(1, sum(counts.values()))
            shares = [100 * counts[name] / total for name in found.library]
            panel.barh(rows + offset, shares, height=0.38, color=colour, label=title)
        panel.set_yticks(rows, found.library)
        panel.invert_yaxis()
        panel.set_xlabel("%")
        panel.legend(frameon=False)
        return svg_of(figure)


def ablation_figure(study: Study) -> str:
    """Return what every variant earns more or less than ABPS as shipped."""
    lines = [line for line in ablation_lines(study.adaptation, study.ablation) if line.against]
    with plt.rc_context(STYLE):
        figure, panel = plt.subplots(figsize=(9.0, 1.0 + 0.26 * len(lines)), layout="constrained")
        groups = list(dict.fromkeys(line.group for line in lines))
        for row, line in enumerate(lines):
            found = line.against.difference
            error = (found.high - found.low) / 2.0
            colour = f"C{groups.index(line.group)}"
            panel.errorbar(found.value, row, xerr=error, fmt="o", color=colour, capsize=3)
        labels = [f"{line.group}: {line.label}" for line in lines]
        panel.set_yticks(range(len(lines)), labels)
        panel.invert_yaxis()
        panel.axvline(0.0, color="black", linewidth=0.6)
        panel.set_xlabel("reward per task, minus ABPS as shipped (paired by order, 95 % interval)")
        return svg_of(figure)
