# SPDX-License-Identifier: BSD-3-Clause
"""Questionnaires: what the shipped ones ask, which answers can be meant, what is refused."""

import copy
import json

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from study_play import INSTRUMENTS, likert, words

from fabric_study.instruments import LANGUAGES, instrument_from, instrument_names, load_instrument
from fabric_study.strict_yaml import DefinitionError, Section, read

SCALES = ["mental_demand", "physical_demand", "temporal_demand"]
SCALES += ["performance", "effort", "frustration"]
COUNTS = {  # statements of thesis Tables 6.6 (and Fig. 6.14b), 6.8, 6.9 and 6.10
    "experiment_0_task": 7, "experiment_0_general": 5, "experiment_1_task": 14,
    "experiment_1_general": 5, "experiment_1_comparison": 2, "experiment_2_task": 8,
    "experiment_2_general": 8, "nasa_tlx": 6, "nasa_tlx_weights": 15, "gestures": 7,
}  # fmt: skip


@pytest.mark.parametrize("name", instrument_names())
def test_a_shipped_instrument_has_words_in_every_language_and_asks_each_thing_once(name):
    instrument = load_instrument(name)
    assert len(instrument.items) == COUNTS.get(name, len(instrument.items))
    for language in LANGUAGES:
        asked = [(item.text[language], *item.labels) for item in instrument.items]
        assert len(set(asked)) == len(asked)


def test_an_item_of_the_same_id_is_asked_in_the_same_words_everywhere():
    wordings = {}
    for name in instrument_names():
        for item in load_instrument(name).items:
            assert wordings.setdefault(item.id, item.text) == item.text, f"{name}: {item.id}"


def test_the_weights_of_the_load_index_compare_every_pair_of_its_scales_once():
    pairs = {frozenset(item.labels) for item in load_instrument("nasa_tlx_weights").items}
    scales = {item.id for item in load_instrument("nasa_tlx").items}
    assert scales == set(SCALES)
    assert pairs == {frozenset((a, b)) for a in scales for b in scales if a != b}


def test_no_shipped_instrument_asks_who_somebody_is():
    for item in load_instrument("demographics").items:
        assert item.kind == "choice"


ANSWERS = [
    ("likert", [1, 5, 3.0, None], [0, 6, 2.5, "3", True, float("nan"), [1]]),
    ("tlx", [0, 100, 55], [-5, 101, 52, "50", float("inf")]),
    ("number", [16, 99, 20.5], [15.9, 100, float("nan"), "20", False]),
    ("choice", ["left", "right", None], ["up", 1, "", True, ["left"]]),
    ("text", ["", "gut", None], [5, "x" * 4001, "\ud800"]),
]


def item_of(kind):
    every = {
        "likert": likert("x"),
        "tlx": INSTRUMENTS["load"]["items"]["effort"],
        "number": INSTRUMENTS["demographics"]["items"]["age"],
        "choice": INSTRUMENTS["demographics"]["items"]["hand"],
        "text": INSTRUMENTS["load"]["items"]["remark"],
    }
    content = {"title": words("t"), "when": "task", "shuffle": True, "items": {"x": every[kind]}}
    return instrument_from("one", Section("file", "", content)).items[0]


@pytest.mark.parametrize("kind, good, bad", ANSWERS)
def test_an_item_takes_what_it_offers_and_names_what_it_does_not(kind, good, bad):
    item = item_of(kind)
    for value in good:
        assert item.checked(value) == (None if value == "" else value)
    for value in bad:
        with pytest.raises(ValueError, match="^x: "):
            item.checked(value)


def test_a_blank_text_is_a_missing_answer():
    assert item_of("text").checked(" \n") is None


def test_whole_answers_are_stored_as_whole_numbers():
    assert repr(item_of("likert").checked(3.0)) == "3"


@settings(deadline=None)
@given(st.text(max_size=20))
def test_shuffling_keeps_every_item_and_depends_on_the_seed_alone(seed):
    instrument = load_instrument("experiment_1_task")
    order = instrument.order(seed)
    assert sorted(order, key=lambda item: item.id) == sorted(
        instrument.items, key=lambda item: item.id
    )
    assert instrument.order(seed) == order


def test_different_people_see_different_orders_and_unshuffled_ones_the_same():
    shuffled, fixed = load_instrument("experiment_1_task"), load_instrument("nasa_tlx")
    assert len({str(shuffled.order(str(seed))) for seed in range(20)}) > 15
    assert all(fixed.order(str(seed)) == fixed.items for seed in range(20))


def test_an_instrument_survives_being_written_as_json():
    for name in instrument_names():
        instrument = load_instrument(name)
        content = read_content(name)
        again = instrument_from(name, Section("json", "", json.loads(json.dumps(content))))
        assert again == instrument


def read_content(name):
    from fabric_study.shipped import load_path

    return read(load_path("instruments", name)).content


def changed(*path, value=None, drop=False):
    content = copy.deepcopy(INSTRUMENTS["demographics"])
    content["items"]["calm"] = likert("calm")
    place = content
    for key in path[:-1]:
        place = place[key]
    if drop:
        del place[path[-1]]
    else:
        place[path[-1]] = value
    return content


REFUSED = [
    (changed("colour", value=1), "colour: is not known"),
    (changed("title", drop=True), "title: is missing"),
    (changed("title", "de", drop=True), "title.de: is missing"),
    (changed("title", "de", value="  "), "title.de: must be words"),
    (changed("title", "fr", value="x"), "title.fr: is not known"),
    (changed("when", value="never"), "when: is 'never'; allowed are"),
    (changed("shuffle", value="yes"), "shuffle: must be true or false"),
    (changed("items", value={}), "items: is empty"),
    (changed("items", value=[1]), "items: must be a mapping"),
    (changed("items", "Age", value=likert("x")), "items.Age: is no id"),
    (changed("items", 3, value=likert("x")), "items.3: is no id"),
    (changed("items", "age", "high", value=16), "items.age.low: is 16; it must be less than high"),
    (changed("items", "age", "high", value=float("nan")), "items.age.high: is nan"),
    (changed("items", "age", "low", drop=True), "items.age.low: is missing"),
    (changed("items", "age", "labels", value={}), "items.age.labels: is not known"),
    (changed("items", "age", "kind", value="slider"), "items.age.kind: is 'slider'"),
    (changed("items", "age", "text", "en", drop=True), "items.age.text.en: is missing"),
    (changed("items", "age", "category", drop=True), "items.age.category: is missing"),
    (changed("items", "age", "category", value="two words"), "items.age.category: is 'two words'"),
    (changed("items", "age", "hint", value="x"), "items.age.hint: is not known"),
    (changed("items", "age", "reverse", value=1), "items.age.reverse: must be true or false"),
    (changed("items", "hand", "labels", "left", drop=True), "items.hand.labels: must be two or mo"),
    (changed("items", "hand", "labels", value=["left"]), "items.hand.labels: picks 'left' tw"),
    (changed("items", "hand", "labels", 7, value=words("x")), "items.hand.labels: 7 must be like"),
    (changed("items", "hand", "labels", True, value=words("x")), "items.hand.labels.True: is no v"),
    (changed("items", "hand", "kind", value="likert"), "items.hand.labels: must be those of 1 to"),
    (changed("items", "hand", "kind", value="tlx"), "items.hand.labels: must be those of 0 and 1"),
    (changed("items", "calm", "kind", value="pair"), "items.calm.labels: must be two, not 1, 2,"),
    (changed("items", "calm", "labels", 4, drop=True), "items.calm.labels: must be those of 1 to"),
]


@pytest.mark.parametrize("content, complaint", REFUSED, ids=[text for _, text in REFUSED])
def test_what_cannot_be_meant_is_refused_with_file_item_and_key(tmp_path, content, complaint):
    path = tmp_path / "odd.yaml"
    path.write_text(yaml.safe_dump(content, allow_unicode=True), encoding="utf-8")
    with pytest.raises(DefinitionError) as refused:
        load_instrument(str(path))
    assert str(refused.value).startswith(f"{path}: {complaint}")


def test_an_item_given_twice_is_refused_with_its_line(tmp_path):
    path = tmp_path / "odd.yaml"
    path.write_text("items:\n  calm: {}\n  calm: {}\n", encoding="utf-8")
    with pytest.raises(DefinitionError, match="key 'calm' is given twice, in line 3"):
        load_instrument(str(path))


def test_a_name_that_is_not_shipped_is_refused_with_those_that_are():
    with pytest.raises(DefinitionError, match="no 'mood' among the instruments; .*nasa_tlx"):
        load_instrument("mood")
