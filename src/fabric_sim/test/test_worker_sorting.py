# SPDX-License-Identifier: BSD-3-Clause
"""People who sort: what they remember of a task's rules, and how they answer help by scenario."""

from dataclasses import replace

import numpy as np
import pytest
from worker_bench import EXPERT, MIDDLING, PARAMETERS, RULES, Bench, new_worker

from fabric_sim.character import Character, named_generator
from fabric_sim.worker_events import EventKind
from fabric_sim.worker_parameters import SCENARIOS
from fabric_sim.worker_responses import RuleMemory, refusal_probability

WILLING = MIDDLING.with_dials(collaborativeness=1)
STUBBORN = MIDDLING.with_dials(collaborativeness=0)
ORIGINS = tuple(PARAMETERS.responses.refusal_shift)

#: Round numbers, so that answers can be worked out by hand whatever worker.yaml says.
ROUND = replace(
    PARAMETERS.responses,
    person_counts={"inspection": 1.0, "sorting": 2.0},
    origin_counts={"inspection": 1.0, "sorting": 0.5},
    own_credit={"inspection": 0.0, "sorting": 1.5},
    refusal_shift={"evaluating": 1.5, "no_attention": 1.2},
    distraction_relief=2.4,
    distraction_time=24.0,
)
MEMORY = replace(
    PARAMETERS.memory,
    known=0.9, inexperience=0.6, distraction=0.2, learns=0.2, taught=0.5, forgets=0.3,
)  # fmt: skip


# -- memory --


def sorts(worker, number):
    """Begin task `number` by the same rules; return what is known of each colour."""
    worker.start_task(0.0, "sorting", named_generator(number, "worker"), RULES)
    return [worker._memory.knows(colour) for colour in RULES]


def deals_with(worker, colour, by_person, success=True):
    worker.start_subtask(1.0, colour)
    worker.end_subtask(2.0, success, by_person)
    return worker._memory.knows(colour)


def test_what_is_known_at_first_is_the_hand_worked_value():
    memory = RuleMemory(RULES, Character(0.5, 1.0, 0.25, 1.0), MEMORY)
    assert memory.knows(1) == pytest.approx(0.9 - 0.6 * 0.5 - 0.2 * 0.75)
    hopeless = replace(MEMORY, inexperience=1.0, distraction=1.0)
    assert RuleMemory(RULES, Character(0, 0, 0, 0), hopeless).knows(1) == 0.0
    assert memory.knows("no rule") == 1.0


def test_a_right_placement_is_learnt_and_fades_for_the_inattentive():
    memory = RuleMemory((1, 2, 3), Character(0.5, 1.0, 0.5, 1.0), MEMORY)  # knows .5
    memory.saw(1, by_person=True)
    assert memory.knows(1) == pytest.approx(0.5 + 0.2 * 0.5)
    assert memory.knows(2) == pytest.approx(0.5 * (1.0 - 0.3 * 0.5))
    attentive = RuleMemory((1, 2), Character(0.5, 1.0, 1.0, 1.0), MEMORY)
    attentive.saw(1, by_person=True)
    assert attentive.knows(2) == pytest.approx(0.6)


def test_the_robots_right_placement_teaches_more_than_ones_own():
    own, taught = (RuleMemory((1, 2), Character(0.5, 1.0, 0.5, 1.0), MEMORY) for _ in range(2))
    own.saw(1, by_person=True)
    taught.saw(1, by_person=False)
    assert own.knows(1) == pytest.approx(0.5 + 0.2 * 0.5)
    assert taught.knows(1) == pytest.approx(0.5 + 0.5 * 0.5)
    assert taught.knows(2) == own.knows(2)


def test_a_worker_learns_from_right_placements_alone_and_most_from_the_robots():
    own, robots, wrong = (new_worker(MIDDLING) for _ in range(3))
    (before,) = {tuple(sorts(worker, 1)) for worker in (own, robots, wrong)}
    gained = [
        deals_with(worker, 1, by_person, success) - before[0]
        for worker, by_person, success in (
            (own, True, True), (robots, False, True), (wrong, True, False),
        )
    ]  # fmt: skip
    p = PARAMETERS.memory
    assert gained == pytest.approx([p.learns * (1 - before[0]), p.taught * (1 - before[0]), 0.0])


def test_the_rules_are_new_in_every_task_even_if_they_are_the_same():
    worker = new_worker(MIDDLING)
    before = sorts(worker, 1)
    for colour in RULES:
        deals_with(worker, colour, by_person=False)
    worker.end_task(3.0, success=True)
    # What is left is practice of the person, a little, and tiredness, which takes expertise.
    assert sorts(worker, 2) == pytest.approx(before, abs=0.02)


def first_is_wrong(character, tasks):
    """Share of the first cubes of `tasks` people that go into a wrong tray."""
    mistakes = 0
    for seed in range(101, 101 + tasks):
        bench = Bench(character, seed, "sorting")
        bench.run_until(lambda w, b=bench: EventKind.PLACED_CUBE in b.kinds())
        placed = bench.events[-1]
        assert placed.container in RULES.values()
        assert placed.correct == (placed.container == RULES[1])
        mistakes += not placed.correct
    return mistakes / tasks


def test_who_does_not_know_the_tray_guesses_among_all():
    for character, tasks in ((EXPERT, 300), (EXPERT.with_dials(expertise=0), 150), (MIDDLING, 150)):
        expected = (1.0 - RuleMemory(RULES, character, PARAMETERS.memory).knows(1)) * 2.0 / 3.0
        spread = np.sqrt(expected * (1.0 - expected) / tasks)
        assert first_is_wrong(character, tasks) == pytest.approx(expected, abs=3.0 * spread)


# -- answers to help --


def test_a_refusal_is_the_hand_worked_value():
    # ln(.2 / .8) = -1.3863; inspection + 1.5 = .1137; sorting 2 * -1.3863 + .75 + 1.5 = -.5226
    assert refusal_probability(0.2, "evaluating", 0.0, "inspection", ROUND) == pytest.approx(
        0.52839, abs=1e-5
    )
    assert refusal_probability(0.2, "evaluating", 0.0, "sorting", ROUND) == pytest.approx(
        0.37224, abs=1e-5
    )


def test_time_counts_for_the_distracted_as_much_as_the_place_does():
    # after 24 s the shift is 1.2 - 2.4 = -1.2: sorting 2 * -1.3863 - .6 + 1.5 = -1.8726
    assert refusal_probability(0.2, "no_attention", 24.0, "sorting", ROUND) == pytest.approx(
        0.13325, abs=1e-5
    )
    assert refusal_probability(0.2, "no_attention", 99.0, "sorting", ROUND) == pytest.approx(
        0.13325, abs=1e-5
    )


@pytest.mark.parametrize(
    ("factor", "values"),
    [("person_counts", (0.0, 4.0)), ("origin_counts", (0.0, 2.0)), ("own_credit", (-1.0, 3.0))],
)
def test_each_factor_acts_in_its_own_scenario_only(factor, values):
    given = getattr(ROUND, factor)
    found = {scenario: set() for scenario in SCENARIOS}
    for value in values:
        p = replace(ROUND, **{factor: {**given, "sorting": value}})
        for scenario, answers in found.items():
            answers.add(refusal_probability(0.2, "evaluating", 0.0, scenario, p))
    assert len(found["inspection"]) == 1
    assert len(found["sorting"]) == 2


def test_credit_for_ones_own_cubes_makes_refusals_likelier():
    answers = [
        refusal_probability(0.2, "evaluating", 0.0, "sorting", replace(ROUND, own_credit=credit))
        for credit in ({"sorting": -1.0}, {"sorting": 0.0}, {"sorting": 1.0})
    ]
    assert answers == sorted(answers)
    assert answers[0] < answers[2]


def refusals(character, scenario):
    return [new_worker(character).person.refusal(origin, 0.0, scenario) for origin in ORIGINS]


def test_inspecting_people_answer_by_the_moment_and_sorting_people_by_who_they_are():
    willing, middling, stubborn = (
        {scenario: refusals(who, scenario) for scenario in SCENARIOS}
        for who in (WILLING, MIDDLING, STUBBORN)
    )
    for scenario in SCENARIOS:
        for least, between, most in zip(
            willing[scenario], middling[scenario], stubborn[scenario], strict=True
        ):
            assert least < between < most
    by_moment = {scenario: np.ptp(values) for scenario, values in middling.items()}
    by_person = {
        scenario: np.mean(stubborn[scenario]) - np.mean(willing[scenario]) for scenario in SCENARIOS
    }
    assert by_moment["inspection"] > by_person["inspection"]
    assert by_person["sorting"] > 2.0 * by_moment["sorting"]


def test_a_worker_answers_as_the_scenario_of_the_task_says():
    worker, answers = new_worker(MIDDLING), {}
    for number, scenario in enumerate(SCENARIOS):
        rules = RULES if scenario == "sorting" else None
        worker.start_task(0.0, scenario, named_generator(number, "worker"), rules)
        worker.start_subtask(0.0, 1)
        answers[scenario] = 1.0 - worker.acceptance(0.0)
    expected = {
        scenario: worker.person.refusal("task_assigned", 0.0, scenario) for scenario in SCENARIOS
    }
    assert answers == pytest.approx(expected)
    assert answers["sorting"] != pytest.approx(answers["inspection"])


# -- cognitive load --


@pytest.mark.parametrize(("load", "knows"), [(0.0, 1.0), (0.5, 0.75), (1.0, 0.5), (1.5, 0.25)])
def test_what_is_unknown_at_first_grows_with_the_load(load, knows):
    memory = RuleMemory(RULES, Character(0.5, 1.0, 0.5, 1.0), MEMORY, load)
    assert memory.knows(1) == pytest.approx(knows)


def test_what_fades_grows_with_the_load_and_never_beyond_all():
    memory = RuleMemory((1, 2), Character(1.0, 1.0, 0.0, 1.0), replace(MEMORY, forgets=0.4), 2.0)
    before = memory.knows(2)
    memory.saw(1, by_person=True)
    assert memory.knows(2) == pytest.approx(before * (1.0 - 0.8))
    heavy = RuleMemory((1, 2), Character(1.0, 1.0, 0.0, 1.0), replace(MEMORY, forgets=0.4), 3.0)
    heavy.saw(1, by_person=True)
    assert heavy.knows(2) == 0.0


@pytest.mark.parametrize("dials", [(0.3, 0.5, 0.7, 0.2), (0.9, 0.1, 0.1, 0.9)])
def test_a_load_of_one_changes_nothing_at_all(dials):
    person = Character(*dials)
    p = PARAMETERS.memory
    known = p.known - p.inexperience * (1.0 - person.expertise)
    known -= p.distraction * (1.0 - person.attention)
    assert RuleMemory(RULES, person, p).knows(1) == max(0.0, known)
