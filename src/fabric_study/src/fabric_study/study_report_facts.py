# SPDX-License-Identifier: BSD-3-Clause
"""The parts of a study's report that say what was done, and how complete it is."""

from collections import Counter
from collections.abc import Sequence

from fabric_study.page import heading
from fabric_study.statistics.descriptive import describe
from fabric_study.statistics.outcome import number_text
from fabric_study.study_analysis import Analysis
from fabric_study.study_data import PERSON_KEYS
from fabric_study.study_figures import shown
from fabric_study.study_journal import VisitCourse
from fabric_study.study_report_parts import Parts


def facts_parts(parts: Parts, analysis: Analysis) -> None:
    """Append protocol, people, orders and exclusions."""
    parts.add(heading("The study"))
    parts.table([["what", "value"], *_facts(analysis)], "What was done.", "words")
    parts.table(_conditions(analysis), "Conditions as planned.", "words")
    parts.table(_orders(analysis), "People by the order in which they met the conditions.", "words")
    parts.table(_demographics(analysis), "People as they describe themselves.", "words")


def _facts(analysis: Analysis) -> list[list[str]]:
    meta, people = analysis.data.meta, analysis.data.people
    status = Counter(str(value) for value in people["status"])
    lines = [["protocol", str(meta["protocol"])]]
    for key, title in (("hash", "hash of protocol and wording"), ("seed", "seed"), ("id", "study")):
        if key in meta:
            lines.append([title, str(meta[key])])
    told = ", ".join(f"{count} {name}" for name, count in sorted(status.items()))
    lines.append(["people", f"{len(people)}: {told}"])
    left = ", ".join(analysis.aborted) or "nobody"
    lines.append(["left out, visit aborted", left])
    lines.append(["people and answers", "SIMULATED" if analysis.simulated else "real"])
    lines.append(["tasks scored", str(len(analysis.data.tasks))])
    versions = meta.get("versions", {})
    lines += [[f"version of {name}", str(value)] for name, value in versions.items()]
    return lines


def _conditions(analysis: Analysis) -> list[list[str]]:
    lines = [["condition", "people call it", "task", "policy", "tasks a person"]]
    for name, condition in (analysis.protocol.conditions if analysis.protocol else {}).items():
        rounds = analysis.protocol.rounds if analysis.protocol else 1
        cells = [condition.shown_as["en"], condition.definition, condition.policy]
        lines.append([shown(name), *cells, str(condition.tasks * rounds)])
    return lines


def _orders(analysis: Analysis) -> list[list[str]]:
    people = analysis.data.people
    kept = people[~people["person"].isin(analysis.aborted)]
    counts = Counter(str(order) for order in kept["order"])
    rows = [[", ".join(map(shown, order.split())), str(n)] for order, n in sorted(counts.items())]
    return [["order", "people"], *rows]


def _demographics(analysis: Analysis) -> list[list[str]]:
    people = analysis.data.people
    lines = [["question", "answer", "people"]]
    for item in (name for name in people.columns if name not in PERSON_KEYS):
        title = str(item).replace("_", " ")
        given = people[item].where(people[item].notna(), "no answer")
        for value, count in sorted(Counter(map(str, given)).items()):
            lines.append([title, value.replace("_", " "), str(count)])
            title = ""
    return lines


def quality_parts(parts: Parts, analysis: Analysis, courses: Sequence[VisitCourse]) -> None:
    """Append what is missing and how long visits took."""
    parts.add(heading("Quality of the data"))
    parts.table(_missing(analysis), "Questions asked and left without an answer.", "words")
    parts.table(_tasks(analysis), "Scored tasks of each person, as planned and as done.", "words")
    lines = [["visits", "shortest", "median", "longest", "paused, all", "tasks tried again"]]
    told = describe([course.duration / 60.0 for course in courses])
    if told.median is not None:
        minutes = [
            number_text(float(v or 0.0), 1) for v in (told.minimum, told.median, told.maximum)
        ]
        paused = number_text(sum(course.paused for course in courses) / 60.0, 1)
        again = str(sum(course.tasks_aborted for course in courses))
        lines.append([str(told.n), *minutes, paused, again])
    parts.table(lines, "Durations in minutes, from the first to the last record of a visit.")


def _missing(analysis: Analysis) -> list[list[str]]:
    lines = [["questionnaire", "asked", "no answer", "people concerned"]]
    for name, rows in analysis.data.answers.groupby("instrument", sort=False):
        missing = rows[rows["value"].isna()]
        codes = ", ".join(sorted(set(missing["person"].astype(str))))
        lines.append([shown(str(name)), str(len(rows)), str(len(missing)), codes])
    return lines


def _tasks(analysis: Analysis) -> list[list[str]]:
    if analysis.protocol is None:
        return [[]]
    planned = sum(c.tasks for c in analysis.protocol.conditions.values()) * analysis.protocol.rounds
    done = Counter(analysis.data.tasks["person"].astype(str))
    short = [f"{name} ({count})" for name, count in sorted(done.items()) if count < planned]
    kept = [name for name in analysis.data.people["person"] if name not in analysis.aborted]
    short += [f"{name} (0)" for name in kept if name not in done]
    complete = len(kept) - len(short)
    head = ["planned", "people with all", "people with fewer (tasks done)"]
    return [head, [str(planned), str(complete), ", ".join(short) or "nobody"]]
