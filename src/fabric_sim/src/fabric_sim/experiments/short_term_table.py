# SPDX-License-Identifier: BSD-3-Clause
"""The figures of the short-term study: Table 4.1 beside the published one, tests, goals."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

from fabric_sim.experiments.paired import (
    Comparison,
    Interval,
    compare,
    holm,
    mean_of,
    share_of_way,
)
from fabric_sim.experiments.robots import TITLES, Believed
from fabric_sim.experiments.shell import without_nan
from fabric_study.meter import Value

Rows = Sequence[Mapping[str, Value]]


class Measure(NamedTuple):
    """A line of Table 4.1; published: (reactive, proactive), None where not given."""

    name: str
    title: str
    higher_is_better: bool
    published: tuple[float | None, float | None]
    digits: int


MEASURES = (
    Measure("reward", "reward per task", True, (2.10, 4.37), 2),
    Measure("warnings", "warnings per scenario", False, (13.8, 1.6), 2),
    Measure("stage1_accuracy", "stage-1 accuracy", True, (None, 0.7926), 3),
    Measure("stage2_accuracy", "stage-2 accuracy", True, (0.4469, 0.7137), 3),
    Measure("success", "success rate", True, (0.73, 0.87), 3),
    Measure("duration_s", "task duration in s", False, (24.77, 21.40), 2),
)
#: Shown too, but nothing is claimed about them.
FURTHER = (
    Measure("human_share", "done by the person", True, (None, None), 3),
    Measure("stage1_pooled", "stage 1, decisions pooled", True, (None, None), 3),
    Measure("stage2_pooled", "stage 2, decisions pooled", True, (None, None), 3),
    Measure("false_warnings", "misread warnings per scenario", False, (None, None), 2),
    Measure("decisions", "decisions per task", False, (None, None), 1),
)
CLAIMED = ("reward", "warnings", "success", "duration_s")  # proactive beats reactive
SIGNIFICANT = 0.001
LIMITS = (  # measure, at least (+1) or at most (-1), the published value
    ("warnings", -1, 1.6),
    ("success", +1, 0.87),
    ("stage1_accuracy", +1, 0.79),
    ("stage2_accuracy", +1, 0.71),
)
WAYS = ("reward", "success", "duration_s")  # from the person alone to the oracle
SCENARIO_COLUMNS = (
    "noise",
    "robot",
    "scenario_seed",
    "tasks",
    *(measure.name for measure in MEASURES + FURTHER),
)


@dataclass(frozen=True)
class Study:
    """tasks: TASK_COLUMNS; scenarios: SCENARIO_COLUMNS; believed: by (noise, robot)."""

    robots: tuple[str, ...]
    noises: tuple[float, ...]
    tasks: list[dict[str, Value]]
    scenarios: list[dict[str, Value]]
    believed: dict[tuple[float, str], Counter[Believed]]

    def values(self, noise: float, robot: str, measure: str) -> dict[int, float]:
        """Return the defined values of a measure by the seed of the scenario."""
        return {
            row["scenario_seed"]: float(row[measure])
            for row in self.scenarios
            if (row["noise"], row["robot"]) == (noise, robot) and row[measure] is not None
        }

    def task_rows(self, noise: float, robot: str) -> list[dict[str, Value]]:
        """Return the tasks of a robot, scenario by scenario."""
        return [row for row in self.tasks if (row["noise"], row["robot"]) == (noise, robot)]


def scenario_row(rows: Rows) -> dict[str, Value]:
    """Return the figures of a scenario from its tasks.

    An accuracy is the mean over the tasks in which the stage came up, as the course of Fig. 4.6e;
    pooled, every decision weighs the same.
    """
    sums = {name: math.fsum(float(row[name] or 0.0) for row in rows) for name in rows[0]
            if not isinstance(rows[0][name], str)}  # fmt: skip
    n = len(rows)
    values = (
        rows[0]["noise"],
        rows[0]["robot"],
        rows[0]["scenario_seed"],
        n,
        sums["discounted_reward"] / n,
        sums["warnings"],
        _mean(rows, "stage1_accuracy"),
        _mean(rows, "stage2_accuracy"),
        sums["success"] / n,
        sums["duration_s"] / n,
        sums["human_succeeded"] / n,
        _ratio(sums["stage1_right"], sums["stage1_judged"]),
        _ratio(sums["stage2_right"], sums["stage2_judged"]),
        sums["false_warnings"],
        sums["decisions"] / n,
    )
    row = dict(zip(SCENARIO_COLUMNS, values, strict=True))
    for stage in ("stage1", "stage2"):  # a model that does not know a stage is not judged
        if row[f"{stage}_accuracy"] is None:
            row[f"{stage}_pooled"] = None
    return row


def _mean(rows: Rows, name: str) -> float | None:
    values = [float(row[name]) for row in rows if row[name] is not None]
    return _ratio(math.fsum(values), len(values))


def _ratio(part: float, whole: float) -> float | None:
    return part / whole if whole else None


def measured(study: Study, noise: float, robot: str, measure: str) -> Interval | None:
    """Return the mean over scenarios with its interval, None when it is undefined."""
    values = list(study.values(noise, robot, measure).values())
    return mean_of(values) if values else None


def comparisons(study: Study, noise: float, first: str, second: str) -> dict[str, Comparison]:
    """Compare two robots over equal scenarios, by measure; Holm over the measures."""
    results = {}
    for measure in MEASURES:
        one, other = (study.values(noise, robot, measure.name) for robot in (first, second))
        common = sorted(set(one) & set(other))
        if len(common) >= 2:
            results[measure.name] = compare(
                [one[seed] for seed in common], [other[seed] for seed in common]
            )
    return holm(results)


class Goal(NamedTuple):
    """One goal of the study; met is None when there is nothing to judge."""

    text: str
    ours: str
    met: bool | None


def goals(study: Study, noise: float) -> list[Goal]:
    """Return the goals for the proactive robot under this noise."""
    against = comparisons(study, noise, "proactive", "reactive")
    found = []
    for measure in MEASURES:
        if measure.name in CLAIMED:
            found.append(_claim(measure, against.get(measure.name)))
    for name, sign, limit in LIMITS:
        measure = next(measure for measure in MEASURES if measure.name == name)
        ours = measured(study, noise, "proactive", name)
        word = "at least" if sign > 0 else "at most"
        text = f"{measure.title} of the proactive robot {word} {limit:g}"
        met = None if ours is None else sign * (ours.value - limit) >= 0.0
        found.append(Goal(text, interval_text(ours, measure.digits), met))
    return found


def _claim(measure: Measure, comparison: Comparison | None) -> Goal:
    text = f"proactive better than reactive in {measure.title}, p < {SIGNIFICANT:g}"
    if comparison is None:
        return Goal(text, "", None)
    better = (comparison.difference.value > 0.0) == measure.higher_is_better
    met = better and comparison.p_holm < SIGNIFICANT
    ours = f"{signed_text(comparison.difference, measure.digits)}, p {p_text(comparison.p_holm)}"
    return Goal(text, ours, met)


def ways(study: Study, noise: float, robot: str) -> dict[str, Interval]:
    """Return how far a robot is on the way from the person alone (0) to the oracle (1)."""
    if not {"none", "oracle"} <= set(study.robots):
        return {}
    places = (robot, "none", "oracle")
    return {
        name: share_of_way(*(_aligned(study, noise, who, name) for who in places), seed=1)
        for name in WAYS
    }


def _aligned(study: Study, noise: float, robot: str, measure: str) -> list[float]:
    values = study.values(noise, robot, measure)
    return [values[seed] for seed in sorted(values)]


# -- text ---------------------------------------------------------------------------------------


def interval_text(interval: Interval | None, digits: int) -> str:
    """Return "mean ± half width", "" for nothing."""
    if interval is None:
        return ""
    if math.isnan(interval.low):
        return f"{interval.value:.{digits}f}"
    return f"{interval.value:.{digits}f} ± {(interval.high - interval.low) / 2.0:.{digits}f}"


def signed_text(interval: Interval, digits: int) -> str:
    """Return a difference with its sign and half width."""
    half = (interval.high - interval.low) / 2.0
    return f"{interval.value:+.{digits}f} ± {half:.{digits}f}"


def range_text(interval: Interval, digits: int = 2) -> str:
    """Return "value [low, high]", "-" for an undefined one."""
    if math.isnan(interval.value):
        return "-"
    return f"{interval.value:.{digits}f} [{interval.low:.{digits}f}, {interval.high:.{digits}f}]"


def p_text(p: float) -> str:
    """Return a p value as printed in tables."""
    return "< .0001" if p < 1e-4 else f"{p:.4f}".replace("0.", ".", 1)


def main_table(study: Study, noise: float) -> list[list[str]]:
    """Return Table 4.1, header first: published values, then every robot."""
    header = ["measure", "published reactive", "published proactive"]
    table = [header + [TITLES[robot] for robot in study.robots]]
    for measure in MEASURES + FURTHER:
        published = ["" if value is None else f"{value:g}" for value in measure.published]
        ours = [
            interval_text(measured(study, noise, robot, measure.name), measure.digits)
            for robot in study.robots
        ]
        table.append([measure.title, *published, *ours])
    return table


def comparison_table(study: Study, noise: float, second: str) -> list[list[str]]:
    """Return proactive minus another robot, header first."""
    table = [["measure", "difference", "gain", "d_z", "t test p", "Wilcoxon p", "Holm p"]]
    results = comparisons(study, noise, "proactive", second)
    for measure in MEASURES:
        if measure.name not in results:
            continue
        c = results[measure.name]
        table.append(
            [
                measure.title,
                signed_text(c.difference, measure.digits),
                "-" if math.isnan(c.gain) else f"{100.0 * c.gain:+.0f} %",
                range_text(c.effect),
                p_text(c.p_t),
                p_text(c.p_wilcoxon),
                p_text(c.p_holm),
            ]
        )
    return table


def way_table(study: Study, noise: float) -> list[list[str]]:
    """Return the way from the person alone to the oracle, header first; empty without them."""
    titles = [measure.title for measure in MEASURES if measure.name in WAYS]
    table = [["robot", *titles]]
    for robot in study.robots:
        found = ways(study, noise, robot)
        if found and robot not in ("none", "oracle"):
            table.append([TITLES[robot], *(range_text(found[name]) for name in WAYS)])
    return table if len(table) > 1 else []


def goal_table(study: Study, noise: float) -> list[list[str]]:
    """Return the goals, header first."""
    words = {True: "met", False: "NOT met", None: "not measured"}
    return [
        ["goal", "ours", ""],
        *([goal.text, goal.ours, words[goal.met]] for goal in goals(study, noise)),
    ]


def aligned_text(table: Sequence[Sequence[str]]) -> str:
    """Return a table as text: the first column to the left, the others to the right."""
    widths = [max(len(line[index]) for line in table) for index in range(len(table[0]))]
    lines = []
    for line in table:
        cells = [line[0].ljust(widths[0])]
        cells += [cell.rjust(width) for cell, width in zip(line[1:], widths[1:], strict=True)]
        lines.append("  ".join(cells).rstrip())
    lines.insert(1, "-" * max(map(len, lines)))
    return "\n".join(lines)


def noise_title(noise: float) -> str:
    """Return how a noise is spoken of."""
    return f"recognition errs in {100.0 * noise:g} % of the behaviours"


def table_text(study: Study) -> str:
    """Return the tables as text; comparisons with further robots are left to the report."""
    parts = []
    for noise in study.noises:
        parts += [f"== {noise_title(noise)} ==", aligned_text(main_table(study, noise))]
        parts += ["means over scenarios with 95 % intervals (Student's t)"]
        for second in (name for name in study.robots if name.startswith("reactive")):
            parts += [f"proactive minus {TITLES[second]}, paired by scenario:"]
            parts += [aligned_text(comparison_table(study, noise, second))]
        if way := way_table(study, noise):
            parts += ["way from the person alone (0) to the oracle (1):", aligned_text(way)]
        parts.append(aligned_text(goal_table(study, noise)))
    return "\n\n".join(parts)


def json_lines(study: Study) -> list[dict[str, Any]]:
    """Return every figure as flat objects; what is undefined is None."""
    lines: list[dict[str, Any]] = []
    for noise in study.noises:
        lines += [
            without_nan(line)
            for robot in study.robots
            for line in _robot_lines(study, noise, robot)
        ]
        lines += [
            without_nan({"kind": "goal", "noise": noise, **goal._asdict()})
            for goal in goals(study, noise)
        ]
    return lines


def _robot_lines(study: Study, noise: float, robot: str) -> list[dict[str, Any]]:
    place = {"noise": noise, "robot": robot}
    lines: list[dict[str, Any]] = []
    for measure in MEASURES + FURTHER:
        found = measured(study, noise, robot, measure.name)
        if found is not None:
            published = dict(zip(("reactive", "proactive"), measure.published, strict=True))
            line = {"kind": "mean", **place, "measure": measure.name, **asdict(found)}
            lines.append({**line, "published": published.get(robot)})
    if robot != "proactive":
        for name, c in comparisons(study, noise, "proactive", robot).items():
            place_of = {"kind": "proactive_minus", **place, "measure": name}
            lines.append({**place_of, **asdict(c)})
    for name, way in ways(study, noise, robot).items():
        lines.append({"kind": "way_to_oracle", **place, "measure": name, **asdict(way)})
    return lines
