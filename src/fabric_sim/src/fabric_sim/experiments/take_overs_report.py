# SPDX-License-Identifier: BSD-3-Clause
"""The comparison of take-overs as tables, ROC curves, JSON and a page."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from fabric_sim.experiments.human_models_report import columns_text
from fabric_sim.experiments.paired import Interval
from fabric_sim.experiments.shell import without_nan
from fabric_sim.experiments.take_overs_belief import Habits
from fabric_sim.experiments.take_overs_compare import (
    IDLE,
    NEEDS_HELP,
    OURS,
    STATE,
    TAKES_OVER,
    TOGETHER,
    TYPE,
    WARNINGS_PERSON,
    WARNINGS_TASK,
    Line,
    Part,
    Table,
    kept,
    rules,
)
from fabric_sim.experiments.take_overs_read import Folder
from fabric_sim.experiments.take_overs_score import roc
from fabric_study.figure import STYLE, plt, svg_of
from fabric_study.page import html_page, html_table

Lines = list[list[str]]
DRAWN = (TOGETHER, STATE, TYPE, NEEDS_HELP, WARNINGS_TASK, WARNINGS_PERSON, IDLE)
PUBLISHED = (
    "Published, 12 people, 294 take-overs of the reactive robot: belief in needs_help .545, "
    "counting earlier warnings .586."
)
EXPLANATION = (
    "Area under the ROC curve of telling accepted take-overs (no warning before the next "
    "placement) from warned ones by what was known when the robot took over; .5 is chance. "
    "Intervals: 95 %, bootstrap over people, then over the tasks of each. Within: over pairs of "
    "take-overs of the same person. Without: least and most when one person is left out. A base "
    "rate that leaves out the person it is applied to lies below .5 by construction."
)
INTERVALS_OF_FEW = (
    "Fewer than five people: intervals that resample people say little about other people."
)


@dataclass(frozen=True)
class Result:
    """All that the report tells."""

    folder: Folder
    habits: Habits
    same_model: bool  # the habits were learnt with the sorting model in use
    table: Table
    parts: tuple[Part, ...]
    seed: int


def number(value: float) -> str:
    """As .683, a dash for NaN."""
    if math.isnan(value):
        return "-"
    text = f"{abs(value):.3f}"
    text = text[1:] if text.startswith("0") else text
    return f"-{text}" if value < 0.0 and float(text) else text


def spread(interval: Interval) -> str:
    """The interval as [low, high]."""
    return f"[{number(interval.low)}, {number(interval.high)}]"


def area_table(part: Part) -> Lines:
    """One score a row."""
    head = ["score", "AUC", "95 %", "within", "without", *(f"minus {r}" for r in _rivals(part))]
    return [head, *(_area_row(line) for line in part.lines)]


def _rivals(part: Part) -> list[str]:
    return list(part.lines[0].gains)


def _area_row(line: Line) -> list[str]:
    areas = [area for area in line.without.values() if math.isfinite(area)]
    without = f"{number(min(areas))}-{number(max(areas))}" if areas else "-"
    gains = [f"{number(gain.value)} {spread(gain)}" for gain in line.gains.values()]
    return [
        line.name, number(line.area.value), spread(line.area), number(line.within), without, *gains
    ]  # fmt: skip


def person_table(result: Result, part: Part) -> Lines:
    """Who gave how many answers, and what was expected."""
    lines = [["person", "take-overs", "accepted", "mean P(accept)"]]
    together = result.table.scores[TOGETHER]
    for person in sorted({result.table.take_overs[i].person for i in part.rows}):
        own = [i for i in part.rows if result.table.take_overs[i].person == person]
        accepted = sum(result.table.take_overs[i].accepted for i in own)
        lines.append([person, str(len(own)), str(accepted), number(float(together[own].mean()))])
    return lines


def rule_table(result: Result, part: Part) -> Lines:
    """How many warned take-overs a rule avoids, how many accepted ones it keeps."""
    lines = [["rule", "warned, avoided", "accepted, kept"]]
    for name, decides in rules(result.table).items():
        found = kept(result.table, part.rows, decides)
        lines.append(
            [name, f"{found.avoided} of {found.warned}", f"{found.kept} of {found.accepted}"]
        )
    return lines


def take_over_table(result: Result, rows: Sequence[int], accepted: bool) -> Lines:
    """The warned, or the accepted, take-overs one a row, with what we would have done."""
    lines = [
        ["person", "task", "robot", "subtask", "time, s", "P(accept)", "by state", "by type",
         "policy does", "ours", "then placed"]
    ]  # fmt: skip
    table = result.table
    for i in rows:
        t = table.take_overs[i]
        if t.accepted != accepted:
            continue
        takes = table.scores[TOGETHER][i] >= TAKES_OVER
        verdict = ("kept" if takes else "lost") if accepted else ("made" if takes else "avoided")
        chances = [number(float(table.scores[name][i])) for name in (TOGETHER, STATE, TYPE)]
        lines.append(
            [t.person, str(t.task), t.robot, str(t.subtask), f"{t.time:.1f}", *chances,
             table.actions[i], verdict, t.ended_by]
        )  # fmt: skip
    return lines


def title_of(part: Part) -> str:
    """Which take-overs a part is about."""
    robot = "all robots" if part.robot == "all" else f"the {part.robot} robot"
    return f"{part.counted}, {robot}: {part.n} take-overs, {part.accepted} accepted"


def notes(result: Result) -> list[str]:
    """What a reader must know."""
    people, said = result.folder.people, []
    count = sum(len(tasks) for tasks in people.values())
    said.append(
        f"{count} recordings of {len(people)} people. All numbers of our belief were learnt from "
        f"{result.habits.people} simulated people, none from recordings."
    )
    if result.folder.nameless:
        said.append(
            "No person in the name, so taken for a person each (personNN_taskK_robot is expected): "
            + ", ".join(result.folder.nameless)
        )
    if not result.same_model:
        said.append("The sorting model is not the one that the numbers were learnt with.")
    if len(people) < 5:
        said.append(INTERVALS_OF_FEW)
    return [*said, PUBLISHED]


def text_of(result: Result) -> str:
    """Everything but the list of take-overs, for the terminal."""
    parts = ["\n".join(notes(result)), EXPLANATION]
    for part in result.parts:
        tables = (area_table(part), rule_table(result, part))
        parts += [title_of(part), *(columns_text(lines) for lines in tables)]
    return "\n\n".join(parts)


def json_of(result: Result) -> dict[str, Any]:
    """Everything, NaN as null."""
    table = result.table
    take_overs = [
        {
            "person": t.person, "task": t.task, "robot": t.robot, "time_s": round(t.time, 3),
            "subtask": t.subtask, "first_of_subtask": t.first, "begun": t.begun,
            "accepted": t.accepted, "ended_by": t.ended_by, "policy_does": table.actions[i],
            "avoided": bool(table.scores[TOGETHER][i] < TAKES_OVER),
            "scores": {name: float(values[i]) for name, values in table.scores.items()},
        }
        for i, t in enumerate(table.take_overs)
    ]  # fmt: skip
    content = {
        "folder": result.folder.path.name,
        "notes": notes(result),
        "seed": result.seed,
        "comparisons": [_json_part(result, part) for part in result.parts],
        "take_overs": take_overs,
    }
    return without_nan(content)


def _json_part(result: Result, part: Part) -> dict[str, Any]:
    found = {name: kept(result.table, part.rows, d) for name, d in rules(result.table).items()}
    return {
        "counted": part.counted, "robot": part.robot, "n": part.n, "accepted": part.accepted,
        "scores": [{**asdict(line), "ours": line.name in OURS} for line in part.lines],
        "rules": {name: asdict(value) for name, value in found.items()},
    }  # fmt: skip


def roc_svg(result: Result) -> str:
    """ROC curves: a panel for each part."""
    columns = max(1, min(3, len(result.parts)))
    rows = max(1, math.ceil(len(result.parts) / columns))
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(
            rows, columns, figsize=(4.2 * columns, 4.3 * rows), layout="constrained", squeeze=False
        )
        for panel in axes.flat[len(result.parts) :]:
            panel.set_axis_off()
        for panel, part in zip(axes.flat, result.parts, strict=False):
            _draw(panel, result, part)
        return svg_of(figure)


def _draw(panel: plt.Axes, result: Result, part: Part) -> None:
    table, rows = result.table, list(part.rows)
    accepted = [table.take_overs[i].accepted for i in rows]
    panel.plot([0, 1], [0, 1], color="0.8", lw=1)
    panel.set_title(f"{part.counted}\n{part.robot}, n = {part.n}", fontsize=9)
    panel.set_xlabel("warned, taken for accepted")
    panel.set_ylabel("accepted, found")
    panel.set_aspect("equal")
    if not 0 < part.accepted < part.n:
        return
    areas = {line.name: line.area.value for line in part.lines}
    for number_of, name in enumerate(DRAWN):
        alarms, hits = roc(table.scores[name][rows], accepted)
        style = {"lw": 2.2} if name in OURS else {"lw": 1.1, "ls": "--"}
        label = f"{name} {number(areas[name])}"
        panel.plot(alarms, hits, color=f"C{number_of}", label=label, **style)
    panel.legend(frameon=False, fontsize=6.5, loc="lower right")


def html_of(result: Result) -> str:
    """The report as one page."""
    body = [f"<p>{html.escape(note)}</p>" for note in notes(result)]
    body += [f"<p>{html.escape(EXPLANATION)}</p>", roc_svg(result)]
    for part in result.parts:
        body += [f"<h2>{html.escape(title_of(part))}</h2>", html_table(area_table(part), "wide")]
        body += [html_table(rule_table(result, part)), html_table(person_table(result, part))]
    everything = range(len(result.table.take_overs))
    body.append("<h2>Warned take-overs: which would have been avoided</h2>")
    body.append(html_table(take_over_table(result, everything, accepted=False), "wide"))
    body.append("<h2>Accepted take-overs: which would have been kept</h2>")
    body.append(html_table(take_over_table(result, everything, accepted=True), "wide"))
    return html_page("Were the take-overs anticipated?", body)
