# SPDX-License-Identifier: BSD-3-Clause
"""What a rehearsal prints at its end: the simulated means beside the published ones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import pandas as pd

from fabric_sim.rehearsal.power import Measured, measures_of
from fabric_study.shipped import config_folder, names_in
from fabric_study.statistics.layout import person_means, rows_of
from fabric_study.strict_yaml import read
from fabric_study.study_data import StudyData
from fabric_study.study_measures import MEASURES, conditions_of

FOLDER = "published"


def beside_published(study: StudyData) -> list[list[str]]:
    """Return a table, header first: what was published of the protocol beside the means of people,
    or all means where nothing was."""
    published = published_means(str(study.meta["protocol"]))
    conditions = conditions_of(study)
    head = ["simulated people"]
    for name in conditions:
        head += [name, "published"] if published else [name]
    lines = [head]
    for measured in measures_of(study):
        known = published.get(measured.name, {})
        if known or not published:
            lines.append(_line(measured, conditions, known, bool(published)))
    return lines


def published_means(protocol: str) -> dict[str, dict[str, float]]:
    """Return the printed means of a protocol, empty when nothing of it was published."""
    if protocol not in names_in(FOLDER):
        return {}
    top = read(config_folder(FOLDER) / f"{protocol}.yaml")
    found = {}
    for kind in ("measures", "answers"):
        for name, entry in top.section(kind).items():
            if "means" in entry:
                found[str(name)] = dict(entry["means"])
    return found


def _line(
    measured: Measured, conditions: tuple[str, ...], known: Mapping[str, float], beside: bool
) -> list[str]:
    shown = {m.column: (m.title, m.factor, m.digits) for m in MEASURES}
    title, factor, digits = shown.get(measured.name, (measured.name.replace("_", " "), 1.0, 2))
    means = _means(measured.rows, conditions) * factor
    line = [title]
    for name in conditions:
        line.append("-" if pd.isna(means[name]) else f"{means[name]:.{digits}f}")
        if beside:
            line.append(f"{known[name]:.{digits}f}" if name in known else "-")
    return line


def _means(rows: pd.DataFrame, conditions: tuple[str, ...]) -> pd.Series:
    """Mean over people of the mean of each, by condition; NaN where nobody has a value."""
    return person_means(rows_of(rows, "value", conditions), conditions).mean()


def aligned(lines: Sequence[Sequence[str]]) -> Iterator[str]:
    """Yield the lines of a table as text, a rule below the header."""
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    for number, line in enumerate(lines):
        cells = [cell.rjust(width) for cell, width in zip(line[1:], widths[1:], strict=True)]
        yield "  ".join([line[0].ljust(widths[0]), *cells]).rstrip()
        if number == 0:
            yield "-" * (sum(widths) + 2 * (len(widths) - 1))
