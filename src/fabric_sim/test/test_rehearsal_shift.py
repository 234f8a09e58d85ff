# SPDX-License-Identifier: BSD-3-Clause
"""A visit's tasks: one person who goes on from task to task, beside robots that change."""

from __future__ import annotations

from dataclasses import replace

import pytest

from fabric_sim.character import Character
from fabric_sim.rehearsal.experience import MEASURES, of_several, of_task
from fabric_sim.rehearsal.robots import Robots
from fabric_sim.rehearsal.shift import Shift

PERSON = Character(0.6, 0.7, 0.6, 0.3)


@pytest.fixture(scope="module")
def robots():
    return Robots(["none", "reactive", "abps"])


def tasks(robots, seed, policies):
    shift = Shift(PERSON, seed, robots)
    return [shift.play("sorting", policy) for policy in policies]


def test_equal_seeds_give_equal_tasks_and_others_give_others(robots):
    policies = ["none", "reactive", "reactive"]
    assert tasks(robots, 101, policies) == tasks(robots, 101, policies)
    assert tasks(robots, 101, policies) != tasks(robots, 102, policies)


def test_a_person_alone_is_neither_helped_nor_disturbed(robots):
    (alone,) = tasks(robots, 101, ["none"])
    assert alone.row["policy"] == "none"
    assert alone.row["robot_succeeded"] == alone.row["warnings"] == alone.interferences == 0
    measures = of_task(alone, PERSON)
    assert measures["helped"] == measures["warnings"] == measures["refused"] == 0.0


def test_the_person_tires_over_the_tasks_and_their_numbers_go_on(robots):
    done = tasks(robots, 101, ["none", "reactive", "none", "reactive"])
    assert [task.row["task"] for task in done] == [1, 2, 3, 4]
    stamina = [task.person.stamina for task in done]
    assert stamina == sorted(stamina, reverse=True)
    assert stamina[-1] < PERSON.stamina
    assert len({task.row["seed"] for task in done}) == 4


def test_refusals_are_among_the_interferences_of_the_same_task(robots):
    done = tasks(robots, 101, ["reactive"] * 4)
    assert all(0 <= task.refusals <= task.interferences for task in done)
    assert sum(task.refusals for task in done) > 0


def test_abps_learns_over_the_tasks_of_a_visit(robots):
    done = tasks(robots, 101, ["abps"] * 4)
    entropy = [task.row["type_belief_entropy"] for task in done]
    assert all(value is not None for value in entropy)
    assert len(set(entropy)) == 4


def test_an_unknown_policy_or_definition_is_refused_by_name(robots):
    with pytest.raises(ValueError, match="no-such-robot"):
        Robots(["no-such-robot"])
    with pytest.raises(ValueError, match="no-such-task"):
        Shift(PERSON, 101, robots).play("no-such-task", "none")


def test_measures_of_a_task_lie_between_none_and_all(robots):
    for task in tasks(robots, 103, ["none", "reactive", "reactive"]):
        measures = of_task(task, PERSON)
        assert list(measures) == list(MEASURES)
        assert all(0.0 <= value <= 1.0 for value in measures.values())


def test_fewer_warnings_than_before_are_calmer(robots):
    (task,) = tasks(robots, 101, ["reactive"])
    stormy, calm = (
        of_task(replace(task, row={**task.row, "warnings": warnings}), PERSON)
        for warnings in (8, 0)
    )
    assert of_several([stormy, calm])["calmer"] > 0.5
    assert of_several([calm, stormy])["calmer"] < -0.5
    assert of_several([calm])["calmer"] == 0.0
