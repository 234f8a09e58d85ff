# SPDX-License-Identifier: BSD-3-Clause
"""A visit as the pages go through it: what counts when, and that nothing is lost."""

from __future__ import annotations

import asyncio
import copy
from typing import Any

import pytest
from fake_cell import CUBES, GREEN, RED, ROBOT, STROOP, desk_of, fill, small_desk
from study_play import PLAN, write_plan

from fabric_study.codes import CODE
from fabric_study.protocol import load_protocol
from fabric_study.study_folder import open_study, reopen_study
from fabric_study.visit_state import VisitError
from fabric_study.web.desk import COMMANDS, Refused


@pytest.fixture
def world(tmp_path):
    return small_desk(tmp_path)


def opened(desk, index: int = 0) -> str:
    return asyncio.run(desk.open_visit(index, "de"))["person"]


def step(desk) -> dict[str, Any]:
    return desk.participant()["step"]


def answer(desk, at: str, item: str, value: Any) -> None:
    desk.answer(desk.participant()["visit"]["person"], at, item, value)


def to_task(desk) -> dict[str, Any]:
    """Go on until a task comes, leaving out every answer."""
    while step(desk)["kind"] != "task":
        desk.finish_step(step(desk)["id"], True)
    return step(desk)


def kinds(desk) -> list[str]:
    return [record.kind for record in desk._study.store.records]


def test_every_request_of_the_pages_has_a_method(world):
    desk, _ = world
    assert all(callable(getattr(desk, name)) for name in COMMANDS)


def test_a_visit_is_opened_under_a_random_code_with_its_language(world):
    desk, cell = world
    assert desk.participant()["visit"] is None
    person = opened(desk)
    assert CODE.fullmatch(person)
    visit = desk.participant()["visit"]
    assert (visit["person"], visit["language"], visit["status"]) == (person, "de", "running")
    assert cell.commands == [("person", person)]


def test_only_one_visit_is_open_and_what_cannot_be_meant_is_refused(world):
    desk, _ = world
    with pytest.raises(Refused, match="language"):
        asyncio.run(desk.open_visit(0, "fr"))
    with pytest.raises(Refused, match="0 or more"):
        asyncio.run(desk.open_visit(-1, "de"))
    person = opened(desk)
    with pytest.raises(Refused, match=person):
        opened(desk)
    with pytest.raises(Refused, match="open; finish"):
        asyncio.run(desk.continue_visit(person, "de"))


def test_no_visit_begins_while_the_robot_remembers_another_person(world):
    desk, cell = world
    cell.refuse["person"] = "abps/reset does not answer"
    with pytest.raises(Refused, match="abps/reset"):
        opened(desk)
    assert desk.participant()["visit"] is None
    assert "visit_opened" not in kinds(desk)


def test_an_answer_counts_for_the_step_that_is_shown_only(world):
    desk, _ = world
    opened(desk)
    desk.finish_step("start_1", False)
    with pytest.raises(Refused, match="moved on"):
        answer(desk, "start_1", "age", 30)
    answer(desk, "start_demographics", "age", 30)
    assert desk.participant()["questions"]["answers"] == {"age": 30}
    with pytest.raises(VisitError, match="age"):
        answer(desk, "start_demographics", "age", "thirty")
    with pytest.raises(Refused, match="moved on"):
        desk.finish_step("start_1", True)


def test_an_answer_that_comes_late_is_not_taken_for_the_next_persons(world):
    desk, _ = world
    first = opened(desk)
    desk.abort_visit("the tablet was lost")
    opened(desk)
    desk.finish_step("start_1", False)
    with pytest.raises(Refused, match="another visit"):
        desk.answer(first, "start_demographics", "age", 30)
    assert desk.participant()["questions"]["answers"] == {}


def test_missing_answers_are_asked_for_once_and_then_recorded_as_missing(world):
    desk, _ = world
    opened(desk)
    desk.finish_step("start_1", False)
    answer(desk, "start_demographics", "age", 30)
    assert desk.finish_step("start_demographics", False) == {"missing": ["hand"]}
    assert step(desk)["id"] == "start_demographics"
    assert desk.finish_step("start_demographics", True) == {"missing": []}
    last = [r.content for r in desk._study.store.records if r.kind == "answer"][-1]
    assert (last["item"], last["value"]) == ("hand", None)


def test_an_answer_that_was_taken_back_is_missing(world):
    desk, _ = world
    opened(desk)
    desk.finish_step("start_1", False)
    answer(desk, "start_demographics", "hand", "left")
    answer(desk, "start_demographics", "age", 30)
    answer(desk, "start_demographics", "age", None)
    assert desk.finish_step("start_demographics", False) == {"missing": ["age"]}


def test_rules_are_told_only_while_they_are_shown(world):
    desk, cell = world
    opened(desk)
    desk.ready(to_task(desk)["id"])
    desk.begin_task(step(desk)["id"])
    assert desk.participant()["task"] == {"phase": "waiting", "stopped": False}
    cell.show_rules(STROOP)
    shown = desk.participant()["task"]
    assert (shown["phase"], shown["items"][0]["word"], shown["items"][0]["ink"]) == (
        "rules",
        "red",
        "blue",
    )
    cell.start()
    told = desk.participant()["task"]
    assert told["phase"] == "running" and "items" not in told


def test_placements_are_told_without_right_or_wrong(world):
    desk, cell = world
    opened(desk)
    to_task(desk)
    desk.begin_task(step(desk)["id"])
    cell.show_rules()
    cell.start()
    cell.place(RED, "green")
    cell.place(GREEN, "green", by=ROBOT, right=False)
    told = desk.participant()["task"]
    assert told["placements"] == [
        {"number": 1, "colour": "red", "container": "green", "by": "person"},
        {"number": 2, "colour": "green", "container": "green", "by": "robot"},
    ]
    assert not {"result", "score", "events"} & set(told)
    assert [event["score"] for event in desk.console()["task"]["events"]] == [0, 10, -6]


def test_a_task_goes_from_ready_to_its_row_and_on(world):
    desk, cell = world
    opened(desk)
    task = to_task(desk)
    desk.begin_task(task["id"])
    cell.play()
    result = desk.participant()["task"]["result"]
    assert result == {
        "success_rate": round(1 / CUBES, 4),
        "duration": 95.0,
        "score": -2,
        "saved": True,
    }
    assert kinds(desk)[-1] == "task_done"
    desk.finish_step(task["id"], False)
    assert step(desk)["at"] == task["at"] + 1


def test_the_result_waits_for_the_row(world):
    desk, cell = world
    opened(desk)
    task = to_task(desk)
    desk.begin_task(task["id"])
    cell.show_rules()
    cell.start()
    cell.place(RED, "green")
    cell.end()
    assert desk.participant()["task"]["result"]["saved"] is False
    with pytest.raises(VisitError):
        desk.finish_step(task["id"], False)
    for _ in range(30):  # s
        desk.tick()
    assert "recorder" in desk.console()["task"]["problem"]
    cell.write_row()
    desk.tick()
    assert desk.participant()["task"]["result"]["saved"] is True
    assert desk.console()["task"]["problem"] == ""


def test_a_task_begins_by_itself_when_all_is_ready(tmp_path):
    desk, cell = small_desk(tmp_path, auto_start=True)
    cell.absent = ["node decision is silent"]
    opened(desk)
    desk.ready(to_task(desk)["id"])
    desk.tick()
    assert cell.goal is None
    assert "node decision is silent" in desk.console()["task"]["problem"]
    cell.absent = []
    desk.tick()
    assert cell.goal is not None and cell.goal.task_id == 1
    desk.tick()
    assert len(cell.goals) == 1


def test_without_leave_a_task_waits_for_the_experimenter(world):
    desk, cell = world
    opened(desk)
    desk.ready(to_task(desk)["id"])
    desk.tick()
    assert cell.goal is None
    assert desk.participant()["task"]["phase"] == "waiting"
    assert desk.console()["task"]["phase"] == "ready"
    desk.set_auto_start(True)
    desk.tick()
    assert cell.goal is not None


def test_a_begun_task_is_not_begun_again(world):
    desk, cell = world
    opened(desk)
    task = to_task(desk)["id"]
    desk.begin_task(task)
    for again in (desk.begin_task, desk.ready):
        with pytest.raises(Refused, match="has begun"):
            again(task)
    assert len(cell.goals) == 1


def test_an_aborted_task_is_tried_again_with_another_seed(world):
    desk, cell = world
    opened(desk)
    task = to_task(desk)["id"]
    desk.begin_task(task)
    cell.show_rules()
    desk.abort_task(" a cube fell down ")
    assert cell.cancelled == 1
    with pytest.raises(Refused, match="has begun"):
        desk.begin_task(task)  # not before the graph has ended it
    cell.abort()
    told = desk.participant()["task"]
    assert told == {"phase": "ready", "stopped": True}
    assert "a cube fell down" in desk.console()["task"]["problem"]
    desk.begin_task(task)
    assert [goal.task_id for goal in cell.goals] == [1, 2]
    assert cell.goals[0].seed != cell.goals[1].seed


def test_a_graph_that_does_not_end_a_task_does_not_hold_the_visit(world):
    desk, cell = world
    opened(desk)
    desk.begin_task(to_task(desk)["id"])
    cell.show_rules()
    desk.abort_task("stuck")
    for _ in range(10):  # s
        desk.tick()
    assert kinds(desk)[-1] == "task_aborted"
    with pytest.raises(Refused, match="task before has not ended"):
        desk.begin_task(step(desk)["id"])


def test_what_the_graph_refuses_is_told_and_can_be_tried_again(world):
    desk, cell = world
    opened(desk)
    desk.begin_task(to_task(desk)["id"])
    desk.task.on_refused(1, "abps/select failed")
    assert "abps/select failed" in desk.console()["task"]["problem"]
    assert desk.participant()["task"]["phase"] == "ready"
    desk.task.on_refused(1, "said twice")
    assert kinds(desk).count("task_aborted") == 1


def test_in_a_break_nothing_goes_on(world):
    desk, cell = world
    opened(desk)
    task = to_task(desk)["id"]
    desk.set_auto_start(True)
    desk.ready(task)
    desk.pause()
    desk.tick()
    assert cell.goal is None
    assert desk.participant()["visit"]["paused"]
    for request in (lambda: desk.begin_task(task), lambda: desk.finish_step(task, True)):
        with pytest.raises(Refused, match="paused"):
            request()
    desk.resume()
    desk.tick()
    assert cell.goal is not None


def test_an_answer_on_its_way_arrives_in_a_break(world):
    desk, _ = world
    opened(desk)
    desk.finish_step("start_1", False)
    desk.pause()
    answer(desk, "start_demographics", "age", 30)
    assert desk.participant()["questions"]["answers"] == {"age": 30}


def test_a_break_during_a_task_comes_after_it(world):
    desk, cell = world
    opened(desk)
    desk.begin_task(to_task(desk)["id"])
    cell.show_rules()
    desk.pause()
    assert not desk.participant()["visit"]["paused"]
    assert desk.console()["visit"]["paused"]
    cell.start()
    cell.place(RED, "green")
    cell.end()
    cell.write_row()
    desk.tick()
    assert desk.participant()["visit"]["paused"]


def test_an_aborted_visit_ends_its_task_and_frees_the_desk(world):
    desk, cell = world
    first = opened(desk)
    desk.begin_task(to_task(desk)["id"])
    cell.show_rules()
    with pytest.raises(Refused, match="word"):
        desk.abort_visit("  ")
    desk.abort_visit("felt unwell")
    assert cell.cancelled == 1
    assert kinds(desk)[-2:] == ["task_aborted", "visit_closed"]
    assert desk.participant()["visit"]["status"] == "aborted"
    assert opened(desk) != first


def test_a_whole_visit_ends_finished_and_can_be_verified(world):
    desk, cell = world
    opened(desk)
    desk.set_auto_start(True)
    while desk.participant()["visit"]["status"] == "running":
        task = to_task(desk)
        desk.ready(task["id"])
        desk.tick()
        cell.play()
        desk.finish_step(task["id"], False)
        while step(desk) and step(desk)["kind"] != "task":
            desk.finish_step(step(desk)["id"], True)
    assert desk.participant()["visit"]["status"] == "finished"
    assert len(cell.goals) == 5
    assert desk.console()["study"]["next_index"] == 1


def test_a_restart_takes_up_the_visit_with_its_language_and_answers(tmp_path):
    desk, _ = small_desk(tmp_path)
    person = opened(desk)
    desk.finish_step("start_1", False)
    answer(desk, "start_demographics", "age", 41)
    desk._study.close()
    again, _ = desk_of(reopen_study(tmp_path / "study"))
    told = again.participant()
    assert (told["visit"]["person"], told["visit"]["language"]) == (person, "de")
    assert told["questions"]["answers"] == {"age": 41}


@pytest.mark.parametrize("written", [True, False])
def test_a_restart_in_a_task_keeps_what_was_scored(tmp_path, written):
    desk, cell = small_desk(tmp_path)
    opened(desk)
    desk.begin_task(to_task(desk)["id"])
    desk.task.on_event = lambda: None  # this console hears nothing any longer
    desk.task.on_state = lambda state: None
    cell.show_rules()
    cell.place(RED, "green")
    if written:
        cell.end()
        cell.write_row()
    desk._study.close()
    again, _ = desk_of(reopen_study(tmp_path / "study"))
    assert kinds(again).count("task_event") == (3 if written else 2)
    assert kinds(again)[-1] == ("task_done" if written else "task_aborted")
    assert again.participant()["task"]["phase"] == ("ended" if written else "ready")


def test_an_unfinished_visit_of_before_can_be_continued(tmp_path):
    desk, _ = small_desk(tmp_path)
    first = opened(desk)
    desk._visit = None  # as after a restart in which somebody else came in between
    opened(desk, 1)
    desk.abort_visit("done for today")
    (waiting,) = desk.console()["study"]["open_visits"]
    assert waiting["person"] == first
    with pytest.raises(Refused, match="no open visit"):
        asyncio.run(desk.continue_visit("C2C2C2", "en"))
    asyncio.run(desk.continue_visit(first, "en"))
    assert desk.participant()["visit"]["person"] == first


def test_notes_are_kept_with_and_without_a_visit(world):
    desk, cell = world
    asyncio.run(desk.note("set up"))
    opened(desk)
    asyncio.run(desk.note("looks tired"))
    assert [note["text"] for note in desk.console()["notes"]] == ["looks tired", "set up"]
    assert ("note", "looks tired") in cell.commands


def test_stop_release_and_call_reach_the_graph(world):
    desk, cell = world
    asyncio.run(desk.stop())
    asyncio.run(desk.release())
    with pytest.raises(Refused, match="No task runs"):
        asyncio.run(desk.call())
    opened(desk)
    desk.begin_task(to_task(desk)["id"])
    cell.show_rules()
    cell.start()
    asyncio.run(desk.call())
    assert [name for name, _ in cell.commands] == ["stop", "release", "person", "call"]


def test_the_console_shows_what_the_graph_tells(world):
    desk, cell = world
    fill(cell.news)
    told = desk.console()
    assert told["belief"]["states"][4] == ["needs_help", 0.36]
    assert [d["action"] for d in told["decisions"]] == [
        "grasp",
        "planning",
        "idle",
        "point",
        "idle",
    ]
    assert told["decisions"][3]["flags"] == ["deadline missed"]
    assert told["types"]["types"][0][0].startswith("beginner_tired")
    assert told["safety"]["watched"][0] == ["decision", 0.1]
    assert told["health"]["missing"] == []


def test_only_a_robot_that_waits_for_a_call_can_be_called(tmp_path):
    plan = copy.deepcopy(PLAN)
    plan["start"][2]["practice"]["policy"] = "on_call"
    protocol = load_protocol(str(write_plan(tmp_path / "plan", plan)))
    desk, cell = desk_of(open_study(tmp_path / "study", protocol, 101, simulated=True))
    opened(desk)
    offered = []
    for _ in range(2):
        desk.begin_task(to_task(desk)["id"])
        cell.show_rules()
        cell.start()
        offered.append((step(desk)["practice"], desk.participant()["task"]["can_call"]))
        cell.place(RED, "red")
        cell.end()
        cell.write_row()
        desk.tick()
        desk.finish_step(step(desk)["id"], True)
    assert offered == [(True, True), (False, False)]


def test_the_experimenter_sees_which_cubes_the_task_needs(world):
    desk, cell = world
    opened(desk)
    task = to_task(desk)["id"]
    cubes = desk.console()["task"]["cubes"]
    assert len(cubes) == 10 and set(cubes) == {"red", "green", "blue"}
    desk.begin_task(task)
    assert desk.console()["task"]["cubes"] == cubes
    assert "cubes" not in desk.participant()["task"]


def test_silent_nodes_are_missed_by_name(world):
    _, cell = world
    assert "node task is silent" in cell.news.missing(10.0)
    fill(cell.news)
    assert cell.news.missing(10.0) == []
    assert "node recorder has fallen silent" in cell.news.missing(20.0)
