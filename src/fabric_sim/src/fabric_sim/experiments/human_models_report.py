# SPDX-License-Identifier: BSD-3-Clause
"""Tables, JSON and the HTML page of the human-models experiment."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from fabric_sim.experiments import published_likelihoods as published
from fabric_sim.experiments.dial_fit import DIALS
from fabric_sim.experiments.human_models_figures import (
    dials_figure,
    heat_map,
    prediction_figure,
    recovery_figure,
)
from fabric_sim.experiments.likelihood_matrix import NEEDED, TYPES, Matrix, short_name
from fabric_sim.experiments.people_fit import GATED, PREDICTORS, PeopleResult
from fabric_sim.experiments.recovery import Recovery
from fabric_sim.experiments.sorting_people import SortingPeople
from fabric_study.page import html_page, html_table

SHORT = tuple(short_name(name) for name in TYPES)
THESIS = tuple(short_name(name) for name in published.MODELS)
COVERAGE = 0.85  # of the 95 % intervals, at least, so that they can be believed

Lines = list[list[str]]


@dataclass(frozen=True)
class Results:
    """Everything the experiment found; types is that of recorded_types."""

    types: Any
    matrix: Matrix
    people: PeopleResult
    recovery: Recovery
    sorting: SortingPeople

    def gates(self) -> list[tuple[str, bool, str]]:
        """What was to be shown, whether it was, and the figure."""
        beaten = {c.baseline: c for c in self.people.comparisons()}
        found = [
            ("recorded types reproduced", bool(self.types.passed), "see the table"),
            (
                f"diagonal largest in at least {NEEDED} of 16 rows",
                self.matrix.passed,
                f"{self.matrix.on_diagonal} of 16",
            ),
        ]
        for name in GATED:
            gain = beaten.get(name)
            figure = f"{gain.mean:+.2f} ± {gain.half:.2f} nats a task" if gain else "no second task"
            found.append((f"fitted dials predict better than {name}", _is(gain), figure))
        covered = self.recovery.covered.mean()
        title = f"intervals hold at least {COVERAGE:.0%} of known dials"
        return [*found, (title, bool(covered >= COVERAGE), f"{covered:.0%}")]


def _is(comparison: Any) -> bool:
    return comparison is not None and comparison.beaten


# -- tables ---------------------------------------------------------------------------------------


def gate_table(results: Results) -> Lines:
    """Return what was to be shown."""
    lines = [[t, "met" if ok else "NOT met", figure] for t, ok, figure in results.gates()]
    return [["goal", "", "figure"], *lines]


def matrix_table(table: np.ndarray, rows: Sequence[str], columns: Sequence[str]) -> Lines:
    """Return likelihoods with their row and column names; the largest of a row has a star."""
    lines = [["", *columns]]
    for name, row in zip(rows, table, strict=True):
        best = int(row.argmax())
        cells = [f"{v:.3f}" + ("*" if j == best else "") for j, v in enumerate(row)]
        lines.append([name, *cells])
    return lines


def people_types_table(people: PeopleResult) -> Lines:
    """Return how likely each person is under each known type."""
    table = np.stack([person.types.likelihood for person in people.people])
    return matrix_table(table, [person.name for person in people.people], SHORT)


def dials_table(people: PeopleResult) -> Lines:
    """Return the dials of each person with intervals."""
    lines = [["person", "tasks", *DIALS]]
    for person in people.people:
        fit = person.fit
        cells = [
            f"{best:.2f} ({least:.2f}-{most:.2f})"
            for best, least, most in zip(fit.best, fit.least, fit.most, strict=True)
        ]
        lines.append([person.name, str(len(person.types.observations)), *cells])
    return lines


def prediction_table(people: PeopleResult) -> Lines:
    """Return log-likelihoods of held-out tasks, nats per observation, by person and in all."""
    lines = [["person", *PREDICTORS]]
    kept = [person for person in people.people if person.predictions is not None]
    for person in kept:
        mean = person.predictions.sum(axis=0) / person.types.observations.sum()
        lines.append([person.name, *(f"{value:.3f}" for value in mean)])
    if kept:
        mean = people.predictions.sum(axis=0) / people.observations
        lines.append(["all", *(f"{value:.3f}" for value in mean)])
    return lines


def comparison_table(people: PeopleResult) -> Lines:
    """Return the gain of the fitted dials, paired by held-out task."""
    lines = [["fitted dials against", "nats in all", "a task", "95 % interval", "tasks"]]
    for c in people.comparisons():
        interval = f"{c.mean - c.half:+.2f} .. {c.mean + c.half:+.2f}"
        lines.append([c.baseline, f"{c.total:+.1f}", f"{c.mean:+.2f}", interval, str(c.tasks)])
    return lines


def recovery_table(recovery: Recovery) -> Lines:
    """Return how well known dials are found again."""
    lines = [["dial", "error (rms)", "correlation", "covered by the interval", "its width"]]
    covered = recovery.covered.mean(axis=0)
    for d, name in enumerate(DIALS):
        figures = (recovery.error[d], recovery.correlation[d], covered[d], recovery.width[d])
        lines.append([name, *(f"{value:.2f}" for value in figures)])
    return lines


def watching_table(people: PeopleResult) -> Lines:
    """Return the numbers that say how each person was watched."""
    names = ("held", "hidden", "report", "wait", "slip", "stray_event", "carried", "remembered")
    lines = [["person", *names, "confusion"]]
    for person in people.people:
        w = person.watching
        cells = [f"{getattr(w, name):g}" for name in names]
        lines.append([person.name, *cells, f"{w.sensing.confusion:g}"])
    return lines


def columns_text(lines: Lines) -> str:
    """Return a table as text with aligned columns."""
    widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
    rows = []
    for line in lines:
        first, *rest = line
        cells = [cell.rjust(width) for cell, width in zip(rest, widths[1:], strict=True)]
        rows.append("  ".join([first.ljust(widths[0]), *cells]).rstrip())
    return "\n".join(rows)


# -- the three forms ------------------------------------------------------------------------------


def sections(results: Results) -> list[tuple[str, str, Lines]]:
    """Return title, explanation and table of each part after the recorded types."""
    m, people, sorting = results.matrix, results.people, results.sorting
    share = f"{m.tasks} inspection tasks a type, seed {m.seed}"
    return [
        (
            "Beside recorded people when sorting",
            f"{len(sorting.people)} random people, each as in Experiment-1 of the thesis (Fig. "
            f"6.18, 6.20): one task alone, three beside the reactive and three beside the "
            f"proactive robot, seed {sorting.seed}; means over people with 95 % intervals. "
            "Published are means of 14 people; what the robots placed is worked out of them. No "
            "goal: people of the cube are not those of the study.",
            sorting.table(),
        ),
        (
            "What one type did, explained by another",
            f"Likelihood per observation (geometric mean); row: who did it, column: who explains "
            f"it; {share}. B/E beginner/expert, T/R tired/rested, D/A distracted/attentive, "
            f"N/C (non)collaborative. Largest of the row: *",
            matrix_table(m.likelihood, SHORT, SHORT),
        ),
        (
            "The same in the thesis (Fig. 6.29a, as printed)",
            "Eight types, all attentive.",
            matrix_table(np.array(published.SIMULATED), THESIS, THESIS),
        ),
        (
            f"The people of {people.folder} under each type",
            "Likelihood per observation, all tasks of a person.",
            people_types_table(people),
        ),
        (
            "Fourteen people in the thesis (Fig. 6.29b, as printed)",
            "Other people and another observation model: compare the pattern, not the level.",
            matrix_table(np.array(published.PARTICIPANTS), [f"P{n}" for n in range(1, 15)], THESIS),
        ),
        (
            "Their dials",
            "Maximum likelihood over all tasks; in brackets the 95 % interval.",
            dials_table(people),
        ),
        (
            "Prediction of held-out tasks",
            "Each task is predicted from the other tasks of the same person; log-likelihood in "
            "nats per observation, more is better.",
            prediction_table(people),
        ),
        ("Paired by task", "Gain of the fitted dials.", comparison_table(people)),
        (
            "Known dials found again",
            f"{len(results.recovery.fits)} simulated people of random dials, each sorting three "
            "times ten cubes.",
            recovery_table(results.recovery),
        ),
        (
            "How the people were watched",
            "Estimated from the other half of the people; chances, and times in s.",
            watching_table(people),
        ),
    ]


def text_of(results: Results) -> str:
    """Return everything for the terminal."""
    parts = [results.types.text()]
    for title, explanation, table in sections(results):
        parts.append(f"{title}\n{explanation}\n\n{columns_text(table)}")
    parts.append("Goals\n\n" + columns_text(gate_table(results)))
    return "\n\n".join(parts)


def json_rows(results: Results) -> list[dict[str, Any]]:
    """Return one JSON object a figure, the recorded types first."""
    rows = [{"part": "recorded types", **row} for row in results.types.json_rows()]
    rows += [{"part": "sorting", **row} for row in results.sorting.json_rows()]
    m = results.matrix
    for i, name in enumerate(TYPES):
        rows.append(
            {
                "part": "type explained", "type": name,
                "likelihood": _floats(TYPES, m.likelihood[i]),
                "mean_log_likelihood": _floats(TYPES, m.mean_log_likelihood[i]),
                "task_mean": _floats(TYPES, m.task_mean[i]),
            }
        )  # fmt: skip
    rows += [_person_row(person) for person in results.people.people]
    rows += [{"part": "comparison", **asdict(c)} for c in results.people.comparisons()]
    for d, name in enumerate(DIALS):
        r = results.recovery
        figures = {"rms_error": r.error[d], "correlation": r.correlation[d],
                   "coverage": r.covered[:, d].mean(), "width": r.width[d]}  # fmt: skip
        rows.append({"part": "recovery", "dial": name, **_floats(figures, figures.values())})
    gates = [{"part": "goal", "goal": g, "met": ok, "figure": f} for g, ok, f in results.gates()]
    return rows + gates


def _person_row(person: Any) -> dict[str, Any]:
    fit = person.fit
    row = {
        "part": "person",
        "person": person.name,
        "tasks": len(person.types.observations),
        "types": _floats(TYPES, person.types.likelihood),
        "mean_log_likelihood": _floats(TYPES, person.types.mean_log_likelihood),
    }
    for key in ("best", "least", "most", "mean"):
        row[key] = _floats(DIALS, getattr(fit, key))
    if person.predictions is not None:
        total = person.predictions.sum(axis=0)
        row["held_out"] = _floats(PREDICTORS, total / person.types.observations.sum())
    return row


def _floats(names: Iterable[str], values: Iterable[float]) -> dict[str, float]:
    return {name: round(float(value), 6) for name, value in zip(names, values, strict=True)}


INTRODUCTION = """
<p>The simulated workers stand in for people when robots are trained and judged, so it matters
whether they behave like people. A worker is a small model of a person at a conveyor belt: somebody
who thinks, reaches, fails, looks around, tires, takes a break, accepts help or refuses it. Four
<em>dials</em> between 0 and 1 make the character. Sixteen <em>known types</em> sit at the corners,
written with four letters: Beginner or Expert, Tired or Rested, Distracted or Attentive,
Noncollaborative or Collaborative.</p>
<p>A <em>likelihood</em> here is the probability that a model gives to what a camera and the trays
reported of a person, everything before it being known. It is given per observation (the nth root
for n observations), so that long and short tasks compare; 1 would be a perfect prophet.</p>
"""


def html_of(results: Results) -> str:
    """Return the whole report as one page."""
    people = results.people
    figures = {
        "What one type did, explained by another": heat_map(
            results.matrix.likelihood, SHORT, SHORT, "who did it", "who explains it"
        ),
        "The same in the thesis (Fig. 6.29a, as printed)": heat_map(
            np.array(published.SIMULATED), THESIS, THESIS, "who did it", "who explains it"
        ),
        f"The people of {people.folder} under each type": heat_map(
            np.stack([p.types.likelihood for p in people.people]),
            [p.name for p in people.people], SHORT, "", "who explains it",
        ),
        "Their dials": dials_figure(people.people),
        "Known dials found again": recovery_figure(results.recovery),
    }  # fmt: skip
    if len(people.predictions):
        figures["Paired by task"] = prediction_figure(people)
    drawn = ("What one type did", "The same in", "The people of")
    parts = [INTRODUCTION, "<h2>Goals</h2>", html_table(gate_table(results))]
    parts += ["<h2>Recorded types</h2>", results.types.html()]
    for title, explanation, table in sections(results):
        parts += [f"<h2>{html.escape(title)}</h2>", f"<p>{html.escape(explanation)}</p>"]
        parts.append(figures.get(title, ""))
        if not title.startswith(drawn):
            parts.append(html_table(table, "wide"))
    return html_page("Are the simulated people believable?", parts)
