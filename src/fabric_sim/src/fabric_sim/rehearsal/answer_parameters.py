# SPDX-License-Identifier: BSD-3-Clause
"""The numbers of the answer model, config/rehearsal.yaml, typed and checked."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from fabric_sim.rehearsal.experience import MEASURES, Measures
from fabric_sim.worker_parameters import default_path
from fabric_study.strict_yaml import Section, read

MOST = 20.0  # of a weight, in steps; more is a slip of the pen
Entry = TypeVar("Entry")


@dataclass(frozen=True)
class Style:
    """How people differ in answering; standard deviations, in steps of a five-step scale."""

    shift: float  # of a person: agrees more to everything
    stretch: float  # of a person, of the logarithm: prefers the ends or the middle
    view: float  # of a person on one item, the same whenever it is asked
    noise: float  # of every answer


@dataclass(frozen=True)
class Leaning:
    """What an answer leans on. at: without any of the measures; weights: by name of MEASURES."""

    at: float
    weights: dict[str, float]
    because: str

    def of(self, measures: Measures) -> float:
        """Return at + sum of weight * measure."""
        found = (weight * measures[name] for name, weight in self.weights.items())
        return self.at + math.fsum(found)


@dataclass(frozen=True)
class Preference:
    """How a choice is made; one of the three is there.

    which: named is the condition that leans most to this statement. whether: the first option is
    taken by who leans to this statement, else the last. odds: probabilities of options, the rest
    goes to the others in equal parts.
    """

    which: str
    whether: str
    odds: dict[str, float]
    because: str


@dataclass(frozen=True)
class AnswerParameters:
    """The numbers of config/rehearsal.yaml, by ids of items."""

    style: Style
    missing: float  # probability that an answer is left out
    commented: float  # probability that free text is written at all
    comment: str
    statements: dict[str, Leaning]  # in steps from the middle of a five-step scale
    demands: dict[str, Leaning]  # in 0..1 of the scale
    choices: dict[str, Preference]

    @classmethod
    def load(cls, path: Path | None = None) -> AnswerParameters:
        """Read a file, by default the package's. Raises DefinitionError naming file and entry."""
        top = read(path or default_path().with_name("rehearsal.yaml"))
        found = cls(
            style=_style(top.section("style")),
            missing=top.number("missing", 0.0, 1.0),
            commented=top.number("commented", 0.0, 1.0),
            comment=_text(top, "comment"),
            statements=_entries(top.section("statements"), _leaning),
            demands=_entries(top.section("demands"), _leaning),
            choices=_entries(top.section("choices"), _preference),
        )
        top.finish()
        for name, choice in found.choices.items():
            asked = choice.which or choice.whether
            if asked and asked not in found.statements:
                raise top.error(f"choices.{name}", f"names {asked!r}, which is no statement here")
        return found


def _style(section: Section) -> Style:
    style = Style(*(section.number(key, 0.0, 2.0) for key in ("shift", "stretch", "view", "noise")))
    section.finish()
    return style


def _text(section: Section, key: str, *default: str) -> str:
    value = section.value(key, *default)
    if not isinstance(value, str):
        raise section.error(key, f"must be text, not {value!r}")
    return " ".join(value.split())


def _entries(section: Section, make: Callable[[Section], Entry]) -> dict[str, Entry]:
    found = {}
    for key, _ in section.items():
        entry = section.section(key)
        found[str(key)] = make(entry)
        entry.finish()
    return found


def _leaning(section: Section) -> Leaning:
    weights = section.section("weights")
    for name, _ in weights.items():
        if name not in MEASURES:
            raise weights.error(name, f"is no measure; there are {', '.join(MEASURES)}")
    values = {str(name): weights.number(name, -MOST, MOST) for name, _ in weights.items()}
    return Leaning(section.number("at", -MOST, MOST), values, _text(section, "because"))


def _preference(section: Section) -> Preference:
    which, whether = _text(section, "which", ""), _text(section, "whether", "")
    odds = _odds(section.section("odds")) if section.value("odds", None) is not None else {}
    if sum(map(bool, (which, whether, odds))) != 1:
        raise section.error("", "wants one of which, whether and odds")
    return Preference(which, whether, odds, _text(section, "because"))


def _odds(section: Section) -> dict[str, float]:
    odds = {str(option): section.number(option, 0.0, 1.0) for option, _ in section.items()}
    total = math.fsum(odds.values())
    if total > 1.0 + 1e-9:
        raise section.error("", f"sum to {total:g}, more than 1")
    return odds
