# SPDX-License-Identifier: BSD-3-Clause
"""The five types of tasks as rules: what is to be remembered, and where every cube belongs."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabric_msgs.msg import Cube
from fabric_study.strict_yaml import DefinitionError, Section
from fabric_study.task_rules import COLOURS, Rules, read_rules
from fabric_study.tasks import load_definition

R, G, B = Cube.COLOUR_RED, Cube.COLOUR_GREEN, Cube.COLOUR_BLUE
TYPES = ("type_1_colours", "type_2_sequence", "type_3_mixed", "type_4_memory", "type_5_stroop")
LABELS = ("red", "green", "blue")
ORDER = (R, G, B, R, G, R, G, B, R, B)  # the order that the thesis' own code had


def rules_of(content: object, count: int = 10, labels: tuple[str, ...] = LABELS) -> Rules:
    return read_rules(Section("task.yaml", "rules", content), labels, count)


def targets(rules: Rules, cube_colours: tuple[int, ...]) -> str:
    """Initials of the containers of cubes, in their order."""
    return "".join(rules.items[i].label[0] for i in rules.of_cubes(cube_colours))


@pytest.mark.parametrize(
    ("name", "expected"),
    [  # cubes  R G B R G R G B R B
        ("type_1_colours", "rgbrgrgbrb"),
        ("type_2_sequence", "rbbgrrbbgr"),
        ("type_3_mixed", "grbbrgrrbb"),
        ("type_4_memory", "brggrbgbrg"),
        ("type_5_stroop", "brgrgbbbrg"),
    ],
)
def test_every_type_sends_ten_cubes_where_the_table_says(name, expected):
    assert targets(load_definition(name).rules, ORDER) == expected


@pytest.mark.parametrize(("name", "items"), zip(TYPES, (3, 5, 5, 7, 7), strict=True))
def test_every_type_is_a_sorting_task_of_ten_cubes_with_that_many_items(name, items):
    definition = load_definition(name)
    assert (definition.scenario, definition.count) == ("sorting", 10)
    assert len(definition.rules.items) == items


def test_loads_grow_as_the_published_mental_demand_did():
    loads = {name: load_definition(name).load for name in TYPES}
    assert loads["type_1_colours"] == pytest.approx(36.875 / 83.125, abs=0.005)
    assert loads["type_2_sequence"] == pytest.approx(60.0 / 83.125, abs=0.005)
    assert loads["type_4_memory"] == 1.0
    assert 1.0 < loads["type_3_mixed"] < loads["type_5_stroop"]


def test_the_stroop_words_never_name_their_ink_and_the_ink_tells_the_tray():
    names = {number: name for name, number in COLOURS.items()}
    for item in load_definition("type_5_stroop").rules.items:
        assert item.word != item.ink
        assert item.ink_counts
        assert item.label == names[item.ink]


def test_of_a_stroop_task_in_which_the_word_counts_the_word_tells_the_tray():
    words = [{"word": "red", "ink": "blue"}, {"word": "green", "ink": "green"}]
    rules = rules_of({"stroop": {"counts": "word", "words": words}})
    assert [item.label for item in rules.items] == ["red", "green"]
    assert not any(item.ink_counts for item in rules.items)


def test_colours_take_turns_of_their_own():
    rules = rules_of({"red": ["green", "blue"], "blue": "red"})
    assert rules.colours == (R, B)
    assert [item.occurrence for item in rules.items] == [1, 2, 0]
    assert targets(rules, (B, R, R, B, R)) == "rgbrg"


def test_items_are_told_as_messages():
    (first, *_) = load_definition("type_5_stroop").rules.items
    message = first.message()
    assert (message.colour, message.label, message.occurrence) == (0, "blue", 0)
    assert (message.word, message.ink, message.ink_counts) == (R, B, True)


WORDS = [{"word": "red", "ink": "blue"}]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({}, "rules: is empty"),
        ({"sequence": []}, "rules.sequence: is a list of length 0"),
        ({"sequence": "red"}, "rules.sequence: is 'red'; it must be a list"),
        ({"sequence": ["red"] * 4}, "rules.sequence: has 4 turns, but only 3 cubes come"),
        ({"sequence": ["red", "mauve"]}, "no container is labelled 'mauve'; allowed are red, gr"),
        ({"sequence": ["red", 3]}, "no container is labelled 3"),
        ({"sequence": ["red"], "blue": "red"}, "rules.blue: is a second rule for cubes that fall"),
        ({"sequence": ["red"], "stroop": {}}, "rules.stroop: is a second rule"),
        ({"red": []}, "rules.red: is a list of length 0"),
        ({"red": ["red"] * 4}, "rules.red: has 4 turns"),
        ({"red": None}, "no container is labelled None"),
        ({"mauve": "red"}, "rules.mauve: is no colour; allowed are red, green, blue, sequence, st"),
        ({1: "red"}, "rules.1: is no colour"),
        ({"stroop": ["red"]}, "rules.stroop: must be a mapping"),
        ({"stroop": {"words": WORDS}}, "rules.stroop.counts: is missing"),
        ({"stroop": {"counts": "paper", "words": WORDS}}, "is 'paper'; allowed are ink, word"),
        ({"stroop": {"counts": "ink"}}, "rules.stroop.words: is missing"),
        ({"stroop": {"counts": "ink", "words": []}}, "rules.stroop.words: is a list of length 0"),
        ({"stroop": {"counts": "ink", "words": ["red"]}}, "words: number 1: is 'red'; it must"),
        (
            {"stroop": {"counts": "ink", "words": [*WORDS, {"word": "red", "ink": "mauve"}]}},
            "rules.stroop.words: number 2: ink is 'mauve'; allowed are red, green, blue",
        ),
        (
            {"stroop": {"counts": "ink", "words": [{"word": c, "ink": c} for c in LABELS]}},
            "rules.stroop.words: are printed in the ink that they name",
        ),
        ({"stroop": {"counts": "ink", "words": WORDS, "speed": 1}}, "speed: is not known"),
    ],
)
def test_rules_that_cannot_be_satisfied_are_refused_with_their_place(content, message):
    with pytest.raises(DefinitionError) as caught:
        rules_of(content, count=3)
    assert message in str(caught.value)
    assert str(caught.value).startswith("task.yaml: rules")


def test_a_container_that_the_scenario_does_not_have_is_refused():
    words = {"stroop": {"counts": "ink", "words": WORDS}}
    for content in ({"sequence": ["red"]}, {"red": "red"}, words):
        with pytest.raises(DefinitionError, match="no container is labelled"):
            rules_of(content, labels=("inspected",))


def test_more_items_than_a_message_can_count_are_refused():
    with pytest.raises(DefinitionError, match="has 300 items to remember; at most 255"):
        rules_of({colour: ["red"] * 100 for colour in LABELS}, count=100)


LABEL = st.sampled_from(LABELS)
TURNS = st.lists(LABEL, min_size=1, max_size=8)
COLOURED = st.dictionaries(LABEL, st.one_of(LABEL, TURNS), min_size=1)
PAIRS = st.lists(st.fixed_dictionaries({"word": LABEL, "ink": LABEL}), min_size=1, max_size=8)
STROOP = st.fixed_dictionaries(
    {
        "counts": st.sampled_from(["ink", "word"]),
        "words": PAIRS.filter(lambda pairs: any(p["word"] != p["ink"] for p in pairs)),
    }
)
CONTENT = st.one_of(
    COLOURED,
    st.fixed_dictionaries({"sequence": TURNS}),
    st.fixed_dictionaries({"stroop": STROOP}),
)


@given(CONTENT, st.data())
def test_every_cube_falls_under_one_item_whose_container_exists(content, data):
    rules = rules_of(content)
    cubes = data.draw(st.lists(st.sampled_from(rules.colours), max_size=30))
    found = rules.of_cubes(cubes)
    assert len(found) == len(cubes)
    for colour, index in zip(cubes, found, strict=True):
        assert rules.items[index].colour in (Cube.COLOUR_UNKNOWN, colour)
        assert rules.items[index].label in LABELS
    assert found == rules.of_cubes(cubes)


@given(CONTENT, st.data())
def test_no_item_is_used_more_than_once_oftener_than_one_that_shares_its_turns(content, data):
    rules = rules_of(content)
    cubes = data.draw(st.lists(st.sampled_from(rules.colours), max_size=40))
    found = rules.of_cubes(cubes)
    for colour in {item.colour for item in rules.items}:
        used = [found.count(i) for i, item in enumerate(rules.items) if item.colour == colour]
        assert sorted(used, reverse=True) == used
        assert used[0] - used[-1] <= 1
