# SPDX-License-Identifier: BSD-3-Clause
"""A visit: one step after the other, everything recorded once, nothing twice, nothing invented."""

import random

import pytest
from study_play import RunFolder, play, play_task, small_study

from fabric_study.event_journal import entry_of
from fabric_study.store import read_records
from fabric_study.study_data import load_study
from fabric_study.task_record import catch_up, row_of
from fabric_study.visit import Visit, begin_visit, next_index, people_of
from fabric_study.visit_state import KEYS, VisitError, VisitState

CODE = "K7QF2M"


@pytest.fixture
def study(tmp_path):
    with small_study(tmp_path) as study:
        yield study


@pytest.fixture
def visit(study):
    return Visit(study, CODE, 1.0, 0)


def go_to(visit, kind, study=None, run=None):
    """Finish steps until one of this kind is the next."""
    while visit.step.kind != kind:
        if visit.step.kind == "task":
            play_task(study, visit, run, lambda *told: None)
        visit.finish_step(2.0)


def kinds(study, since=0):
    return [record.kind for record in study.store.records[since:]]


def test_a_visit_begins_with_its_first_step_and_says_which_order_it_has(study, visit):
    opened, entered = study.store.records
    assert opened.content == {
        "protocol": study.protocol.hash,
        "index": 0,
        "conditions": list(study.protocol.condition_order(0, 101)),
        "simulated": False,
    }
    assert entered.content == {"step": visit.steps[0].id} == {"step": visit.step.id}
    assert {record.visit for record in study.store.records} == {CODE}


def test_an_answer_is_on_the_disk_when_given_and_the_last_one_counts(study, visit):
    go_to(visit, "instrument")
    assert visit.answer(3.0, "age", 30)
    assert read_records(study.folder)[-1].content["value"] == 30
    assert visit.answer(3.5, "age", 31)
    assert visit.answers == {"age": 31}
    visit.finish_step(4.0)
    answers = load_study(study.folder).answers
    assert list(answers[answers["item"] == "age"]["value"]) == [31]


def test_an_answer_given_again_is_no_news_and_leaves_no_record(study, visit):
    go_to(visit, "instrument")
    visit.answer(3.0, "age", 30)
    before = len(study.store.records)
    assert not visit.answer(3.1, "age", 30)
    assert len(study.store.records) == before


def test_what_was_not_answered_is_recorded_as_missing(study, visit):
    go_to(visit, "instrument")
    visit.answer(3.0, "age", 30)
    assert visit.missing() == ("hand",)
    before = len(study.store.records)
    visit.finish_step(4.0)
    assert kinds(study, before) == ["answer", "step_done", "step_entered"]
    missing = study.store.records[before].content
    assert (missing["item"], missing["value"]) == ("hand", None)


def test_items_are_shuffled_by_person_and_step_and_stay_so(study, visit):
    run = RunFolder(study.new_run())
    orders = {}
    while visit.step:
        if visit.step.instrument == "after":
            orders[visit.step.id] = [item.id for item in visit.items()]
            assert [item.id for item in Visit(study, CODE).items()] == orders[visit.step.id]
        if visit.step.kind == "task":
            play_task(study, visit, run, lambda *told: None)
        visit.finish_step(2.0)
    assert all(sorted(order) == ["bored", "tired", "trust"] for order in orders.values())
    assert len({tuple(order) for order in orders.values()}) > 1


def test_the_last_step_closes_the_visit_and_nothing_but_notes_comes_after(study, visit):
    play(study, visit, RunFolder(study.new_run()))
    assert (visit.status, visit.step) == ("finished", None)
    assert study.store.records[-1].kind == "visit_closed"
    for late in (
        lambda: visit.finish_step(9.0),
        lambda: visit.answer(9.0, "age", 30),
        lambda: visit.pause(9.0),
        lambda: visit.close(9.0, "aborted", "late"),
    ):
        with pytest.raises(VisitError, match="finished"):
            late()
    visit.note(9.0, "said later that the lamp was too bright")
    assert study.store.records[-1].kind == "note"


def test_a_task_is_recorded_event_by_event_and_done_with_its_row(study, visit):
    go_to(visit, "task")
    before = len(study.store.records)
    play_task(study, visit, RunFolder(study.new_run()), lambda *told: None)
    assert kinds(study, before) == ["task_begun"] + ["task_event"] * 5 + ["task_done"]
    assert visit.attempt.row["task"] == 1
    visit.finish_step(5.0)


def begun(study, visit):
    go_to(visit, "task")
    run = RunFolder(study.new_run())
    visit.task_begun(3.0, run.path.name, 1)
    return [entry_of(event) for event in run.events(visit.attempt.seed)]


def test_an_event_told_again_is_no_news_and_one_too_many_is_refused(study, visit):
    entries = begun(study, visit)
    assert visit.task_event(3.0, entries[0])
    assert not visit.task_event(3.0, entries[0])
    with pytest.raises(VisitError, match="event 3 of run 1: 2 must come next"):
        visit.task_event(3.0, entries[2])
    with pytest.raises(VisitError, match="event 2 of run 1: is of task 9, not of 1"):
        visit.task_event(3.0, {**entries[1], "task": 9})
    assert visit.task_events(3.0, entries) == 4
    assert visit.task_events(3.0, entries) == 0
    assert [event["sequence"] for event in visit.attempt.events] == [1, 2, 3, 4, 5]


def test_a_row_without_its_last_event_or_of_another_task_is_refused(study, visit):
    entries = begun(study, visit)
    row = row_of(study.folder / "runs" / "1", 1)
    visit.task_events(3.0, entries[:-1])
    with pytest.raises(VisitError, match="its row comes before the event of its end"):
        visit.task_done(4.0, row)
    visit.task_events(3.0, entries)
    for key, value in (("task", 2), ("seed", 0)):
        with pytest.raises(VisitError, match=f"{key} of its row is {value}"):
            visit.task_done(4.0, {**row, key: value})
    with pytest.raises(VisitError, match="must have the columns of results.csv"):
        visit.task_done(4.0, {"task": 1, "seed": row["seed"]})
    with pytest.raises(VisitError, match="its task is not"):
        visit.finish_step(4.0)
    assert visit.task_done(4.0, row)
    assert not visit.task_done(4.0, row)
    visit.finish_step(4.0)


def test_an_aborted_task_is_tried_again_with_other_cubes(study, visit):
    go_to(visit, "task")
    first = visit.task_seed
    visit.task_begun(3.0, "1", 1)
    assert visit.attempt.seed == first
    visit.task_aborted(4.0, "cube fell down")
    second = visit.task_seed
    assert second != first
    visit.task_begun(5.0, "1", 2)
    assert visit.attempt.seed == second
    assert Visit(study, CODE).attempt == visit.attempt


def test_a_task_is_caught_up_with_only_when_its_end_and_its_whole_row_are_there(study, visit):
    entries = begun(study, visit)
    run = study.folder / "runs" / "1"
    journal, results = run / "events.jsonl", run / "results.csv"
    lines, whole = journal.read_bytes().splitlines(keepends=True), results.read_bytes()
    aborted = lines[-1].replace(b"task_succeeded", b"task_aborted")
    results.write_bytes(whole[:-9])  # torn by a kill
    journal.write_bytes(b"".join(lines[:3]) + lines[3][:20])
    assert not catch_up(visit, 4.0, study.folder)
    assert visit.attempt.events == entries[:3]
    results.write_bytes(whole)  # the recorder writes rows of aborted tasks, too
    journal.write_bytes(b"".join([*lines[:-1], aborted]))
    assert not catch_up(visit, 4.0, study.folder)
    assert visit.task_running
    visit.task_aborted(5.0, "stopped")
    assert not catch_up(visit, 6.0, study.folder)


def test_no_task_begins_in_a_break_and_none_twice(study, visit):
    go_to(visit, "task")
    visit.pause(3.0)
    assert Visit(study, CODE).paused
    with pytest.raises(VisitError, match="the visit is paused"):
        visit.task_begun(3.0, "1", 1)
    visit.resume(4.0)
    visit.task_begun(4.0, "1", 1)
    with pytest.raises(VisitError, match="has begun before and was not aborted"):
        visit.task_begun(4.0, "1", 2)


def test_closing_early_aborts_the_running_task_first(study, visit):
    go_to(visit, "task")
    visit.task_begun(4.0, "1", 1)
    before = len(study.store.records)
    visit.close(5.0, "aborted", "felt unwell")
    assert kinds(study, before) == ["task_aborted", "visit_closed"]
    assert Visit(study, CODE).status == "aborted"


WRONG = [
    (lambda v: v.answer(2.0, "age", 30), "step start_1 is no instrument"),
    (lambda v: v.task_begun(2.0, "1", 1), "step start_1 is no task"),
    (lambda v: v.task_done(2.0, {}), "step start_1 is no task"),
    (lambda v: v.finish_step(2.0, "task_1"), "step 'task_1' is not what K7QF2M is doing"),
    (lambda v: v.resume(2.0), "the visit is resumed, but was not paused"),
    (lambda v: v.close(2.0, "finished", ""), "the visit is finished before step start_1"),
    (lambda v: v.close(2.0, "asleep", ""), "status is 'asleep'; allowed are"),
    (lambda v: v.note(2.0, 7), "note: 7 is no text"),
]


@pytest.mark.parametrize("deed, complaint", WRONG, ids=[text for _, text in WRONG])
def test_what_cannot_happen_now_is_refused_and_leaves_no_trace(study, visit, deed, complaint):
    before, step = len(study.store.records), visit.step
    with pytest.raises(VisitError, match=complaint):
        deed(visit)
    assert (len(study.store.records), visit.step) == (before, step)
    visit.finish_step(3.0)


@pytest.mark.parametrize("item, value", [("age", 15), ("age", "x"), ("hand", "up"), ("eye", 1)])
def test_an_answer_that_is_not_offered_is_refused_with_step_and_item(study, visit, item, value):
    go_to(visit, "instrument")
    before = len(study.store.records)
    with pytest.raises(VisitError, match=f"start_demographics: .*{item}"):
        visit.answer(2.0, item, value)
    assert len(study.store.records) == before


def test_somebody_unknown_cannot_resume_and_an_index_is_of_one_person(study, visit):
    with pytest.raises(VisitError, match="nobody is called 'W7QF2M'"):
        Visit(study, "W7QF2M")
    with pytest.raises(VisitError, match="K7QF2M has index 0, not 1"):
        Visit(study, CODE, 2.0, 1)
    with pytest.raises(VisitError, match="index 0 is that of K7QF2M"):
        Visit(study, "W7QF2M", 2.0, 0)
    with pytest.raises(VisitError, match="'Ada Lovelace' is no code"):
        Visit(study, "Ada Lovelace", 2.0, 1)


def test_an_index_is_given_again_only_when_its_visit_was_aborted(study):
    rng = random.Random(101)
    visits = [begin_visit(study, 1.0, rng) for _ in range(3)]
    assert [visit.index for visit in visits] == [0, 1, 2]
    visits[1].close(2.0, "aborted", "did not come back")
    assert next_index(study.store.records) == 1
    assert begin_visit(study, 3.0, rng).index == 1
    assert begin_visit(study, 3.0, rng).index == 3
    statuses = [status for _, status in people_of(study.store.records).values()]
    assert statuses == ["open", "aborted", "open", "open", "open"]


def test_visits_of_two_people_in_turns_do_not_mix(study):
    rng = random.Random(101)
    first, second = (begin_visit(study, 1.0, rng) for _ in range(2))
    for visit, age in ((first, 20), (second, 30)):
        visit.finish_step(2.0)
        visit.answer(2.0, "age", age)
    assert Visit(study, first.person).answers == {"age": 20}
    assert Visit(study, second.person).answers == {"age": 30}


def test_every_kind_of_record_is_checked_for_its_keys(study):
    for kind, keys in KEYS.items():
        state = VisitState(study.protocol, 101, False)
        with pytest.raises(VisitError):
            state.apply(kind, dict.fromkeys([*keys, "colour"]))
    with pytest.raises(VisitError, match="'colour' is no kind of record"):
        VisitState(study.protocol, 101, False).apply("colour", {})
