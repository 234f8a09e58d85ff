# SPDX-License-Identifier: BSD-3-Clause
"""Take-overs in recordings: which they are, and what was known of the person then."""

from dataclasses import replace
from pathlib import Path

import genpy
import numpy as np
import pytest
import rosbag
from recording_helpers import robot, seen, tray

from fabric_msgs.msg import Decision, ModelInfo, Observation, TaskState
from fabric_planner.replay import ReplayError
from fabric_sim.batch_loop import Files
from fabric_sim.experiments.take_overs import ArgumentError, arguments, main, score
from fabric_sim.experiments.take_overs_read import Answer, Begin, answer, begins, read_folder
from fabric_sim.experiments.take_overs_report import json_of, text_of
from fabric_sim.experiments.take_overs_watch import Models, TakeOver, Watcher, watch_all
from fabric_sim.experiments.trials import write_rows

SHIPPED = Path(__file__).parents[1] / "recorded"

#: Two cubes: taken over, warned, taken over again and accepted; then taken over and accepted.
ROWS = [
    seen(1.0, idle=1),
    robot(1.1, "grasp"),  # first, begun
    seen(2.0, warning=1),
    robot(2.1, "cancel all actions"),
    seen(6.0, idle=1),
    robot(6.1, "grasp"),  # begun
    seen(8.0, idle=1),
    robot(8.1, "grasp"),  # goes on
    tray(12.0, "success", "robot"),
    robot(12.1, "grasp"),  # first of the next subtask, but goes on
    seen(14.0, looking_around=1),
    robot(14.1, "idle"),
    seen(16.0, warning=1),
    seen(17.0, grasp_attempt=1),
    tray(20.0, "success", "human"),
]  # fmt: skip


def recorded(folder, rows=ROWS, name="person01_task1_reactive.csv"):
    folder.mkdir(parents=True, exist_ok=True)
    write_rows(folder / name, rows)
    return folder


@pytest.fixture(scope="module")
def models():
    return Models.shipped(Files())


def steps_of(folder):
    (tasks,) = read_folder(folder).people.values()
    return tasks[0].recording.steps


def test_a_take_over_is_the_first_grasp_of_a_subtask_or_one_after_another_action(tmp_path):
    steps = steps_of(recorded(tmp_path))
    found = begins(steps)
    assert [steps[b.index].time for b in found] == [1.0, 6.0, 12.0]
    assert [(b.first, b.begun) for b in found] == [(True, True), (False, True), (True, False)]


def test_a_grasp_on_the_last_observation_of_a_task_is_no_take_over(tmp_path):
    rows = [seen(1.0, idle=1), seen(2.0, task_success=1), robot(2.1, "grasp")]
    assert begins(steps_of(recorded(tmp_path, rows))) == []


def test_the_answer_is_a_warning_before_the_next_placement_or_acceptance(tmp_path):
    steps = steps_of(recorded(tmp_path))
    answers = [answer(steps, begin.index) for begin in begins(steps)]
    assert answers == [
        Answer(False, "robot right"),
        Answer(True, "robot right"),
        Answer(False, "person right"),
    ]


def test_a_warning_after_the_placement_is_no_answer(tmp_path):
    rows = [seen(1.0), robot(1.1, "grasp"), tray(5.0, "fail", "robot"), seen(6.0, warning=1)]
    steps = steps_of(recorded(tmp_path, rows))
    assert begins(steps) == [Begin(0, True, True)]
    assert answer(steps, 0) == Answer(True, "robot wrong")


def test_a_warning_of_before_is_no_answer_although_a_tray_reports_while_it_lasts(tmp_path):
    rows = [seen(1.0, warning=1), robot(1.1, "grasp"), tray(5.0, "success", "human")]
    assert answer(steps_of(recorded(tmp_path, rows)), 0).accepted
    rows.insert(2, seen(3.0, warning=1))
    assert not answer(steps_of(recorded(tmp_path, rows)), 0).accepted


def test_without_a_placement_nobody_ended_the_subtask(tmp_path):
    steps = steps_of(recorded(tmp_path, [seen(1.0), robot(1.1, "grasp"), seen(3.0, idle=1)]))
    assert answer(steps, 0) == Answer(True, "nobody")


def test_people_come_from_file_names_and_their_tasks_in_order(tmp_path):
    for name in ("b_task10_reactive", "b_task2_proactive", "a_task1_reactive"):
        recorded(tmp_path, name=f"{name}.csv")
    folder = read_folder(tmp_path)
    assert {p: [t.number for t in tasks] for p, tasks in folder.people.items()} == {
        "a": [1],
        "b": [2, 10],
    }
    assert folder.people["b"][0].recording.robot == "proactive"
    assert folder.nameless == ()


def test_files_without_a_person_are_a_person_each_and_named(tmp_path):
    for name in ("monday.csv", "tuesday.csv"):
        recorded(tmp_path, name=name)
    folder = read_folder(tmp_path)
    assert list(folder.people) == ["monday", "tuesday"]
    assert folder.nameless == ("monday.csv", "tuesday.csv")


def bag(path, scenario):
    """A task of our own: idle, then a grasp, then a warning."""
    actions = (Decision.IDLE, Decision.GRASP, Decision.CANCEL)
    with rosbag.Bag(str(path), "w") as file:
        file.write("/fabric/task/state", TaskState(scenario=scenario), genpy.Time(1))
        file.write("/fabric/model_info", ModelInfo(name=f"{scenario}_reactive"), genpy.Time(1))
        for number, action in enumerate(actions, start=1):
            seen_now = Observation(sequence=number, detected=True, warning=number == 3)
            seen_now.header.stamp = genpy.Time(number)
            file.write("/fabric/observation", seen_now, genpy.Time(number))
            decision = Decision(observation_sequence=number, action=action)
            file.write("/fabric/decision", decision, genpy.Time(number))


def test_our_own_bags_are_read_like_other_recordings(tmp_path):
    bag(tmp_path / "person02_task1_reactive.bag", "sorting")
    (task,) = read_folder(tmp_path).people["person02"]
    assert task.recording.robot == "reactive"
    assert begins(task.recording.steps) == [Begin(1, True, True)]
    assert not answer(task.recording.steps, 1).accepted


def test_another_scenario_is_refused_by_file(tmp_path):
    bag(tmp_path / "person02_task1_reactive.bag", "inspection")
    with pytest.raises(ReplayError, match=r"person02_task1_reactive.bag: .*'inspection'"):
        read_folder(tmp_path)


def test_a_folder_that_is_none_or_holds_no_recording_is_refused(tmp_path):
    with pytest.raises(ReplayError, match=r"nowhere: there is no such folder"):
        read_folder(tmp_path / "nowhere")
    (tmp_path / "notes.txt").write_text("nothing here")
    with pytest.raises(ReplayError, match=r"holds no recording"):
        read_folder(tmp_path)


def test_a_bad_file_is_refused_by_name_and_nothing_is_written(tmp_path, capsys):
    recorded(tmp_path / "trials")
    bad = [seen(1.0, idle=1), robot(1.5, "dance")]
    recorded(tmp_path / "trials", bad, "person01_task2_reactive.csv")
    out = tmp_path / "out"
    assert main([str(tmp_path / "trials"), f"out_dir:={out}"]) == 2
    told = capsys.readouterr().err
    assert "person01_task2_reactive.csv: line 3" in told and "'dance'" in told
    assert not out.exists()


@pytest.mark.parametrize("word", ["seed:=-1", "seed:=x", "seed:=99999999999", "speed:=max", "x"])
def test_a_word_that_is_not_meant_is_refused(word):
    with pytest.raises(ArgumentError, match=word.split(":=", maxsplit=1)[0]):
        arguments(["folder", word])


def test_the_output_goes_beside_other_replays_unless_told(tmp_path):
    folder, out, seed = arguments([str(tmp_path / "people"), "seed:=7"])
    assert (folder, out, seed) == (tmp_path / "people", Path("runs/replay-people"), 7)


def watched(models, folder):
    return [t for own in watch_all(models, read_folder(folder).people).values() for t in own]


def known(take_over: TakeOver) -> TakeOver:
    """Without the outcome."""
    return replace(take_over, accepted=False, ended_by="", state=None, types=None)


def test_nothing_later_is_known_at_a_take_over(models, tmp_path):
    whole = watched(models, recorded(tmp_path / "whole"))
    for number, until in enumerate((1.1, 6.1, 12.1)):
        rows = [row for row in ROWS if float(row["time_s"]) <= until]
        part = watched(models, recorded(tmp_path / str(number), rows))[number]
        assert known(part) == known(whole[number])
        np.testing.assert_array_equal(part.state, whole[number].state)
        np.testing.assert_array_equal(part.types, whole[number].types)


def test_answers_are_known_from_the_warning_or_the_placement_on(models, tmp_path):
    first, second, third = watched(models, recorded(tmp_path))
    assert (first.answered, second.answered, third.answered) == ((), (0,), (0, 1))


def test_the_open_take_over_of_a_subtask_is_not_known_when_the_next_begins(models, tmp_path):
    rows = [
        seen(1.0, idle=1),
        robot(1.1, "grasp"),
        seen(3.0, idle=1),
        robot(3.1, "idle"),
        seen(5.0, idle=1),
        robot(5.1, "grasp"),
    ]
    assert [t.answered for t in watched(models, recorded(tmp_path, rows))] == [(), ()]


def test_warnings_are_counted_where_they_begin_over_all_tasks(models, tmp_path):
    rows = [
        seen(1.0, warning=1),  # to nobody
        seen(2.0, warning=1),  # goes on
        seen(3.0, idle=1),
        robot(3.1, "grasp"),
        seen(4.0, warning=1),  # the answer
        tray(9.0, "success", "robot"),
    ]
    recorded(tmp_path, rows)
    recorded(tmp_path, rows, "person01_task2_reactive.csv")
    one, two = watched(models, tmp_path)
    assert (one.warnings_task, one.warnings_person, one.warned, one.quiet) == (1, 1, 1, 1)
    assert (two.warnings_task, two.warnings_person) == (1, 3)
    assert (two.warned, two.quiet) == (2, 2)


def test_idle_time_runs_while_the_person_is_seen_idle(models, tmp_path):
    rows = [seen(1.0, grasp_attempt=1), seen(2.0, idle=1), seen(7.5, idle=1), robot(7.6, "grasp")]
    assert watched(models, recorded(tmp_path, rows))[0].idle == pytest.approx(5.5)


def test_the_belief_over_states_follows_the_recorded_robot(models, tmp_path):
    def after(action):
        rows = [seen(1.0, idle=1), robot(1.1, action), seen(4.0, idle=1), robot(4.1, "grasp")]
        return watched(models, recorded(tmp_path / action, rows))[-1].state

    assert not np.allclose(after("idle"), after("planning for grasping"))
    assert after("idle").sum() == pytest.approx(1.0)


def test_who_the_person_is_goes_on_from_task_to_task_and_not_to_others(models, tmp_path):
    for name in ("one_task1", "one_task2", "two_task1"):
        recorded(tmp_path, name=f"{name}_reactive.csv")
    people = watch_all(models, read_folder(tmp_path).people)
    fresh = people["one"][0].types
    assert not np.allclose(people["one"][3].types, fresh)
    np.testing.assert_array_equal(people["two"][0].types, fresh)
    assert people["one"][3].answered == (0, 1, 2)
    assert people["two"][0].answered == ()


def test_a_robot_that_is_no_known_policy_tells_nothing_about_the_types(models, tmp_path):
    recorded(tmp_path, name="person01_task1_curious.csv")
    tasks = read_folder(tmp_path).people["person01"]
    found = Watcher(models).watch(tasks[0])
    np.testing.assert_allclose(found[0].types, 1.0 / len(found[0].types))


def test_the_shipped_recordings_are_scored_alike_every_time_and_told_in_full(tmp_path):
    files = Files()
    folder = read_folder(SHIPPED)
    result = score(folder, files, seed=5)
    again = score(folder, files, seed=5)
    assert json_of(result) == json_of(again)
    content = json_of(result)
    assert {c["robot"] for c in content["comparisons"]} == {"proactive", "reactive", "all"}
    for comparison in content["comparisons"]:
        assert 0 < comparison["accepted"] < comparison["n"]
        for line in comparison["scores"]:
            assert 0.0 <= line["area"]["value"] <= 1.0
    assert all(0.0 < t["scores"]["state belief alone"] < 1.0 for t in content["take_overs"])
    assert "belief in needs_help" in text_of(result)


def test_the_command_writes_json_curves_and_a_page(tmp_path, capsys):
    trials = recorded(tmp_path / "trials")
    out = tmp_path / "out"
    assert main([str(trials), f"out_dir:={out}", "seed:=3"]) == 0
    assert sorted(path.name for path in out.iterdir()) == [
        "report.html", "roc.svg", "take_overs.json",
    ]  # fmt: skip
    page = (out / "report.html").read_text()
    assert "<svg" in page and "avoided" in page
    assert "every grasp begun" in capsys.readouterr().out


def test_a_folder_in_which_nobody_is_taken_over_says_so(tmp_path, capsys):
    trials = recorded(tmp_path / "trials", [seen(1.0, idle=1)])
    assert main([str(trials), f"out_dir:={tmp_path / 'out'}"]) == 2
    assert "have not taken over once" in capsys.readouterr().err
