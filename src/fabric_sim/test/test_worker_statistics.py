# SPDX-License-Identifier: BSD-3-Clause
"""Many tasks: what distinguishes types, days and the company of a robot."""

import functools

import numpy as np
import pytest
from scripted_task import (
    T_MAX,
    day_alone,
    first_left,
    mean,
    new_person,
    run_alone,
    run_helped,
)

from fabric_sim.character import CORNERS, Character
from fabric_sim.experiments.recorded_types import RECORDED

TASKS = 150
SEEDS, TASKS_A_SEED = range(101, 121), 40


@functools.cache
def alone(character):
    return [run_alone(new_person(character), seed) for seed in range(TASKS)]


@functools.cache
def helped(character):
    return [run_helped(new_person(character), seed) for seed in range(TASKS)]


def success(records):
    return mean(record.success for record in records)


def corner(**dials):
    return Character(1, 1, 1, 1).with_dials(**dials)


def test_experts_succeed_nearly_always_and_beginners_clearly_less():
    assert success(alone(corner())) > 0.97
    assert success(alone(corner(stamina=0))) > 0.85
    assert 0.3 < success(alone(corner(expertise=0))) < 0.8
    assert success(alone(corner(expertise=0, stamina=0))) < 0.5


# -- monotone dials: the same seeds for every value of a dial --

BASES = (
    Character(0.5, 0.5, 0.5, 0.5),
    corner(),
    corner(expertise=0.2),
    Character(0.5, 0.2, 0.9, 0),
)
STEPS = (0.0, 0.5, 1.0)


def by_seed(run, character, measure, tasks=TASKS_A_SEED):
    """Mean of a measure for each seed, (seeds,); the people of a seed meet the same chances."""
    return np.array(
        [
            mean(measure(run(new_person(character), 1000 * seed + k)) for k in range(tasks))
            for seed in SEEDS
        ]
    )


def rises(series, slack):
    """Whether the means of a series over seeds never fall by more than the slack."""
    means = [values.mean() for values in series]
    return all(high >= low - slack for low, high in zip(means, means[1:], strict=False))


@pytest.mark.parametrize("base", BASES, ids=lambda base: base.name)
@pytest.mark.parametrize("dial", ["expertise", "stamina", "attention"])
def test_a_higher_dial_never_lowers_success(dial, base):
    series = [
        by_seed(run_alone, base.with_dials(**{dial: x}), lambda record: record.success)
        for x in STEPS
    ]
    assert rises(series, slack=0.01)


@pytest.mark.parametrize("base", BASES, ids=lambda base: base.name)
@pytest.mark.parametrize("dial", ["expertise", "stamina", "attention"])
def test_a_higher_dial_never_makes_a_task_longer(dial, base):
    series = [
        -by_seed(run_alone, base.with_dials(**{dial: x}), lambda record: record.duration)
        for x in STEPS
    ]
    assert rises(series, slack=0.3)


@pytest.mark.parametrize("base", [corner(expertise=0), Character(0.5, 0.5, 0, 0)])
def test_more_collaborativeness_never_raises_the_refusals(base):
    series = [
        -by_seed(
            run_helped, base.with_dials(collaborativeness=x), lambda record: record.refusals, 6
        )
        for x in STEPS
    ]
    assert rises(series, slack=0.02)
    assert series[-1].mean() > series[0].mean() + 0.2


# -- beside a robot --


def refused(records):
    return sum(r.refusals for r in records) / sum(r.interferences for r in records)


def test_reluctance_brings_warnings():
    for rest in (corner(expertise=0), corner(attention=0, expertise=0.5)):
        low = rest.with_dials(collaborativeness=0.0)
        assert refused(helped(low)) > refused(helped(rest)) + 0.2


def test_a_robot_that_takes_over_late_helps_whoever_needs_it():
    for character in CORNERS.values():
        assert success(helped(character)) >= success(alone(character)) - 0.03
    assert success(helped(corner(expertise=0, stamina=0))) > 0.8
    assert mean(not record.by_person for record in helped(corner())) < 0.05


# -- breaks and days --


@pytest.mark.parametrize("name", sorted(CORNERS))
def test_nobody_walks_away_at_the_very_start(name):
    left = [first_left(record) for record in alone(CORNERS[name])]
    early = [t for t in left if t is not None and t < 5.0]
    assert len(early) <= 0.05 * TASKS
    assert all(t > 1.0 for t in left if t is not None)


def test_the_tired_leave_and_the_rested_do_not():
    def leaving(character):
        return mean(first_left(record) is not None for record in alone(character))

    assert leaving(corner(expertise=0, stamina=0)) > 0.3
    assert leaving(corner(expertise=0)) < 0.02


def test_a_day_alone_wears_people_out():
    for character in (corner(expertise=0), Character(0.5, 0.5, 0.5, 0.5)):
        rates = day_alone(character, 60, 3)
        assert rates[3] < rates[0] - 0.02


# -- beside the recordings --


@pytest.mark.parametrize("recorded", RECORDED, ids=lambda recorded: recorded.name)
def test_grasps_of_the_recorded_types_lift_as_often_as_recorded(recorded):
    outcomes = [lifted for record in alone(recorded.character) for lifted in record.attempts]
    least, most = recorded.lifted
    chance = 3.0 * np.sqrt(0.25 / len(outcomes))
    assert least - 0.05 - chance < mean(outcomes) < most + 0.05 + chance


def test_a_lost_package_is_lost_at_the_time_limit():
    records = alone(corner(expertise=0, stamina=0))
    assert {record.success for record in records} == {True, False}
    assert all(r.duration == pytest.approx(T_MAX) for r in records if not r.success)
