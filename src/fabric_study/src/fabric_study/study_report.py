# SPDX-License-Identifier: BSD-3-Clause
"""The report of a study folder: one HTML file that stands by itself, and a PDF of it.

./fabric report DIR comes here when DIR holds a study. Nothing is kept from one report to the next:
every table and figure is made anew from the store.
"""

from collections.abc import Iterable, Sequence
from pathlib import Path

from fabric_study.page import bullets, heading, html_page, paragraph
from fabric_study.pdf import write_pdf
from fabric_study.statistics.outcome import number_text
from fabric_study.statistics.reliability import cronbach_alpha
from fabric_study.store import Record, read_records
from fabric_study.study_analysis import Analysis, Studied, analyse
from fabric_study.study_data import load_study
from fabric_study.study_figures import boxes_svg, courses_svg, shown, statements_svg
from fabric_study.study_journal import courses, notes
from fabric_study.study_measures import KNOWN_WITH_THE_TRUTH, conditions_with
from fabric_study.study_published import (
    Publication,
    beside_lines,
    claim_lines,
    doubts,
    load_published,
    verdict_lines,
)
from fabric_study.study_report_facts import facts_parts, quality_parts
from fabric_study.study_report_parts import Parts
from fabric_study.study_report_policies import policy_parts
from fabric_study.study_report_power import observed_power_parts, power_parts
from fabric_study.study_tables import (
    choice_lines,
    description_lines,
    learning_lines,
    left_out,
    omnibus_lines,
    pair_lines,
    published_way_lines,
)

HTML_FILE, PDF_FILE = "report.html", "report.pdf"
BANNER = "SIMULATED people and answers. Nothing here says anything about real people."
DEFAULT = (
    "Default tests take one value a person and condition, the mean of the person's rows. Measures "
    "and scales: paired t test (two conditions), repeated-measures ANOVA with Greenhouse-Geisser "
    "correction (three and more). Single Likert items: Wilcoxon's signed-rank test (exact, Pratt), "
    "Friedman's test. Pairs are corrected by Holm within a measure, not across measures."
)
BOXES = (
    "Boxes: quartiles and median of the means of people; whiskers: to 1.5 times the quartile "
    "range; points: people; grey lines join the values of one person."
)
COURSES = (
    "Points: means of people with their 95 % intervals; lines: moving average of the last three."
)
EFFECTS = (
    "Differences with 95 % interval (Student's t). dz: mean over standard deviation of the "
    "differences; r: matched-pairs rank-biserial correlation; intervals: noncentral t, bootstrap."
)
OMNIBUS = (
    "η²G: generalized eta squared; W: Kendall's; 95 % intervals by bootstrap over people; ε: "
    "Greenhouse-Geisser. The mixed model uses all rows, also of people who miss a condition."
)
AS_PUBLISHED = (
    "AS PUBLISHED: these tests treat rows as independent, although every person gives several. "
    "They are here for comparison with the printed ones only (docs/statistics.md says how wrong "
    "they are). Rows are tasks where both conditions have equally many, else means of people."
)
LEARNING = (
    "Change from task to task in a mixed model: condition fixed, level and slope of each person "
    "random, people - 1 degrees of freedom."
)
VERDICTS = (
    "supported: p < .05 in the predicted direction, by the default test, Holm within a measure; "
    "the opposite: p < .05 in the other one; open: neither. Predictions are not corrected for "
    "their number."
)


def study_html(analysis: Analysis, records: Sequence[Record], folder: Path | None = None) -> str:
    """Return the page of a study. folder: where a rehearsal's power.csv may lie."""
    publication = load_published(str(analysis.data.meta["protocol"]))
    parts = Parts(analysis.simulated)
    if analysis.simulated:
        parts.add(paragraph(BANNER, "banner"))
    if publication:
        _hypotheses(parts, analysis, publication)
    facts_parts(parts, analysis)
    _measures(parts, analysis)
    _statements(parts, analysis)
    _task_load(parts, analysis)
    _choices(parts, analysis, publication)
    policy_parts(parts, analysis, publication)
    if publication:
        _beside(parts, analysis, publication)
    rehearsed = power_parts(folder) if folder else []
    parts.add(*(rehearsed or observed_power_parts(analysis.power, analysis.simulated)))
    _words(parts, analysis, notes(records))
    quality_parts(parts, analysis, courses(records))
    return html_page(_title(analysis), parts.parts)


def _title(analysis: Analysis) -> str:
    name = str(analysis.data.meta["protocol"])
    about = f": {analysis.protocol.title['en']}" if analysis.protocol else ""
    return f"{name}{about}{' (simulated)' if analysis.simulated else ''}"


def _people(analysis: Analysis) -> int:
    return int(analysis.data.tasks["person"].nunique())


def _hypotheses(parts: Parts, analysis: Analysis, publication: Publication) -> None:
    parts.add(heading("Hypotheses"))
    caption = f"What the thesis predicted and what {_people(analysis)} people here show. {VERDICTS}"
    parts.table(verdict_lines(analysis, publication), caption, "words")
    caption = "The predictions, p of the default test (Holm within a measure)."
    parts.table(claim_lines(analysis, publication), caption, "words")


def _measures(parts: Parts, analysis: Analysis) -> None:
    items = list(analysis.measures.values())
    if not items:
        return
    n = f"n = {_people(analysis)} people"
    parts.add(heading("Objective measures"), paragraph(DEFAULT, "note"))
    parts.table(description_lines(items, "tasks"), f"Means of people in each condition, {n}.")
    truth = _known_with_the_truth(analysis)
    parts.figure(boxes_svg(items, analysis.conditions, analysis.simulated), f"{BOXES} {n}.")
    if any(item.rows["in_condition"].max() > 1 for item in items):
        svg = courses_svg(items, analysis.conditions, analysis.simulated)
        parts.figure(svg, f"The course over tasks. {COURSES} {n}.")
    _tests(parts, items)
    parts.table(learning_lines(items), LEARNING)
    parts.table(truth, "Known in simulation only: means over tasks.")


def _tests(parts: Parts, items: Sequence[Studied]) -> None:
    parts.table(omnibus_lines(items), f"All conditions at once. {OMNIBUS}")
    parts.table(pair_lines(items), f"Pairs of conditions, first minus second. {EFFECTS}")
    parts.table(published_way_lines(items), AS_PUBLISHED)
    if lines := left_out(items):
        parts.add(bullets(lines))


def _known_with_the_truth(analysis: Analysis) -> list[list[str]]:
    lines = [["measure", "condition", "tasks", "mean"]]
    tasks = analysis.data.tasks
    for measure in KNOWN_WITH_THE_TRUTH if analysis.simulated else ():
        for name in conditions_with(measure, tasks, analysis.conditions):
            values = tasks.loc[tasks["condition"] == name, measure.column].dropna()
            mean = number_text(float(values.mean()) * measure.factor, measure.digits)
            lines.append([measure.label, shown(name), str(len(values)), mean])
    return lines


def _statements(parts: Parts, analysis: Analysis) -> None:
    groups: dict[str, list[Studied]] = {}
    for item in analysis.answers.values():
        groups.setdefault(item.category, []).append(item)
    if not groups:
        return
    everything = [item for group in groups.values() for item in group]
    parts.add(heading("Statements, 1 strongly disagree to 5 strongly agree"))
    for category, items in groups.items():
        title = category.replace("_", " ")
        parts.add(heading(title[:1].upper() + title[1:], 3))
        caption = (
            f"Answers to the statements on {title}; n counts answers. {_alpha(items, analysis)}"
        )
        parts.figure(statements_svg(items, analysis.simulated), caption)
    parts.add(heading("Tests of statements", 3))
    parts.table(description_lines(everything, "answers"), "Means of people; answers 1 to 5.")
    _tests(parts, everything)
    parts.table(learning_lines(everything), LEARNING)


def _alpha(items: Sequence[Studied], analysis: Analysis) -> str:
    """Return Cronbach's alpha of statements, those of opposite sense turned round."""
    if len(items) < 2:
        return ""
    columns = []
    for item in items:
        values = item.rows.groupby("person")["value"].mean()
        columns.append(6.0 - values if _reversed(analysis, item.measure.title) else values)
    people = sorted(set.union(*(set(column.index) for column in columns)))
    alpha = cronbach_alpha(
        [[column.get(name, float("nan")) for column in columns] for name in people]
    )
    told = number_text(alpha) if isinstance(alpha, float) else alpha.reason
    return f"Cronbach's alpha over the means of {len(people)} people: {told}."


def _reversed(analysis: Analysis, title: str) -> bool:
    instruments = analysis.protocol.instruments.values() if analysis.protocol else ()
    return any(
        item.reverse
        for instrument in instruments
        for item in instrument.items
        if item.id.replace("_", " ") == title
    )


def _task_load(parts: Parts, analysis: Analysis) -> None:
    items = list(analysis.task_load.values())
    if not items:
        return
    parts.add(heading("Task load, NASA-TLX 0 to 100"))
    parts.add(paragraph("Performance: 0 is perfect, 100 is failure, as in the original.", "note"))
    caption = f"{BOXES} n = {_people(analysis)} people."
    parts.figure(boxes_svg(items, analysis.conditions, analysis.simulated), caption)
    parts.table(description_lines(items, "answers"), "Means of people in each condition.")
    _tests(parts, items)
    parts.table(learning_lines(items), LEARNING)


def _choices(parts: Parts, analysis: Analysis, publication: Publication | None) -> None:
    if not analysis.choices:
        return
    lines = choice_lines(analysis.choices.values())
    parts.add(heading("Choices"))
    parts.table(
        lines, "Answers to questions with a choice; the test is against an even choice.", "words"
    )
    counts = publication.counts if publication else {}
    printed = [["question", "printed", "where"]]
    for item, (where, told) in counts.items():
        words = ", ".join(f"{shown(name)} {count}" for name, count in told.items())
        text = analysis.choices[item].text if item in analysis.choices else item.replace("_", " ")
        printed.append([text, words, where])
    parts.table(
        printed, f"The same in print ({publication.source})." if publication else "", "words"
    )


def _beside(parts: Parts, analysis: Analysis, publication: Publication) -> None:
    ours = f"{_people(analysis)} {'simulated ' if analysis.simulated else ''}people"
    parts.add(heading("Beside the printed values"))
    caption = (
        f"Ours: {ours}, means of people. Printed: {publication.people} people, "
        f"{publication.source}; its tests treat rows as independent."
    )
    parts.table(beside_lines(analysis, publication), caption)
    parts.add(*(paragraph(line, "note") for line in doubts(analysis, publication)))


def _words(parts: Parts, analysis: Analysis, written: Iterable[tuple[str, str, str]]) -> None:
    answers = analysis.data.answers
    free = answers[(answers["kind"] == "text") & answers["value"].notna()]
    lines = [["question", "person", "answer"]]
    for item, rows in free.groupby("item", sort=False):
        title = str(item).replace("_", " ")
        for _, row in rows.iterrows():
            if str(row["value"]).strip():
                lines.append([title, str(row["person"]), str(row["value"])])
                title = ""
    notes_lines = [["time (UTC)", "visit", "note"], *(list(note) for note in written)]
    if len(lines) > 1 or len(notes_lines) > 1:
        parts.add(heading("In their own words"))
    parts.table(lines, "Free answers.", "words")
    parts.table(notes_lines, "Notes of the experimenter.", "words")


def write_study_report(folder: Path) -> tuple[Path, str]:
    """Write report.html and report.pdf into a study folder; return the page, and why no PDF is.

    Raises ValueError (StoreError, DefinitionError) naming the place of what is damaged.
    """
    analysis = analyse(load_study(folder))
    page = folder / HTML_FILE
    text = study_html(analysis, read_records(folder), folder)
    page.write_text(text, encoding="utf-8")
    return page, write_pdf(page, folder / PDF_FILE)
