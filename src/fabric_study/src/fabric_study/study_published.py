# SPDX-License-Identifier: BSD-3-Clause
"""Printed values of the thesis beside those of a study, and what becomes of its hypotheses."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fabric_study.shipped import load_path, names_in
from fabric_study.statistics.outcome import (
    ALPHA,
    NoResult,
    Outcome,
    Result,
    number_text,
    p_text,
)
from fabric_study.strict_yaml import Section, read
from fabric_study.study_analysis import Analysis, Studied
from fabric_study.study_figures import shown

KIND = "published"
SUPPORTED, OPPOSITE, OPEN, UNTESTED = "supported", "the opposite", "open", "not tested"
Lines = list[list[str]]


@dataclass(frozen=True)
class PrintedTest:
    """A test as printed. `words`: statistic and p."""

    between: tuple[str, ...]
    words: str


@dataclass(frozen=True)
class Printed:
    """The printed values of one measure or statement. factor: printed = factor x ours."""

    where: str
    means: Mapping[str, float]
    tests: tuple[PrintedTest, ...]
    doubt: str


@dataclass(frozen=True)
class Claim:
    """One prediction: a measure or answer differs, or changes, or a choice prevails."""

    kind: str  # measure, answer or choice
    name: str
    more: str = ""
    less: str = ""
    trend: str = ""  # rises or falls
    mostly: str = ""


@dataclass(frozen=True)
class Hypothesis:
    """A hypothesis of the thesis in our words, what it says of it, and what would show it."""

    name: str
    text: str
    published: str
    claims: tuple[Claim, ...]


@dataclass(frozen=True)
class Publication:
    """What was printed of an experiment; read it with `load_published`."""

    source: str
    people: int
    printed: Mapping[str, Printed]  # by measure or item
    counts: Mapping[str, tuple[str, Mapping[str, int]]]  # by choice: where, counts
    changes: tuple[str, Mapping[int, float], str] | None  # of policies: where, rates, doubt
    hypotheses: tuple[Hypothesis, ...]


def load_published(protocol: str) -> Publication | None:
    """Return what was printed of the experiment of this name, None if nothing was.

    Raises DefinitionError naming file, key and value.
    """
    if protocol not in names_in(KIND):
        return None
    top = read(load_path(KIND, protocol))
    printed = {}
    for kind in ("measures", "answers"):
        section = top.section(kind)
        for name, _ in section.items():
            printed[str(name)] = _printed(section.section(name))
    counts = {}
    choices = top.section("choices")
    for name, _ in choices.items():
        entry = choices.section(name)
        counts[str(name)] = (str(entry.value("where")), dict(entry.section("counts").items()))
        entry.finish()
    publication = Publication(
        source=str(top.value("source")),
        people=top.integer("people", 1, 10000),
        printed=printed,
        counts=counts,
        changes=_changes(top),
        hypotheses=tuple(_hypothesis(part) for part in top.parts("hypotheses")),
    )
    top.finish()
    return publication


def _printed(section: Section) -> Printed:
    section.number("factor", 1.0, 100.0, 1.0)  # the unit shown is the printed one
    means = dict(section.section("means").items()) if section.value("means", None) else {}
    for key, name in (("overall", "overall"), ("last_task", "last task")):
        if section.value(key, None) is not None:
            means[name] = section.number(key, 0.0, 1e6)
    tests = section.parts("tests") if section.value("tests", None) else []
    found = Printed(
        where=str(section.value("where")),
        means={str(name): float(value) for name, value in means.items()},
        tests=tuple(_test(test) for test in tests),
        doubt=str(section.value("doubt", "")),
    )
    section.finish()
    return found


def _test(section: Section) -> PrintedTest:
    words = f"p {section.value('p')}"
    if section.value("F", None) is not None:
        df = ", ".join(map(str, section.value("df")))
        words = f"F({df}) = {section.number('F', 0.0, 1e6):g}, {words}"
    if section.value("effect", None) is not None:
        words += f", {section.value('effect')}"
    test = PrintedTest(tuple(map(str, section.value("between"))), words)
    section.finish()
    return test


def _changes(top: Section) -> tuple[str, Mapping[int, float], str] | None:
    if top.value("policy_changes", None) is None:
        return None
    section = top.section("policy_changes")
    found = (str(section.value("where")), dict(section.section("rates").items()))
    doubt = str(section.value("doubt", ""))
    section.finish()
    return (*found, doubt)


def _hypothesis(section: Section) -> Hypothesis:
    found = Hypothesis(
        name=str(section.value("name")),
        text=str(section.value("text")),
        published=str(section.value("published")),
        claims=tuple(_claim(part) for part in section.parts("claims")),
    )
    section.finish()
    return found


def _claim(section: Section) -> Claim:
    content = {str(key): str(value) for key, value in section.items()}
    kinds = [key for key in ("measure", "answer", "choice") if key in content]
    rest = sorted(set(content) - {*kinds})
    if len(kinds) != 1 or rest not in (["less", "more"], ["trend"], ["mostly"]):
        raise section.error("", "must name a measure, answer or choice, and what is claimed of it")
    name = content.pop(kinds[0])
    if content.get("trend", "rises") not in ("rises", "falls"):
        raise section.error("trend", f"is {content['trend']!r}; allowed are rises, falls")
    return Claim(kinds[0], name, **content)


def studied_of(analysis: Analysis, name: str) -> Studied | None:
    """Return a measure, statement or scale of a study by name."""
    for group in (analysis.measures, analysis.answers, analysis.task_load):
        if name in group:
            return group[name]
    return None


def beside_lines(analysis: Analysis, publication: Publication) -> Lines:
    """Return the printed means and tests beside ours; a dagger marks what is doubtful in print."""
    head = ["measure", "conditions", "ours", "printed", "ours, default test", "printed test"]
    lines = [[*head, "where"]]
    for name, printed in publication.printed.items():
        item = studied_of(analysis, name)
        title = _title(item, name) + (" †" if printed.doubt else "")
        where = printed.where
        for cells in _beside(item, printed):
            lines.append([title, *cells, where])
            title = where = ""
    return lines


def doubts(analysis: Analysis, publication: Publication) -> list[str]:
    """Return a line on each printed value that is doubtful."""
    return [
        f"† {_title(studied_of(analysis, name), name)}: {printed.doubt}"
        for name, printed in publication.printed.items()
        if printed.doubt
    ]


def _title(item: Studied | None, name: str) -> str:
    return item.measure.label if item else name.replace("_", " ")


def _beside(item: Studied | None, printed: Printed) -> Iterator[list[str]]:
    digits = max(item.measure.digits, 1) if item else 2
    for name, mean in printed.means.items():
        yield [shown(name), _ours(item, name), number_text(mean, digits), "", ""]
    for test in printed.tests:
        names = " – ".join(map(shown, test.between))
        yield [names, "", "", _our_test(item, test.between), test.words]
    if not printed.means and not printed.tests:
        yield [""] * 5


def _ours(item: Studied | None, condition: str) -> str:
    if item is None:
        return "–"
    rows = item.rows
    if condition == "last task":
        last = rows.loc[rows["number"] == rows["number"].max(), "value"]
        return number_text(float(last.mean()), item.measure.digits)
    told = item.comparison.descriptions.get(condition)
    if told is None or told.mean is None:
        return "–"
    return number_text(told.mean, item.measure.digits)


def _our_test(item: Studied | None, between: Sequence[str]) -> str:
    if item is None:
        return "–"
    if len(between) > 2:
        outcome = item.comparison.omnibus
    else:
        outcome = next(
            (
                pair.outcome
                for pair in item.comparison.pairs
                if {pair.first, pair.second} == set(between)
            ),
            None,
        )
    if outcome is None:
        return "–"
    return outcome.reason if isinstance(outcome, NoResult) else p_text(outcome.p)


def verdict_lines(analysis: Analysis, publication: Publication) -> Lines:
    """Return a line for each hypothesis: what the thesis says, what this study says."""
    lines = [["hypothesis", "in our words", "thesis", "this study"]]
    for hypothesis in publication.hypotheses:
        verdicts = [judge(analysis, claim)[0] for claim in hypothesis.claims]
        told = f"{verdicts.count(SUPPORTED)} of {len(verdicts)} predictions supported"
        if OPPOSITE in verdicts:
            told += f", {verdicts.count(OPPOSITE)} opposite"
        lines.append([hypothesis.name, hypothesis.text, hypothesis.published, told])
    return lines


def claim_lines(analysis: Analysis, publication: Publication) -> Lines:
    """Return every prediction with our verdict; Holm within a measure."""
    lines = [["hypothesis", "prediction", "this study", "verdict"]]
    for hypothesis in publication.hypotheses:
        title = hypothesis.name
        for claim in hypothesis.claims:
            verdict, words = judge(analysis, claim)
            lines.append([title, _predicted(analysis, claim), words, verdict])
            title = ""
    return lines


def judge(analysis: Analysis, claim: Claim) -> tuple[str, str]:
    """Return the verdict on a claim by the default test at 5 %, and the numbers behind it."""
    if claim.kind == "choice":
        return _judge_choice(analysis, claim)
    item = studied_of(analysis, claim.name)
    if item is None:
        return UNTESTED, "not asked or measured"
    if claim.trend:
        return _judge_outcome(item.learning, "slope", 1.0 if claim.trend == "rises" else -1.0)
    for pair in item.comparison.pairs:
        if {pair.first, pair.second} == {claim.more, claim.less}:
            sign = 1.0 if pair.first == claim.more else -1.0
            return _judge_outcome(pair.outcome, "difference", sign, pair.p_holm)
    return UNTESTED, "the study has not both conditions"


def _judge_outcome(
    outcome: Outcome | None, effect: str, sign: float, p_holm: float | None = None
) -> tuple[str, str]:
    if not isinstance(outcome, Result):
        return UNTESTED, outcome.reason if outcome else "asked once only"
    value = sign * next(e.value for e in outcome.effects if e.name == effect)
    p = outcome.p if p_holm is None else p_holm
    words = f"{'as' if value > 0 else 'not as'} predicted, {p_text(p)}"
    if p >= ALPHA:
        return OPEN, words
    return (SUPPORTED if value > 0.0 else OPPOSITE), words


def _judge_choice(analysis: Analysis, claim: Claim) -> tuple[str, str]:
    choice = analysis.choices.get(claim.name)
    if choice is None or choice.p is None or claim.mostly not in choice.counts:
        return UNTESTED, "not asked, or not between two"
    count, total = choice.counts[claim.mostly], sum(choice.counts.values())
    words = f"{count} of {total}, {p_text(choice.p)}"
    if choice.p >= ALPHA:
        return OPEN, words
    return (SUPPORTED if 2 * count > total else OPPOSITE), words


def _predicted(analysis: Analysis, claim: Claim) -> str:
    if claim.kind == "choice":
        return f"{claim.name.replace('_', ' ')}: mostly {shown(claim.mostly)}"
    item: Any = studied_of(analysis, claim.name)
    title = item.measure.title if item else claim.name.replace("_", " ")
    if claim.trend:
        return f"{title}: {claim.trend} over the tasks"
    return f"{title}: {shown(claim.more)} > {shown(claim.less)}"
