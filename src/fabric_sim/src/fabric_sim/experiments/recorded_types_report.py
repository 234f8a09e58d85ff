# SPDX-License-Identifier: BSD-3-Clause
"""The comparison with the recorded types in words: tables as text, HTML and JSON, and figures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from fabric_sim.experiments.recorded_types import (
    ALONE,
    FEW_STEPS,
    LOST_AFTER,
    MEASURES,
    ROBOTS,
    STEP,
    Line,
    TypeResult,
    seconds,
)
from fabric_sim.worker_parameters import STATES
from fabric_study.page import html_table

TITLE = "Recorded types"
NOTES = (
    "Ours: fresh people at the inspection task, averaged over our robots ("
    + ", ".join(ROBOTS)
    + "), with 95 % intervals (jackknife over seeds). Recorded: the original system's simulated "
    "workers, averaged over that system's robots.",
    "Gates: success and both probabilities within .05, time and decisions within 20 % of the "
    "recorded value, or of the nearest end of a recorded range.",
    f"Time runs from the package's arrival to the end of the task; a lost package counts "
    f"{LOST_AFTER:.0f} s.",
    "A recorded decision is one action of the person and the robot's answer, strictly in turns, so "
    "ours are the actions a person begins; somebody who watches the robot at work idled turn by "
    f"turn there, so watching counts one for each {STEP} s, the length of such a turn.",
    "P(warn next | robot interfered) is per turn of that kind: warnings divided by warnings plus "
    f"turns of watching. With fewer than {FEW_STEPS:.0f} such turns it is not judged (rare).",
    "P(success | grasp while evaluating) counts every such grasp, even one the robot interrupts.",
    "No gate: who did it depends on the robots; state occupancy was not recorded.",
)

Table = list[list[str]]


@dataclass(frozen=True)
class RecordedTypes:
    """The whole comparison."""

    types: Sequence[TypeResult]

    @property
    def lines(self) -> list[Line]:
        """Every type and measure."""
        return [line for result in self.types for line in result.lines()]

    @property
    def passed(self) -> bool:
        """Whether every gate that could be judged is met."""
        return all(line.met is not False for line in self.lines)

    def tables(self) -> list[tuple[str, Table]]:
        """Title and cells (header first) of each table."""
        return [
            ("Beside the recorded behaviour", [_HEAD, *map(_cells, self.lines)]),
            ("By robot: success, share done by the robot, s", self._by_robot()),
            ("Share of the time in each state, %", self._occupancy()),
        ]

    def _by_robot(self) -> Table:
        head = ["type", *ROBOTS, "alone"]
        return [head, *([r.recorded.name, *_robots(r)] for r in self.types)]

    def _occupancy(self) -> Table:
        shares = [result.occupancy() for result in self.types]
        seen = [s for s in STATES if any(share[s] >= 0.005 for share in shares)]
        rows = [
            [result.recorded.name, *(f"{100 * share[state]:.0f}" for state in seen)]
            for result, share in zip(self.types, shares, strict=True)
        ]
        return [["type", *(state.replace("_", " ") for state in seen)], *rows]

    def verdict(self) -> str:
        """One sentence: how many gates are met, and which are not."""
        judged = [line for line in self.lines if line.met is not None]
        missed = [f"{line.type}: {line.measure}" for line in judged if not line.met]
        told = f"{len(judged) - len(missed)} of {len(judged)} gates met"
        return f"{told}; not met: {'; '.join(missed)}" if missed else told

    def text(self) -> str:
        """Everything for a terminal."""
        parts = [TITLE, "=" * len(TITLE)]
        for title, table in self.tables():
            parts += ["", title, *_columns(table)]
        return "\n".join([*parts, "", self.verdict(), "", *NOTES]) + "\n"

    def html(self) -> str:
        """Everything for a page, without its heading."""
        parts = [f"<p><b>{self.verdict()}.</b></p>"]
        for title, table in self.tables():
            parts += [f"<h3>{title}</h3>", html_table(table, "wide")]
        return "\n".join([*parts, *(f"<p>{note}</p>" for note in NOTES)])

    def json_rows(self) -> list[dict[str, Any]]:
        """One object for each type and measure, then one for the states of each type."""
        rows = [
            {
                "type": line.type,
                "measure": line.measure,
                "ours": _number(line.ours),
                "half_width_95": _number(line.half),
                "recorded": list(line.recorded),
                "gate": _GATES[line.measure] or None,
                "met": line.met,
            }
            for line in self.lines
        ]
        occupancy = [{"type": r.recorded.name, "occupancy": r.occupancy()} for r in self.types]
        return rows + occupancy

    def figures(self) -> list[tuple[str, str]]:
        """Title and SVG of each figure."""
        from fabric_sim.experiments import recorded_types_figure as figure  # noqa: PLC0415

        return [
            (
                "Ours (green: gate met, red: not, blue: none) on the recorded values (grey)",
                figure.comparison(self.lines),
            ),
            (
                "Share of the time in each state",
                figure.occupancy({r.recorded.name: r.occupancy() for r in self.types}),
            ),
        ]


_HEAD = ["type", "measure", "ours", "+-", "recorded", "gate", "met"]
_GATES = {
    m.name: f"+-{m.within:.2f}" if m.within else f"+-{100 * m.share:.0f} %" if m.share else ""
    for m in MEASURES
}


def _cells(line: Line) -> list[str]:
    least, most = (f"{value:.{line.digits}f}" for value in line.recorded)
    gate = _GATES[line.measure]
    met = {True: "yes", False: "NO", None: "rare" if gate else ""}[line.met]
    return [
        line.type,
        line.measure,
        _digits(line.ours, line.digits),
        _digits(line.half, line.digits),
        least if least == most else f"{least}-{most}",
        gate,
        met,
    ]


def _robots(result: TypeResult) -> list[str]:
    cells = []
    for robot in (*ROBOTS, ALONE):
        tasks = result.tasks([robot])
        n = len(tasks)
        success = sum(task.success for task in tasks) / n
        by_robot = sum(task.success and not task.by_person for task in tasks) / n
        cells.append(f"{success:.2f} {by_robot:.2f} {sum(map(seconds, tasks)) / n:.1f}")
    return cells


def _digits(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else "-"


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _columns(table: Table) -> list[str]:
    widths = [max(len(row[column]) for row in table) for column in range(len(table[0]))]
    return ["  ".join(map(str.ljust, row, widths)).rstrip() for row in table]
