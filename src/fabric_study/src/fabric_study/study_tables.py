# SPDX-License-Identifier: BSD-3-Clause
"""The tables of a study's report: lines of cells, header first."""

from collections.abc import Iterable, Iterator, Sequence

from fabric_study.statistics.compare import Pair
from fabric_study.statistics.outcome import (
    Effect,
    NoResult,
    Outcome,
    Result,
    effect_text,
    number_text,
    p_text,
    statistic_text,
)
from fabric_study.study_analysis import Choice, Studied
from fabric_study.study_figures import shown

Lines = list[list[str]]
NONE = "–"
GREEK = {"dz": "dz", "r_rb": "r", "ges": "η²G", "W": "W", "eta2": "η²", "epsilon": "ε"}


def description_lines(items: Iterable[Studied], rows: str) -> Lines:
    """Return what each measure was in each condition; `rows` says what a row is (tasks)."""
    head = ["measure", "condition", "people", rows, "mean", "95 % interval", "SD"]
    lines = [[*head, "median", "quartiles", "range"]]
    for item in items:
        digits = item.measure.digits
        for number, (name, told) in enumerate(item.comparison.descriptions.items()):
            counts = [str(told.n), str(item.comparison.rows[name])]
            cells = [
                _number(told.mean, digits),
                _interval(told.mean, told.half_width, digits),
                _number(told.sd, digits),
                _number(told.median, digits),
                _range(told.quartile_1, told.quartile_3, digits),
                _range(told.minimum, told.maximum, digits),
            ]
            lines.append([item.measure.label if number == 0 else "", shown(name), *counts, *cells])
    return lines


def omnibus_lines(items: Iterable[Studied]) -> Lines:
    """Return the tests of three and more conditions at once, header only when there are none."""
    lines = [
        ["measure", "conditions", "n", "default test", "", "effect size", "Mauchly", "mixed model"]
    ]
    for item in items:
        found = item.comparison
        if found.omnibus is not None:
            lines.append(
                [
                    item.measure.title,
                    str(len(found.conditions)),
                    _n(found.omnibus),
                    found.omnibus.test,
                    statistic_text(found.omnibus),
                    _effects(found.omnibus, ("ges", "epsilon", "W")),
                    NONE if found.sphericity is None else _mauchly(found.sphericity),
                    NONE if found.mixed is None else statistic_text(found.mixed),
                ]
            )
    return lines


def pair_lines(items: Iterable[Studied]) -> Lines:
    """Return the default tests of pairs of conditions, header only when there are none."""
    head = ["measure", "conditions", "n", "difference", "default test", "", "Holm", "effect size"]
    lines, items = [head], list(items)
    two = any(len(item.comparison.conditions) == 2 and item.comparison.mixed for item in items)
    if two:
        head.append("mixed model, all rows")
    for item in items:
        for number, pair in enumerate(item.comparison.pairs):
            title = item.measure.label if number == 0 else ""
            line = [title, _names(pair), *_pair_cells(pair, item.measure.digits)]
            mixed = item.comparison.mixed if len(item.comparison.conditions) == 2 else None
            lines.append([*line, statistic_text(mixed) if mixed else NONE] if two else line)
    return lines


def _pair_cells(pair: Pair, digits: int) -> Iterator[str]:
    outcome = pair.outcome
    yield _n(outcome)
    difference = _effect(outcome, "difference")
    yield NONE if difference is None else _bare(difference, digits)
    yield outcome.test
    yield statistic_text(outcome)
    yield NONE if pair.p_holm is None else p_text(pair.p_holm)
    yield _effects(outcome, ("dz", "r_rb"))


def published_way_lines(items: Iterable[Studied]) -> Lines:
    """Return the tests of the publication, which treat rows as independent."""
    lines = [["measure", "conditions", "rows", "one-way ANOVA", "effect size", "Tukey HSD"]]
    for item in items:
        found = item.comparison
        title = item.measure.title
        if found.published_omnibus is not None:
            outcome = found.published_omnibus
            cells = [_n(outcome), statistic_text(outcome), _effects(outcome, ("eta2",)), NONE]
            lines.append([title, "all", *cells])
            title = ""
        tukey = {(pair.first, pair.second): pair.outcome for pair in found.tukey}
        for pair in found.published:
            outcome, other = pair.outcome, tukey.get((pair.first, pair.second))
            cells = [_n(outcome), statistic_text(outcome), _effects(outcome, ("eta2",))]
            beside = p_text(other.p) if isinstance(other, Result) else NONE
            lines.append([title, f"{shown(pair.first)} – {shown(pair.second)}", *cells, beside])
            title = ""
    return lines


def learning_lines(items: Iterable[Studied]) -> Lines:
    """Return the change from task to task of whatever was asked or measured after tasks."""
    lines = [["measure", "people", "change per task [95 % interval]", "mixed model"]]
    for item in items:
        if item.learning is not None:
            slope = _effect(item.learning, "slope")
            change = NONE if slope is None else _bare(slope, item.measure.digits + 1)
            cells = [_n(item.learning), change, statistic_text(item.learning)]
            lines.append([item.measure.label, *cells])
    return lines


def choice_lines(choices: Iterable[Choice]) -> Lines:
    """Return how often each answer to a question was given."""
    lines = [["question", "answer", "people", "share", "exact binomial test"]]
    for choice in choices:
        total = sum(choice.counts.values())
        for number, (value, count) in enumerate(choice.counts.items()):
            label = choice.labels[value]
            name = label if label == shown(value) else f"{shown(value)} ({label})"
            share = f"{count / total:.0%}" if total else NONE
            test = p_text(choice.p) if choice.p is not None and number == 0 else ""
            lines.append([choice.text if number == 0 else "", name, str(count), share, test])
        if choice.missing:
            lines.append(["", "no answer", str(choice.missing), "", ""])
    return lines


def left_out(items: Iterable[Studied]) -> list[str]:
    """Return a line on people without a value in every condition, for each measure with such."""
    return [
        f"{item.measure.title}: {', '.join(item.comparison.incomplete)} "
        "did not give a value in every condition; the default tests leave them out, the mixed "
        "model uses what they gave"
        for item in items
        if item.comparison.incomplete and len(item.comparison.conditions) > 1
    ]


def _names(pair: Pair) -> str:
    return f"{shown(pair.first)} – {shown(pair.second)}"


def _n(outcome: Outcome) -> str:
    return str(outcome.n) if isinstance(outcome, Result) else NONE


def _effect(outcome: Outcome, name: str) -> Effect | None:
    effects = outcome.effects if isinstance(outcome, Result) else ()
    return next((effect for effect in effects if effect.name == name), None)


def _effects(outcome: Outcome, names: Sequence[str]) -> str:
    found = [effect for name in names if (effect := _effect(outcome, name)) is not None]
    told = [effect_text(Effect(GREEK[e.name], e.value, e.low, e.high)) for e in found]
    return "; ".join(told) or NONE


def _bare(effect: Effect, digits: int) -> str:
    return effect_text(effect, digits).partition(" = ")[2]


def _mauchly(outcome: Outcome) -> str:
    if isinstance(outcome, NoResult):
        return outcome.reason
    return f"W = {number_text(outcome.value)}, {p_text(outcome.p)}"


def _number(value: float | None, digits: int) -> str:
    return NONE if value is None else number_text(value, digits)


def _interval(mean: float | None, half: float | None, digits: int) -> str:
    return NONE if mean is None or half is None else _range(mean - half, mean + half, digits)


def _range(low: float | None, high: float | None, digits: int) -> str:
    if low is None or high is None:
        return NONE
    return f"{number_text(low, digits)} … {number_text(high, digits)}"
