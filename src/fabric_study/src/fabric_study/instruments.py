# SPDX-License-Identifier: BSD-3-Clause
"""Questionnaires: what people are asked, in every language, and which answers can be meant."""

import math
import random
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fabric_study.shipped import load_path, names_in
from fabric_study.strict_yaml import Section, read

LANGUAGES = ("en", "de")
KINDS = ("likert", "tlx", "pair", "choice", "number", "text")
WHEN = (
    "start",
    "task",
    "general",
)  # once at the start; after each task; per condition or at the end
LIKERT = (1, 5)
TLX = (0, 100)
TLX_STEP = 5  # 21 steps
LONGEST_TEXT = 4000  # characters of a free answer
IDENTIFIER = re.compile(r"[a-z][a-z0-9_]{0,63}")

Text = Mapping[str, str]  # language: words
Answer = int | float | str | None


@dataclass(frozen=True)
class Item:
    """One question. `labels` are the words of values: every one of likert, choice and pair, the
    ends of tlx; they are empty for number and text."""

    id: str
    kind: str
    text: Text
    low: float
    high: float
    labels: Mapping[int | str, Text]
    category: str
    reverse: bool  # agreement speaks against what the category is named after

    def checked(self, value: Any) -> Answer:
        """Return `value` as it is stored; None, or a blank text, is a missing answer.

        Raises ValueError naming the item and a value that it does not offer.
        """
        if value is None:
            return None
        if self.kind in ("choice", "pair"):
            if not isinstance(value, str) or value not in self.labels:
                raise ValueError(f"{self.id}: {value!r} is not one of {', '.join(self.labels)}")
            return value
        if self.kind == "text":
            return self._checked_text(value)
        return self._checked_number(value)

    def _checked_text(self, value: Any) -> str | None:
        if not isinstance(value, str) or len(value) > self.high:
            raise ValueError(f"{self.id}: must be a text of at most {self.high:g} characters")
        if any(0xD800 <= ord(character) <= 0xDFFF for character in value):
            raise ValueError(f"{self.id}: the text holds half of a character")
        return value if value.strip() else None

    def _checked_number(self, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise ValueError(f"{self.id}: {value!r} is not a number")
        if not math.isfinite(value) or not self.low <= value <= self.high:
            raise ValueError(f"{self.id}: {value} does not lie in {self.low:g}..{self.high:g}")
        if self.kind == "number":
            return value
        step = TLX_STEP if self.kind == "tlx" else 1
        if value % step:
            raise ValueError(f"{self.id}: {value} is not one of its steps of {step}")
        return int(value)


@dataclass(frozen=True)
class Instrument:
    """One questionnaire; read it with `load_instrument`, which checks everything."""

    name: str
    title: Text
    when: str  # one of WHEN
    shuffle: bool
    items: tuple[Item, ...]

    def item(self, item_id: str) -> Item:
        """Return an item. Raises ValueError for an id that the instrument does not have."""
        for item in self.items:
            if item.id == item_id:
                return item
        raise ValueError(f"{self.name} has no item {item_id!r}")

    def order(self, seed: str) -> tuple[Item, ...]:
        """Return the items as they are shown; shuffled ones by the seed, a text."""
        items = list(self.items)
        if self.shuffle:
            random.Random(f"{seed}/{self.name}").shuffle(items)
        return tuple(items)


def instrument_names() -> list[str]:
    """Return the names of the shipped instruments."""
    return names_in("instruments")


def load_instrument(name_or_path: str) -> Instrument:
    """Return a shipped instrument by name, or the one in a .yaml file by path.

    Raises DefinitionError naming the file, the item and the key that cannot be meant.
    """
    path = load_path("instruments", name_or_path)
    return instrument_from(path.stem, read(path))


def instrument_from(name: str, top: Section) -> Instrument:
    """Return the instrument that a mapping describes. Raises as `load_instrument`."""
    if not IDENTIFIER.fullmatch(name):
        raise top.error("", f"is named {name!r}; must be like {IDENTIFIER.pattern}")
    common = _labels(top, {}) if top.value("labels", None) is not None else {}
    wording = text_of(top, "text") if top.value("text", None) is not None else None
    instrument = Instrument(
        name=name,
        title=text_of(top, "title"),
        when=top.choice("when", WHEN),
        shuffle=_flag(top, "shuffle"),
        items=_items(top.section("items"), common, wording),
    )
    top.finish()
    return instrument


def text_of(section: Section, key: str) -> Text:
    """Return the words under `key` in every language. Raises DefinitionError naming what lacks."""
    words = section.section(key)
    for language in LANGUAGES:
        value = words.value(language)
        if not isinstance(value, str) or not value.strip():
            raise words.error(language, f"must be words, not {value!r}")
    words.finish()
    return {language: words.value(language).strip() for language in LANGUAGES}


def _flag(section: Section, key: str, *default: bool) -> bool:
    value = section.value(key, *default)
    if not isinstance(value, bool):
        raise section.error(key, f"must be true or false, not {value!r}")
    return value


def _items(
    section: Section, common: Mapping[int | str, Text], wording: Text | None
) -> tuple[Item, ...]:
    items = []
    for key, _ in section.items():
        if not isinstance(key, str) or not IDENTIFIER.fullmatch(key):
            raise section.error(key, f"is no id; it must be like {IDENTIFIER.pattern}")
        items.append(_item(key, section.section(key), common, wording))
    if not items:
        raise section.error("", "is empty")
    return tuple(items)


def _item(
    item_id: str, section: Section, common: Mapping[int | str, Text], wording: Text | None
) -> Item:
    kind = section.choice("kind", KINDS)
    labelled = kind not in ("number", "text")
    low, high = _range(kind, section)
    own_words = wording is None or section.value("text", None) is not None
    item = Item(
        id=item_id,
        kind=kind,
        text=text_of(section, "text") if own_words else wording,
        low=low,
        high=high,
        labels=_labels(section, common) if labelled else {},
        category=_word(section, "category"),
        reverse=_flag(section, "reverse", False),
    )
    section.finish()
    _check_labels(section, item)
    return item


def _word(section: Section, key: str) -> str:
    value = section.value(key)
    if not isinstance(value, str) or not IDENTIFIER.fullmatch(value):
        raise section.error(key, f"is {value!r}; it must be like {IDENTIFIER.pattern}")
    return value


def _range(kind: str, section: Section) -> tuple[float, float]:
    if kind == "likert":
        return LIKERT
    if kind == "tlx":
        return TLX
    if kind == "text":
        return 0, LONGEST_TEXT
    if kind != "number":
        return 0, 0
    low, high = (section.number(key, -1e9, 1e9) for key in ("low", "high"))
    if low >= high:
        raise section.error("low", f"is {low:g}; it must be less than high, which is {high:g}")
    return low, high


def _labels(section: Section, common: Mapping[int | str, Text]) -> Mapping[int | str, Text]:
    """Return an item's own labels, those it picks from the instrument's by a list, or all."""
    value = section.value("labels", None)
    if value is None:
        return common
    if isinstance(value, list):
        for label in value:
            if label not in common or value.count(label) > 1:
                offered = ", ".join(map(str, common)) or "none"
                raise section.error("labels", f"picks {label!r} twice, or it is none of {offered}")
        return {label: common[label] for label in value}
    labels = section.section("labels")
    return {_label(labels, key): text_of(labels, key) for key, _ in labels.items()}


def _label(labels: Section, key: Any) -> int | str:
    """Return the value that a label is for; JSON has only words as keys."""
    if isinstance(key, bool) or not isinstance(key, (int, str)):
        raise labels.error(key, "is no value; it must be a whole number or a word")
    return int(key) if isinstance(key, str) and re.fullmatch("[0-9]{1,3}", key) else key


def _check_labels(section: Section, item: Item) -> None:
    found = set(item.labels)
    if item.kind == "likert" and found != set(range(LIKERT[0], LIKERT[1] + 1)):
        raise section.error("labels", f"must be those of 1 to 5, not of {_list(found)}")
    if item.kind == "tlx" and found != set(TLX):
        raise section.error("labels", f"must be those of 0 and 100, not of {_list(found)}")
    if item.kind == "pair" and len(found) != 2:
        raise section.error("labels", f"must be two, not {_list(found)}")
    if item.kind == "choice" and len(found) < 2:
        raise section.error("labels", f"must be two or more, not {_list(found)}")
    if item.kind in ("choice", "pair"):
        for label in item.labels:
            if not isinstance(label, str) or not IDENTIFIER.fullmatch(label):
                raise section.error("labels", f"{label!r} must be like {IDENTIFIER.pattern}")


def _list(values: set[int | str]) -> str:
    return ", ".join(sorted(map(str, values))) or "none"
