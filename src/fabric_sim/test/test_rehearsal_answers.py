# SPDX-License-Identifier: BSD-3-Clause
"""Simulated answers: within their scales, led by what happened, left out at a small rate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fabric_sim.rehearsal.answer_parameters import AnswerParameters
from fabric_sim.rehearsal.answers import Moment, Respondent
from fabric_sim.rehearsal.experience import MEASURES, NOTHING_YET
from fabric_sim.worker_parameters import default_path
from fabric_study.instruments import instrument_names, load_instrument
from fabric_study.strict_yaml import DefinitionError

MODEL = AnswerParameters.load()
PEOPLE = 40
CALM = {**NOTHING_YET, "success": 0.9, "own_success": 0.9, "memory_load": 0.5}
STORMY = {**CALM, "warnings": 0.95, "refused": 1.0, "taken_over": 0.6}


def moment(measures):
    return Moment(measures, {"reactive": STORMY, "proactive": CALM})


def asked(instrument, measures, model=MODEL, people=PEOPLE):
    items = load_instrument(instrument).items
    return [
        Respondent(model, 101, person).answers(items, "task_1", moment(measures))
        for person in range(people)
    ]


def mean(answers, item):
    return np.mean([own[item] for own in answers if own[item] is not None])


@pytest.mark.parametrize("name", instrument_names())
@pytest.mark.parametrize("measures", [CALM, STORMY, dict.fromkeys(MEASURES, 1.0)])
def test_every_answer_is_one_that_its_item_offers(name, measures):
    items = {item.id: item for item in load_instrument(name).items}
    for answers in asked(name, measures, people=5):
        assert list(answers) == list(items)
        for item_id, value in answers.items():
            assert items[item_id].checked(value) == value


def test_who_warned_a_lot_says_so_and_likes_the_robot_less():
    calm, stormy = (asked("experiment_1_task", measures) for measures in (CALM, STORMY))
    for item in ("warned_a_lot", "distracted_me", "competitive", "did_not_want_take_over"):
        assert mean(stormy, item) > mean(calm, item) + 0.5
    for item in ("trust", "understood_my_needs", "acted_as_expected"):
        assert mean(stormy, item) < mean(calm, item) - 0.3


def test_more_to_remember_is_a_larger_mental_demand_and_success_a_better_performance():
    easy, hard = (asked("nasa_tlx", {**CALM, "memory_load": load}) for load in (0.2, 0.8))
    assert mean(hard, "mental_demand") > mean(easy, "mental_demand") + 20
    failed = asked("nasa_tlx", {**CALM, "success": 0.2, "own_success": 0.2})
    assert mean(failed, "performance") > mean(easy, "performance") + 20  # 100 is "not at all"


def test_the_robot_that_was_warned_is_called_the_one_that_followed_rules():
    answers = asked("experiment_1_comparison", CALM)
    assert sum(own["followed_preset_rules"] == "reactive" for own in answers) > 0.8 * PEOPLE
    assert sum(own["adapted_better"] == "proactive" for own in answers) > 0.7 * PEOPLE


def test_a_comparison_with_a_robot_that_was_never_met_is_answered_too():
    items = load_instrument("experiment_1_comparison").items
    answers = Respondent(MODEL, 101).answers(items, "end", Moment())
    assert all(item.checked(answers[item.id]) == answers[item.id] for item in items)


def test_as_many_answers_are_left_out_as_the_model_says():
    often = replace(MODEL, missing=0.25)
    left_out = [
        value is None
        for answers in asked("experiment_1_task", CALM, often)
        for value in answers.values()
    ]
    assert 0.20 < np.mean(left_out) < 0.30
    never = asked("experiment_1_task", CALM, replace(MODEL, missing=0.0))
    assert all(value is not None for answers in never for value in answers.values())


def test_leaving_one_answer_out_changes_no_other():
    never = asked("experiment_1_task", CALM, replace(MODEL, missing=0.0))
    often = asked("experiment_1_task", CALM, replace(MODEL, missing=0.5))
    for whole, holed in zip(never, often, strict=True):
        assert all(value in (None, whole[item]) for item, value in holed.items())


def test_equal_seeds_give_equal_answers_and_others_give_others():
    items = load_instrument("experiment_1_task").items

    def of(seed, person, place):
        return Respondent(MODEL, seed, person).answers(items, place, moment(CALM))

    assert of(101, 1, "task_1") == of(101, 1, "task_1")
    assert of(101, 1, "task_1") != of(101, 1, "task_2")
    assert of(101, 1, "task_1") != of(101, 2, "task_1")
    assert of(101, 1, "task_1") != of(102, 1, "task_1")


def test_people_differ_in_how_they_answer_the_same():
    answers = asked("experiment_1_task", CALM)
    means = [np.mean([v for v in own.values() if v is not None]) for own in answers]
    assert np.std(means) > 0.1


def test_every_shipped_statement_demand_and_gesture_has_its_sentence():
    for name in instrument_names():
        for item in load_instrument(name).items:
            if item.kind == "likert":
                assert MODEL.statements[item.id].because
            if item.kind == "tlx":
                assert MODEL.demands[item.id].because
            if item.category == "gesture":
                assert sum(MODEL.choices[item.id].odds.values()) <= 1.0
                assert set(MODEL.choices[item.id].odds) <= set(item.labels)


SHIPPED = default_path().with_name("rehearsal.yaml").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("missing: 0.01", "missing: .nan", "missing"),
        ("missing: 0.01", "missing: 1.5", "missing: is 1.5"),
        ("shift: 0.25", "shift: -1", "style.shift"),
        ("weights: {warnings: 3.6}", "weights: {warning: 3.6}", "warning: is no measure"),
        ("weights: {warnings: 3.6}", "weights: {warnings: .inf}", "weights.warnings"),
        ("which: reacted_repetitively", "which: reacted", "names 'reacted'"),
        ("    whether: liked_collaborating\n", "", "wants one of which, whether and odds"),
        ("idle: 0.9", "idle: 0.99", "sum to 1.04"),
        ("comment: simulated", "remark: simulated", "comment: is missing"),
    ],
)
def test_a_bad_number_is_refused_with_its_place(tmp_path, old, new, words):
    assert old in SHIPPED
    path = tmp_path / "rehearsal.yaml"
    path.write_text(SHIPPED.replace(old, new), encoding="utf-8")
    with pytest.raises(DefinitionError) as caught:
        AnswerParameters.load(path)
    assert str(path) in str(caught.value)
    assert words in str(caught.value)
