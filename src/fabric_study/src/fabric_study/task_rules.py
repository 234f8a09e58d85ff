# SPDX-License-Identifier: BSD-3-Clause
"""The rules of a task: the items to remember, and under which of them every cube falls.

    rules = read_rules(section, labels=("red", "green", "blue"), count=10)
    rules.items                    # what is to be remembered, as it is shown
    rules.of_cubes(cube_colours)   # for each cube in the order of arrival an index into items

Four forms of the mapping (thesis Fig. 6.4):

    {red: red, green: green, blue: blue}                      the colour decides (type 1)
    {sequence: [red, blue, blue, green, red]}                 the turn decides (types 2 and 4)
    {red: [green, blue], green: red, blue: [blue, red]}       colour and turn decide (type 3)
    {stroop: {counts: ink, words: [{word: red, ink: blue}]}}  a sequence told by coloured words (5)
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from fabric_msgs.msg import Cube, SortingRule
from fabric_study.strict_yaml import Section

COLOURS = {"red": Cube.COLOUR_RED, "green": Cube.COLOUR_GREEN, "blue": Cube.COLOUR_BLUE}
COLOUR_NAMES = {number: name for name, number in COLOURS.items()}
ANY = Cube.COLOUR_UNKNOWN  # of a rule: whatever colour the cube has
MAX_ITEMS = 255  # an index into them is a byte
FORMS = ("sequence", "stroop")


@dataclass(frozen=True)
class RuleItem:
    """One item to remember; the fields of fabric_msgs/SortingRule."""

    label: str
    colour: int = ANY
    occurrence: int = 0
    word: int = ANY
    ink: int = ANY
    ink_counts: bool = False

    def message(self) -> SortingRule:
        """Return the item as a message."""
        return SortingRule(**asdict(self))


@dataclass(frozen=True)
class Rules:
    """The items of a task, in the order in which they are shown.

    Items of one colour take turns; those of colour ANY take turns over all cubes.
    """

    items: tuple[RuleItem, ...]

    @property
    def colours(self) -> tuple[int, ...]:
        """The colours of cubes that have a rule, ascending."""
        ruled = {item.colour for item in self.items}
        return tuple(sorted(COLOUR_NAMES if ANY in ruled else ruled))

    def of_cubes(self, cube_colours: Iterable[int]) -> tuple[int, ...]:
        """Return for every cube, given their colours in the order of arrival, its item's index."""
        turns: dict[int, list[int]] = {}
        for index, item in enumerate(self.items):
            turns.setdefault(item.colour, []).append(index)
        came: Counter[int] = Counter()
        found = []
        for colour in cube_colours:
            group = ANY if ANY in turns else colour
            found.append(turns[group][came[group] % len(turns[group])])
            came[group] += 1
        return tuple(found)


def read_rules(section: Section, labels: Sequence[str], count: int) -> Rules:
    """Read the rules of a task with `count` cubes and containers with these labels.

    Raises DefinitionError naming the key and the value that cannot be meant.
    """
    given = dict(section.items())
    if not given:
        raise section.error("", "is empty")
    form = next((form for form in FORMS if form in given), None)
    for key in given:
        if form is not None and key != form:
            raise section.error(key, f"is a second rule for cubes that fall under {form} already")
    if form == "sequence":
        found = _turns(section, form, given[form], labels, count)
        items = [RuleItem(label) for label in found]
    elif form == "stroop":
        items = _stroop(section.section(form), labels, count)
    else:
        items = _colours(section, given, labels, count)
    if len(items) > MAX_ITEMS:
        raise section.error("", f"has {len(items)} items to remember; at most {MAX_ITEMS}")
    return Rules(tuple(items))


def _colours(
    section: Section, given: dict[Any, Any], labels: Sequence[str], count: int
) -> list[RuleItem]:
    items = []
    for name, value in given.items():
        if not isinstance(name, str) or name not in COLOURS:
            raise section.error(name, f"is no colour; {allowed([*COLOURS, *FORMS])}")
        found = _turns(section, name, value if isinstance(value, list) else [value], labels, count)
        for turn, label in enumerate(found, start=1):
            items.append(RuleItem(label, COLOURS[name], turn if len(found) > 1 else 0))
    return sorted(items, key=lambda item: item.colour)


def _turns(section: Section, key: str, value: Any, labels: Sequence[str], count: int) -> list[str]:
    """The labels of a list, one a turn."""
    _check_length(section, key, value, count)
    for label in value:
        _check_label(section, key, label, labels)
    return value


def _stroop(section: Section, labels: Sequence[str], count: int) -> list[RuleItem]:
    ink_counts = section.choice("counts", ("ink", "word")) == "ink"
    words = section.value("words")
    section.finish()
    _check_length(section, "words", words, count)
    items = []
    for number, pair in enumerate(words, start=1):
        place = f"words: number {number}"
        if not isinstance(pair, dict) or set(pair) != {"word", "ink"}:
            raise section.error(place, f"is {pair!r}; it must have word and ink")
        for key, colour in pair.items():
            if not isinstance(colour, str) or colour not in COLOURS:
                raise section.error(place, f"{key} is {colour!r}; {allowed(COLOURS)}")
        label = pair["ink" if ink_counts else "word"]
        _check_label(section, place, label, labels)
        word, ink = COLOURS[pair["word"]], COLOURS[pair["ink"]]
        items.append(RuleItem(label, word=word, ink=ink, ink_counts=ink_counts))
    if all(item.word == item.ink for item in items):
        raise section.error("words", "are printed in the ink that they name, every one")
    return items


def _check_length(section: Section, key: str, value: Any, count: int) -> None:
    if not isinstance(value, list):
        raise section.error(key, f"is {value!r}; it must be a list")
    if not value:
        raise section.error(key, "is a list of length 0; nothing could follow")
    if len(value) > count:
        raise section.error(key, f"has {len(value)} turns, but only {count} cubes come")


def _check_label(section: Section, key: str, label: Any, labels: Sequence[str]) -> None:
    if not isinstance(label, str) or label not in labels:
        text = f"cannot be satisfied: no container is labelled {label!r}; {allowed(labels)}"
        raise section.error(key, text)


def allowed(words: Iterable[str]) -> str:
    """Return what may be written, for a complaint."""
    return f"allowed are {', '.join(words)}"
