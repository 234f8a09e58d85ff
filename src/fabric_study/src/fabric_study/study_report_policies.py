# SPDX-License-Identifier: BSD-3-Clause
"""The part of a study's report on ABPS: which policy was chosen before which task (Fig. 6.24)."""

import pandas as pd

from fabric_study.page import heading, paragraph
from fabric_study.results import mean_interval
from fabric_study.study_analysis import Analysis
from fabric_study.study_figures import changes_svg
from fabric_study.study_published import Publication
from fabric_study.study_report_parts import Parts

ADAPTIVE = "abps"


def change_rates(tasks: pd.DataFrame) -> dict[int, float]:
    """Return the share of people who met another policy than before, by task from the second.

    A task counts for people who did it and the one before.
    """
    models = tasks.pivot_table(index="person", columns="number", values="model", aggfunc="first")
    rates = {}
    for number in models.columns:
        if number - 1 in models.columns:
            both = models[[number - 1, number]].dropna()
            if len(both):
                rates[int(number)] = float((both[number - 1] != both[number]).mean())
    return rates


def policy_parts(parts: Parts, analysis: Analysis, publication: Publication | None) -> None:
    """Append how policies changed, when ABPS chose them."""
    tasks = analysis.data.tasks
    tasks = tasks[tasks["policy"] == ADAPTIVE]
    if tasks.empty:
        return
    people = int(tasks["person"].nunique())
    entropies = tasks[tasks["type_belief_entropy"].notna()]
    entropy = {
        int(number): mean_interval(rows["type_belief_entropy"].astype(float).tolist())
        for number, rows in entropies.groupby("number")
    }
    rates = change_rates(tasks)
    parts.add(heading("Policies chosen by ABPS"))
    svg = changes_svg(rates, entropy, people, analysis.simulated)
    caption = "Left: share of people before whose task another policy was chosen. "
    caption += f"Right: what ABPS does not know of the person's type. n = {people} people."
    parts.figure(svg, caption)
    parts.table(_models(tasks), "Policy in force in each task, by person.", "wide words")
    if publication and publication.changes:
        where, printed, doubt = publication.changes
        lines = [["before task", "people here", "people in print"]]
        for number, rate in printed.items():
            ours = f"{rates[number]:.0%}" if number in rates else "–"
            lines.append([str(number), ours, f"{float(rate):.0%}"])
        parts.table(lines, f"Policy changes beside the printed ones ({where}).")
        parts.add(paragraph(f"Doubtful in print: {doubt}.", "note"))


def _models(tasks: pd.DataFrame) -> list[list[str]]:
    models = tasks.pivot_table(index="person", columns="number", values="model", aggfunc="first")
    head = ["person", *(f"task {number}" for number in models.columns)]
    rows = [
        [str(person), *("–" if pd.isna(model) else str(model) for model in row)]
        for person, row in zip(models.index, models.to_numpy(), strict=True)
    ]
    return [head, *rows]
