# SPDX-License-Identifier: BSD-3-Clause
"""People who sort beside recorded ones: figures of a task, means with intervals, the table."""

import numpy as np
import pytest

from fabric_sim.experiments import sorting_people
from fabric_sim.experiments.sorting_people import (
    ALONE,
    MEASURES,
    RATIO,
    ROBOTS,
    SortingPeople,
    figures,
    order_of,
)

NAMES = [measure.name for measure in MEASURES]
ROW = {
    "task_success_rate": 0.8,
    "human_success_rate": 0.75,
    "human_contribution": 0.6,
    "efficiency": 0.48,
    "warnings": 2,
    "discounted_reward": 14.5,
    "duration_s": 120.0,
}


def people(count=5, seed=101):
    return np.random.default_rng(seed).random((count, len(ROBOTS), len(MEASURES)))


def test_the_figures_of_a_task_stand_in_the_order_of_the_measures():
    found = dict(zip(NAMES, figures(ROW), strict=True))
    assert found["task success"] == 0.8
    assert found["contribution of the person"] == 0.6
    assert found["placed right by the robot, share"] == pytest.approx(0.2)
    assert found["duration, s"] == 120.0


def test_who_never_tried_has_no_success_of_the_own():
    found = dict(zip(NAMES, figures({**ROW, "human_success_rate": None}), strict=True))
    assert np.isnan(found["success of the person's own"])


def test_means_and_intervals_are_those_of_people():
    own = people()
    means, halves = SortingPeople(own, 101).means()
    assert means[:, :-1] == pytest.approx(own.mean(axis=0))
    standard_error = own.std(axis=0, ddof=1) / np.sqrt(5)
    assert halves[:, :-1] == pytest.approx(2.7764 * standard_error, rel=1e-4)  # t, 4 degrees


def test_a_person_without_a_figure_is_left_out_of_its_mean_only():
    own = people()
    own[0, 1, 1] = np.nan
    means, halves = SortingPeople(own, 101).means()
    assert means[1, 1] == pytest.approx(own[1:, 1, 1].mean())
    assert means[1, 0] == pytest.approx(own[:, 1, 0].mean())
    assert np.isfinite(halves[1, 1])


def test_the_ratio_is_that_of_the_means_and_undefined_where_nothing_was_asked():
    own = people()
    own[:, 0, [NAMES.index("placed right by the robot, share"), NAMES.index("warnings")]] = 0.0
    means, _ = SortingPeople(own, 101).means()
    placed, warned = (
        10.0 * means[1, NAMES.index("placed right by the robot, share")],
        means[1, NAMES.index("warnings")],
    )
    assert means[1, -1] == pytest.approx(placed / (placed + warned))
    assert np.isnan(means[0, -1])


def test_what_is_worked_out_of_the_published_means_agrees_with_them():
    published = {measure.name: measure.published for measure in (*MEASURES, RATIO)}
    for robot in (1, 2):
        success = published["task success"][robot]
        own = published["contribution of the person"][robot]
        placed = published["placed right by the robot, share"][robot]
        assert placed == pytest.approx(success - own)
        expected = 10.0 * placed / (10.0 * placed + published["warnings"][robot])
        assert published[RATIO.name][robot] == pytest.approx(expected, abs=0.001)


def test_the_table_sets_ours_beside_the_published():
    result = SortingPeople(people(), 101)
    table = result.table()
    assert table[0] == ["", *(word for r in ("alone", *ROBOTS[1:]) for word in (r, "published"))]
    assert [line[0] for line in table[1:]] == [*NAMES, RATIO.name]
    assert [line[2] for line in table[1:3]] == ["0.60", "0.60"]
    assert table[NAMES.index("warnings") + 1][2::2] == ["-", "6.8", "1.9"]
    rows = result.json_rows()
    assert len(rows) == len(ROBOTS) * (len(MEASURES) + 1)
    assert {row["robot"] for row in rows} == {"alone", *ROBOTS[1:]}


def test_every_other_person_meets_the_robots_in_the_other_order():
    assert list(order_of(0)) == [ALONE, "reactive", "proactive"]
    assert list(order_of(1)) == [ALONE, "proactive", "reactive"]


def test_one_person_alone_would_have_no_interval():
    with pytest.raises(ValueError, match="people: 1"):
        sorting_people.run(1, 101, 1)


def test_people_go_through_the_protocol_and_equal_seeds_do_equal_things(monkeypatch):
    monkeypatch.setattr(sorting_people, "TASKS", dict.fromkeys(ROBOTS, 1))
    first, second = (sorting_people.run(2, 101, jobs).people for jobs in (1, 2))
    assert first.shape == (2, len(ROBOTS), len(MEASURES))
    assert np.array_equal(first, second, equal_nan=True)
    alone = dict(zip(NAMES, first[:, 0].T, strict=True))
    assert not alone["warnings"].any()
    assert not alone["placed right by the robot, share"].any()
    assert np.array_equal(alone["task success"], alone["success of the person's own"])
    assert (first[:, :, NAMES.index("duration, s")] > 30.0).all()
