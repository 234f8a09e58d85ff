# SPDX-License-Identifier: BSD-3-Clause
"""The comparison with the recorded types: counting, gates, intervals, and what is printed."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from scripted_task import mean, new_person, run_helped

from fabric_sim.character import Character
from fabric_sim.experiments import recorded_types as rt
from fabric_sim.experiments.observed_worker import TaskRecord
from fabric_sim.experiments.recorded_types_report import RecordedTypes
from fabric_sim.worker_events import EventKind
from fabric_sim.worker_parameters import STATES

BEGINNER = rt.RECORDED[0]


def record(success=True, seconds=10.0, by_person=True, watched=0.0, **more):
    spent = dict.fromkeys(STATES, 0.0) | {
        "evaluating": seconds - watched,
        "robot_interfered": watched,
    }
    return TaskRecord(0.0, seconds, seconds, success, by_person, seconds=spent, **more)


def result(*records, recorded=BEGINNER):
    runs = [[one] for one in records]
    return rt.TypeResult(recorded, dict.fromkeys((*rt.ROBOTS, rt.ALONE), runs))


def line(type_result, name):
    return next(one for one in type_result.lines() if one.measure.startswith(name))


# -- counting --


def test_a_record_adds_up_to_the_task():
    for seed in range(101, 116):
        one = run_helped(new_person(Character(0, 0.5, 0.5, 0)), seed)
        assert sum(one.seconds.values()) == pytest.approx(one.ended - one.began)
        began = [event for event in one.events if event.kind is EventKind.STARTED_ACTION]
        assert one.actions == len(began) > 0
        warnings = [event for event in one.events if event.kind is EventKind.WARNED]
        assert one.refusals <= min(one.interferences, len(warnings))
        assert one.seconds["success"] == one.seconds["failure"] == 0.0


def test_an_observed_worker_acts_as_any_other():
    from test_worker import scripted  # noqa: PLC0415  # its events are the reference

    assert scripted(3) == scripted(3)
    person = new_person(Character(0, 0, 1, 0))
    first = run_helped(person, 104).events
    assert run_helped(new_person(Character(0, 0, 1, 0)), 104).events == first


def test_a_record_without_events_keeps_its_figures():
    one = run_helped(new_person(Character(0, 1, 1, 1)), 101)
    bare = one.without_events()
    assert bare.events == []
    assert replace(bare, events=one.events) == one


def test_watching_the_robot_counts_in_turns():
    one = record(watched=9.0, actions=3, refusals=1)
    assert rt.decisions(one) == pytest.approx(3 + 9.0 / rt.STEP)
    assert rt.steps_interfered([one, one]) == pytest.approx(2 + 18.0 / rt.STEP)


def test_a_lost_package_counts_the_time_limit():
    assert rt.seconds(record(success=False, seconds=58.0)) == rt.LOST_AFTER
    assert rt.seconds(record(seconds=12.5)) == 12.5


# -- gates --


@pytest.mark.parametrize(
    ("rate", "met"), [(0.70, False), (0.74, True), (0.78, True), (0.83, True), (0.86, False)]
)
def test_success_has_to_be_within_five_hundredths(rate, met):
    records = [record(success=k < 100 * rate) for k in range(100)]
    assert line(result(*records), "success").met is met


@pytest.mark.parametrize(
    ("time", "met"), [(29.0, False), (29.4, True), (43.6, True), (44.0, False)]
)
def test_time_has_to_be_within_a_fifth(time, met):
    assert line(result(record(seconds=time)), "time").met is met


@pytest.mark.parametrize(
    ("rate", "met"), [(0.22, False), (0.26, True), (0.37, True), (0.40, False)]
)
def test_a_recorded_range_is_left_by_its_nearest_end(rate, met):
    one = record(attempts=[k < 100 * rate for k in range(100)])
    assert line(result(one), "P(success").met is met


def test_answers_to_the_robot_are_not_judged_when_there_are_too_few():
    few, many = record(watched=4.5, refusals=1), record(seconds=500.0, watched=450.0, refusals=10)
    assert line(result(few), "P(warn").met is None
    assert line(result(many), "P(warn").met is True
    assert line(result(record()), "P(warn").met is None


def test_who_did_it_has_no_gate():
    assert line(result(record(by_person=False)), "done").met is None


# -- intervals --


def test_the_interval_of_a_mean_is_students():
    rng = np.random.default_rng(101)
    times = rng.normal(20.0, 4.0, 12)
    value, half = rt.jackknife(
        [[record(seconds=t)] for t in times], lambda rs: mean(map(rt.seconds, rs))
    )
    assert value == pytest.approx(times.mean())
    least, most = stats.t.interval(0.95, 11, times.mean(), stats.sem(times))
    assert half == pytest.approx((most - least) / 2)


def test_one_seed_has_no_interval():
    assert math.isnan(rt.jackknife([[record()]], lambda rs: 1.0)[1])


# -- measured and printed --


@pytest.mark.parametrize(
    ("arguments", "named"),
    [((0, [101], 1), "tasks"), ((1, [], 1), "seeds"), ((1, [101], 0), "jobs")],
)
def test_measuring_nothing_is_refused_by_name(arguments, named):
    with pytest.raises(ValueError, match=named):
        rt.measure(*arguments)


def test_what_is_measured_is_printed_and_equal_seeds_give_equal_figures(monkeypatch):
    monkeypatch.setattr(rt, "RECORDED", (rt.RECORDED[0], rt.RECORDED[3]))
    types = rt.measure(1, [101], 1)
    robot = rt.ROBOTS[-1]
    again = rt.run_job((types[0].recorded.character, robot, 101, 1))
    assert again == types[0].records[robot][0]
    report = RecordedTypes(types)
    text, page = report.text(), report.html()
    for recorded in rt.RECORDED:
        assert recorded.name in text
        assert recorded.name in page
    for measure in rt.MEASURES:
        assert measure.name in text
    for one in types:
        assert sum(one.occupancy().values()) == pytest.approx(1.0)
    rows = report.json_rows()
    assert len(rows) == len(types) * (len(rt.MEASURES) + 1)
    assert all(svg.startswith("<svg") for _, svg in report.figures())


def test_one_missed_gate_fails_the_comparison():
    good = result(*[record(seconds=36.0, success=k < 78, actions=5) for k in range(100)])
    judged = [one for one in good.lines() if one.met is not None]
    assert RecordedTypes([good]).passed is all(one.met for one in judged) is True
    bad = result(record(seconds=36.0, actions=5))
    assert not RecordedTypes([bad]).passed
    assert "beginner, rested: success" in RecordedTypes([bad]).verdict()
