# SPDX-License-Identifier: BSD-3-Clause
"""Characters: names, numbers, refusals, and the `human:=` argument."""

import itertools

import numpy as np
import pytest
import worker_bench
from hypothesis import given
from hypothesis import strategies as st

from fabric_sim.character import CORNERS, Character, CharacterError, human_of_task, named_generator

assert worker_bench.LIBRARY  # loads the settings of hypothesis

dial = st.floats(0.0, 1.0)


def test_there_are_sixteen_known_types_named_by_their_dials():
    assert len(CORNERS) == 16
    person = Character.parse("expert_rested_distracted_collaborative")
    assert person.dials == (1.0, 1.0, 0.0, 1.0)
    assert Character.parse("beginner_tired_attentive_noncollaborative").dials == (0, 0, 1, 0)


@pytest.mark.parametrize("name", sorted(CORNERS))
def test_a_corner_reads_back_under_its_name(name):
    assert Character.parse(name).name == name


@given(dial, dial, dial, dial)
def test_any_point_reads_back_under_its_name(e, s, a, c):
    person = Character(e, s, a, c)
    assert Character.parse(person.name).dials == pytest.approx(person.dials, abs=1e-9)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("wizard", ["'wizard'", "beginner|expert", "mixed"]),
        ("expert_rested", ["'expert_rested'", "attentive"]),
        ("0.3,0.8,0.5", ["'0.3,0.8,0.5'", "3 numbers"]),
        ("0.3,0.8,0.5,x", ["'0.3,0.8,0.5,x'", "not four numbers"]),
        ("0.3,0.8,1.5,0.1", ["attention is 1.5", "[0, 1]"]),
        ("nan,0.8,0.5,0.1", ["expertise is nan", "[0, 1]"]),
        ("0,0,0,inf", ["collaborativeness is inf"]),
        ("", ["''"]),
    ],
)
def test_a_bad_type_is_refused_by_value_with_the_allowed_ones(text, named):
    with pytest.raises(CharacterError) as refusal:
        Character.parse(text)
    for word in named:
        assert word in str(refusal.value)


@pytest.mark.parametrize("dial_name", ["expertise", "stamina", "attention", "collaborativeness"])
@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1.2, -0.1, "0.5", None, True])
def test_a_bad_dial_is_refused_by_name_and_value(dial_name, value):
    with pytest.raises(CharacterError) as refusal:
        Character(0.5, 0.5, 0.5, 0.5).with_dials(**{dial_name: value})
    assert dial_name in str(refusal.value)
    assert (f"{value:g}" if type(value) is float else repr(value)) in str(refusal.value)


def test_random_needs_a_generator():
    with pytest.raises(CharacterError, match="generator"):
        Character.parse("random")
    person = Character.parse("random", np.random.default_rng(1))
    assert Character.parse(person.name) == person


def test_a_random_person_stays_the_same_through_the_run():
    assert human_of_task("random", 7, 1) == human_of_task("random", 7, 30)
    assert human_of_task("random", 7, 1) != human_of_task("random", 8, 1)


def test_mixed_shows_every_known_type_and_never_the_same_twice_in_a_row():
    for seed in range(20):
        names = [human_of_task("mixed", seed, number).name for number in range(1, 65)]
        assert set(names[:16]) == set(CORNERS)
        assert all(a != b for a, b in itertools.pairwise(names))
    assert [human_of_task("mixed", 3, n) for n in range(1, 9)] == [
        human_of_task("mixed", 3, n) for n in range(1, 9)
    ]


def test_task_numbers_count_from_one():
    with pytest.raises(CharacterError, match="0"):
        human_of_task("mixed", 1, 0)


def test_named_streams_are_reproducible_and_different():
    one, same = named_generator(5, "worker", 1), named_generator(5, "worker", 1)
    other = named_generator(5, "worker", 2)
    first = one.random()
    assert first == same.random()
    assert first != other.random()
