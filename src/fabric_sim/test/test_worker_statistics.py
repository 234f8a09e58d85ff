# SPDX-License-Identifier: BSD-3-Clause
"""Many tasks: what distinguishes types, days and the company of a robot."""

import functools

import pytest
from worker_bench import LIBRARY, PARAMETERS, new_worker

from fabric_sim.character import CORNERS, Character
from fabric_sim.worker_table import (
    RECORDED,
    T_MAX,
    decay,
    figures,
    print_tables,
    run_inspection,
)

TASKS = 150


@functools.cache
def of(character):
    return figures("", character, TASKS, 1, PARAMETERS, LIBRARY)


def corner(**dials):
    return Character(1, 1, 1, 1).with_dials(**dials)


def test_experts_succeed_nearly_always_and_beginners_clearly_less():
    assert of(corner()).success_alone > 0.97
    assert of(corner(stamina=0)).success_alone > 0.88
    assert 0.5 < of(corner(expertise=0)).success_alone < 0.85
    assert of(corner(expertise=0, stamina=0)).success_alone < 0.55


@pytest.mark.parametrize("dial", ["expertise", "stamina", "attention"])
def test_a_higher_dial_does_not_lower_success_nor_slow_down(dial):
    for rest in (corner(), Character(0.5, 0.5, 0.5, 0.5), corner(expertise=0.2)):
        low, high = of(rest.with_dials(**{dial: 0.0})), of(rest.with_dials(**{dial: 1.0}))
        assert high.success_alone >= low.success_alone - 0.03
        assert high.time_alone < low.time_alone + 0.5


def test_reluctance_brings_warnings():
    for rest in (corner(expertise=0), corner(attention=0, expertise=0.5)):
        low = of(rest.with_dials(collaborativeness=0.0))
        assert low.refused > of(rest).refused + 0.2


def test_a_robot_that_takes_over_late_helps_whoever_needs_it():
    for character in CORNERS.values():
        row = of(character)
        assert row.success_with_robot >= row.success_alone - 0.03
    assert of(corner(expertise=0, stamina=0)).success_with_robot > 0.85
    assert of(corner()).by_robot < 0.05


@pytest.mark.parametrize("name", sorted(CORNERS))
def test_nobody_walks_away_at_the_very_start(name):
    left = [
        run_inspection(new_worker(CORNERS[name], seed), seed).first_left for seed in range(TASKS)
    ]
    early = [t for t in left if t is not None and t < 5.0]
    assert len(early) <= 0.05 * TASKS
    assert all(t > 1.0 for t in left if t is not None)


def test_the_tired_leave_and_the_rested_do_not():
    def leaving(character):
        runs = [run_inspection(new_worker(character, seed), seed) for seed in range(TASKS)]
        return sum(run.first_left is not None for run in runs) / TASKS

    assert leaving(corner(expertise=0, stamina=0)) > 0.3
    assert leaving(corner(expertise=0)) < 0.02


def test_a_day_alone_wears_people_out():
    for character in (corner(expertise=0), Character(0.5, 0.5, 0.5, 0.5)):
        rates = decay(character, 40, 3, PARAMETERS, LIBRARY)
        assert rates[3] < rates[0] - 0.02


def test_figures_are_near_the_recorded_behaviour():
    for character, *_, (least, most) in RECORDED.values():
        assert least - 0.1 < of(character).success_per_grasp < most + 0.1


def test_a_lost_package_is_lost_at_the_time_limit():
    runs = [run_inspection(new_worker(corner(expertise=0, stamina=0), s), s) for s in range(20)]
    assert {run.success for run in runs} == {True, False}
    assert all(run.duration == pytest.approx(T_MAX) for run in runs if not run.success)


def test_the_table_prints_every_type(capsys):
    print_tables(4, 1, as_json=False)
    text = capsys.readouterr().out
    for name in (*CORNERS, *RECORDED):
        assert name in text
    print_tables(2, 1, as_json=True)
    assert capsys.readouterr().out.count("\n") == len(CORNERS) + 2 * len(RECORDED)
