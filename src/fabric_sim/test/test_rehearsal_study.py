# SPDX-License-Identifier: BSD-3-Clause
"""A small protocol rehearsed from end to end: the folder, the store, the tables, the power."""

from __future__ import annotations

from dataclasses import replace

import pandas as pd
import pytest

from fabric_bringup.arguments import PROTOCOLS
from fabric_sim.rehearsal import power
from fabric_sim.rehearsal.people import Laboratory, play_visits
from fabric_sim.rehearsal.tables import study_of
from fabric_sim.rehearsal.visit_record import write_study
from fabric_study.protocol import load_protocol, protocol_names
from fabric_study.results import read_results
from fabric_study.store import read_records
from fabric_study.store_verify import verify
from fabric_study.study_data import load_study
from fabric_study.study_folder import StoreError, read_study

SMALL = """
title: {en: "Small", de: "Klein"}
people: 2
order: {kind: balanced, first: [alone]}
start:
  - text: {en: "Welcome.", de: "Willkommen."}
  - instrument: demographics
  - practice: {definition: sorting, policy: none}
conditions:
  alone:
    shown_as: {en: "alone", de: "allein"}
    definition: sorting
    policy: none
    tasks: 1
    after_task: [experiment_1_alone]
    after_condition: []
  reactive: {shown_as: {en: "R", de: "R"}, definition: sorting, policy: reactive, tasks: 1}
  proactive: {shown_as: {en: "P", de: "P"}, definition: sorting, policy: proactive, tasks: 1}
after_task: [experiment_1_task]
after_condition: [experiment_1_general]
end:
  - instrument: experiment_1_comparison
"""
PEOPLE = 2
SEED = 101


@pytest.fixture(scope="module")
def protocol(tmp_path_factory):
    path = tmp_path_factory.mktemp("protocol") / "small.yaml"
    path.write_text(SMALL, encoding="utf-8")
    return load_protocol(str(path))


@pytest.fixture(scope="module")
def laboratory(protocol):
    shipped = Laboratory.of(protocol, SEED)
    return replace(shipped, model=replace(shipped.model, missing=0.1))


@pytest.fixture(scope="module")
def visits(laboratory):
    return play_visits(laboratory, PEOPLE, 1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory, protocol, visits):
    folder = tmp_path_factory.mktemp("study") / "first"
    write_study(folder, protocol, SEED, visits)
    return folder


def contents(folder):
    return [(record.visit, record.kind, record.data) for record in read_records(folder)]


def test_every_step_of_the_protocol_is_played_in_its_order(protocol, visits):
    for visit in visits:
        assert [p.step for p in visit.steps] == list(protocol.visit_steps(visit.index, SEED))
        for played in visit.steps:
            assert (played.task is not None) == (played.step.kind == "task")
            assert (played.answers is not None) == (played.step.kind == "instrument")


def test_robots_come_in_balanced_order(folder):
    met = load_study(folder).people["order"].tolist()
    assert met.count("alone reactive proactive") == PEOPLE / 2
    assert met.count("alone proactive reactive") == PEOPLE / 2


def test_the_folder_proves_itself_and_says_that_people_are_simulated(folder):
    assert verify(folder).faults == []
    assert read_study(folder).simulated is True
    assert load_study(folder).simulated is True
    assert set(load_study(folder).people["status"]) == {"finished"}


def test_equal_seeds_give_equal_records_whatever_the_number_of_processes(
    tmp_path, laboratory, protocol, folder
):
    write_study(tmp_path / "again", protocol, SEED, play_visits(laboratory, PEOPLE, 2))
    assert contents(tmp_path / "again") == contents(folder)


def test_other_seeds_give_other_people(laboratory, visits):
    other = play_visits(replace(laboratory, seed=102), 1, 1)
    assert other[0].person != visits[0].person


def test_a_person_does_not_depend_on_how_many_come(laboratory, visits):
    assert play_visits(laboratory, 1, 1) == visits[:1]


def test_answers_that_were_left_out_are_recorded_as_missing(folder, visits):
    played = [v for visit in visits for p in visit.steps for v in (p.answers or {}).values()]
    stored = load_study(folder).answers["value"]
    assert 0.03 < stored.isna().mean() < 0.25
    assert stored.isna().sum() == sum(value is None for value in played)


def test_each_visit_has_a_run_folder_with_its_rows_and_events(folder, visits):
    for visit in visits:
        run = folder / "runs" / str(visit.index + 1)
        rows = read_results(run / "results.csv")
        assert [row["task"] for row in rows] == [1, 2, 3, 4]  # practice is the first
        assert rows[0]["policy"] == "none"


def test_tables_in_memory_are_those_of_the_folder(folder, protocol, visits):
    stored, played = load_study(folder), study_of(protocol, visits)
    codes = dict(zip(map(str, range(PEOPLE)), stored.people["person"], strict=True))
    for name in ("tasks", "answers"):
        own = getattr(played, name).replace({"person": codes})
        pd.testing.assert_frame_equal(own, getattr(stored, name), check_dtype=False)


@pytest.mark.parametrize(
    ("seed", "reason"), [(SEED, "holds visits already"), (102, "seed is 101, not 102")]
)
def test_a_folder_that_holds_a_study_is_refused(folder, protocol, visits, seed, reason):
    before = contents(folder)
    with pytest.raises(StoreError, match=reason):
        write_study(folder, protocol, seed, visits)
    assert contents(folder) == before


def test_power_compares_conditions_in_what_they_share(protocol, laboratory, monkeypatch):
    few = [m for m in power.MEASURES if m.column in ("human_contribution", "warnings")]
    monkeypatch.setattr(power, "MEASURES", few)
    monkeypatch.setattr(power, "SIZES", (6,))
    diligent = replace(laboratory, model=replace(laboratory.model, missing=0.0))
    study = study_of(protocol, play_visits(diligent, 4, 1))
    asked = study.answers[study.answers["item"].isin(["trust", "lost_attention"])]
    found = power.contrasts(replace(study, answers=asked), SEED, 1)
    pairs = {(c.measure, c.first, c.second) for c in found}
    assert ("human_contribution", "alone", "reactive") in pairs
    assert ("lost_attention", "alone", "reactive") in pairs
    assert ("trust", "reactive", "proactive") in pairs
    for measure in ("warnings", "trust"):
        assert not [pair for pair in pairs if pair[0] == measure and "alone" in pair]
    table = power.table_of(found)
    assert len(table) == len(found)
    assert table["power"].between(0.0, 1.0).all()


def test_with_one_condition_the_halves_of_its_tasks_are_compared():
    rows = pd.DataFrame({"person": ["a"] * 5, "condition": ["x"] * 5, "number": range(1, 6)})
    halves = power._halves(rows)
    assert halves["condition"].tolist() == [power.FIRST] * 2 + [power.LAST] * 2
    assert halves["number"].tolist() == [1, 2, 4, 5]


def test_the_command_offers_every_shipped_protocol():
    assert list(PROTOCOLS) == protocol_names()
