# SPDX-License-Identifier: BSD-3-Clause
"""The short-term study: its robots, the bookkeeping, and a whole small run."""

import csv
import json
from collections import Counter

import numpy as np
import pytest

import fabric_planner as fp
from fabric_msgs.msg import Decision, Observation
from fabric_sim.drift import DriftingStaff
from fabric_sim.experiments import command, short_term
from fabric_sim.experiments.observed_worker import ObservedWorker
from fabric_sim.experiments.robots import (
    FILES,
    TITLES,
    Believed,
    Oracle,
    without_action,
    write_never_help,
)
from fabric_sim.experiments.scenario import (
    OCCUPIED,
    TASK_COLUMNS,
    ScenarioJob,
    run_scenario,
    stage_counts,
)
from fabric_sim.experiments.short_term_figures import moving, smooth
from fabric_sim.experiments.short_term_table import (
    SCENARIO_COLUMNS,
    Study,
    comparisons,
    goals,
    scenario_row,
)
from fabric_sim.truth import Truth
from fabric_sim.worker_events import RobotView, WorldView

SEED = 101


@pytest.fixture(scope="module")
def model() -> fp.Pomdp:
    return fp.load(FILES.model("proactive", "inspection"))


def truth(word: str) -> Truth:
    return Truth("1,1,1,1", "evaluating", "idle", word, 1.0, 1.0, 1.0, 1.0, 0, 0)


def oracle_action(model: fp.Pomdp, word: str) -> int:
    return Oracle(model).decide(Observation(sequence=7, task_id=3), truth(word)).action


# -- robots -------------------------------------------------------------------------------------


def test_the_oracle_takes_over_where_help_is_wanted_and_not_where_it_is_not(model):
    assert oracle_action(model, "needs_help") == Decision.GRASP
    assert oracle_action(model, "does_not_need_help") != Decision.GRASP
    assert oracle_action(model, "task_assigned_to_human") != Decision.GRASP
    assert oracle_action(model, "needs_to_be_reminded") == Decision.POINT
    assert oracle_action(model, "warning_received") == Decision.CANCEL


def test_the_oracle_believes_the_truth_and_answers_its_observation(model):
    decision = Oracle(model).decide(Observation(sequence=7, task_id=3), truth("may_be_tired"))
    assert decision.belief[model.state_index("may_be_tired")] == 1.0
    assert sum(decision.belief) == 1.0
    assert (decision.sequence, decision.observation_sequence, decision.task_id) == (7, 7, 3)


def test_a_model_without_an_action_is_the_same_in_all_others(model):
    less = without_action(model, "grasp")
    assert list(less.actions) == [name for name in model.actions if name != "grasp"]
    for name in less.actions:
        one, other = less.action_index(name), model.action_index(name)
        assert np.array_equal(less.transition[one], model.transition[other])
        assert np.array_equal(less.reward[one], model.reward[other])
        assert np.array_equal(less.observation[one], model.observation[other])


def test_an_action_that_a_model_has_not_cannot_be_taken_away(model):
    with pytest.raises(fp.ModelError, match="dance"):
        without_action(model, "dance")


def test_who_never_helps_never_touches_a_package(tmp_path):
    write_never_help(tmp_path)
    rows = run_scenario(ScenarioJob("never_help", 0.1, SEED, 12, tmp_path)).rows
    assert sum(row["robot_succeeded"] for row in rows) == 0
    assert sum(row["human_succeeded"] for row in rows) > 0


# -- bookkeeping --------------------------------------------------------------------------------


def test_counts_of_a_stage_are_the_decisions_while_the_truth_was_in_it():
    believed = Counter(
        {
            Believed("may_be_tired", "may_be_tired"): 3,
            Believed("may_be_tired", "needs_help"): 1,
            Believed("needs_help", "needs_help"): 2,
            Believed("task_assigned_to_human", "may_be_tired"): 5,
            Believed("global_success", "global_success"): 1,
        }
    )
    counts = stage_counts(believed)
    assert (counts["stage1_right"], counts["stage1_judged"]) == (3, 4)
    assert (counts["stage2_right"], counts["stage2_judged"]) == (2, 2)
    assert (counts["all_right"], counts["all_judged"]) == (5, 11)


def test_a_scenario_repeats_and_its_rows_fit_each_other(tmp_path):
    job = ScenarioJob("reactive", 0.1, SEED, 8, tmp_path)
    result = run_scenario(job)
    assert result == run_scenario(job)
    for row in result.rows:
        assert tuple(row) == TASK_COLUMNS
        assert 0.0 <= sum(row[name] for name in OCCUPIED) <= row["present_s"] + 1e-6
        assert row["present_s"] <= row["duration_s"]
        if row["stage2_accuracy"] is not None:
            assert row["stage2_accuracy"] == row["stage2_right"] / row["stage2_judged"]


def test_people_alone_do_well_at_first_and_badly_later(tmp_path):
    early, late = [], []
    for seed in range(SEED, SEED + 6):
        rows = run_scenario(ScenarioJob("none", 0.0, seed, 40, tmp_path)).rows
        early += [row["success"] for row in rows[:10]]
        late += [row["success"] for row in rows[-15:]]
    assert np.mean(early) >= 0.95
    assert np.mean(late) <= 0.80


def test_a_moving_mean_looks_back_and_leaves_out_what_is_undefined():
    table = np.array([[1.0, 2.0, np.nan, 6.0]])
    assert moving(table, window=2).tolist() == [[1.0, 1.5, 2.0, 6.0]]


def test_a_smooth_fit_keeps_a_constant():
    assert smooth(np.full((2, 9), 3.0)) == pytest.approx(np.full((2, 9), 3.0))


def study_of(differences: list[float]) -> Study:
    """Scenarios in which proactive exceeds reactive by these rewards and all else is equal."""
    rows = []
    for seed, difference in enumerate(differences, start=SEED):
        for robot, reward in (("proactive", 4.0 + difference), ("reactive", 4.0)):
            figures = (reward, 1.0, 0.8, 0.7, 0.9, 20.0, 0.5, 0.7, 0.6, 0.0, 6.0)
            values = (0.1, robot, seed, 40, *figures)
            rows.append(dict(zip(SCENARIO_COLUMNS, values, strict=True)))
    return Study(("proactive", "reactive"), (0.1,), [], rows, {})


def goal(study: Study, beginning: str) -> bool | None:
    return next(g.met for g in goals(study, 0.1) if g.text.startswith(beginning))


def test_a_goal_is_met_by_a_sure_difference_in_the_right_direction_only():
    rng = np.random.default_rng(SEED)
    noise = rng.normal(0.0, 0.1, 20)
    claim = "proactive better than reactive in reward"
    assert goal(study_of(list(1.0 + noise)), claim) is True
    assert goal(study_of(list(-1.0 + noise)), claim) is False
    assert goal(study_of(list(noise)), claim) is False
    assert goal(study_of(list(noise)), "warnings per scenario of the proactive") is True
    assert goal(study_of(list(noise)), "stage-2 accuracy of the proactive") is False
    assert goal(study_of(list(noise)), "success rate of the proactive") is True


def test_robots_are_compared_in_equal_scenarios():
    study = study_of([1.0, 2.0, 4.0])
    study.scenarios.reverse()
    comparison = comparisons(study, 0.1, "proactive", "reactive")["reward"]
    assert comparison.n == 3
    assert comparison.difference.value == pytest.approx(7.0 / 3.0)


def test_the_watch_runs_from_the_packages_coming_to_its_fate():
    worker = DriftingStaff(SEED, make_worker=ObservedWorker).worker(1)
    worker.start_task(0.0, "inspection")
    worker.start_subtask(1.0)
    worker.step(2.0, RobotView(), WorldView(cube_at_pick_point=False))
    assert sum(worker.record.seconds.values()) == 0.0
    for tick in range(21):
        worker.step(3.0 + 0.5 * tick, RobotView(), WorldView(cube_at_pick_point=True))
    worker.end_subtask(14.0, success=False, by_person=False)
    worker.step(20.0, RobotView(), WorldView(cube_at_pick_point=True))
    assert sum(worker.record.seconds.values()) == pytest.approx(11.0)
    assert 0.0 <= worker.record.handling <= worker.record.seconds["evaluating"]


# -- the command --------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def small_run(tmp_path_factory):
    """Folder of a study of two scenarios with three tasks."""
    folder = tmp_path_factory.mktemp("study") / "run"
    words = ["--scenarios", "2", "--tasks", "3", "--seed", str(SEED), "--noise", "0.1"]
    words += ["--jobs", "1"]
    assert command.main(["short-term", *words, "--out", str(folder)]) == 0
    return folder


def rows_of(path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_a_run_writes_a_row_a_task_and_every_robot_meets_the_same_moods(small_run):
    rows = rows_of(small_run / "results.csv")
    robots = set(short_term.ROBOTS)
    assert len(rows) == len(robots) * 2 * 3
    met = {
        robot: tuple(
            (row["scenario_seed"], row["task"], row["mood"])
            for row in rows
            if row["robot"] == robot
        )
        for robot in robots
    }
    assert len(set(met.values())) == 1


def test_rows_of_scenarios_are_those_of_their_tasks(small_run):
    scenarios = rows_of(small_run / "scenarios.csv")
    tasks = rows_of(small_run / "results.csv")
    for scenario in scenarios:
        mine = [
            row
            for row in tasks
            if all(row[key] == scenario[key] for key in ("robot", "scenario_seed"))
        ]
        reward = sum(float(row["discounted_reward"]) for row in mine) / len(mine)
        assert float(scenario["reward"]) == pytest.approx(reward, abs=1e-5)
        assert float(scenario["warnings"]) == sum(float(row["warnings"]) for row in mine)


def test_the_report_stands_by_itself_and_names_every_robot(small_run):
    page = (small_run / "report.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 3
    assert "src=" not in page
    assert "<link" not in page
    for robot in short_term.ROBOTS:
        assert TITLES[robot] in page


def test_tests_and_confusion_are_written(small_run):
    lines = json.loads((small_run / "tests.json").read_text(encoding="utf-8"))
    assert {line["kind"] for line in lines} >= {"mean", "goal", "proactive_minus"}
    confusion = rows_of(small_run / "confusion.csv")
    tasks = rows_of(small_run / "results.csv")
    judged = sum(int(row["all_judged"]) for row in tasks)
    words = {"global_success", "global_fail", "task_assigned_to_robot"}
    assert sum(int(row["decisions"]) for row in confusion if row["truth"] not in words) == judged


def test_the_number_of_processes_changes_nothing(tmp_path):
    words = ["--scenarios", "2", "--tasks", "2", "--seed", str(SEED), "--noise", "0.1"]
    words += ["--robots", "proactive,reactive"]
    for jobs in ("1", "2"):
        assert short_term.main([*words, "--jobs", jobs, "--out", str(tmp_path / jobs)]) == 0
    one, other = ((tmp_path / jobs / "results.csv").read_bytes() for jobs in ("1", "2"))
    assert one == other


def test_a_folder_that_holds_a_run_is_left_alone(small_run, capsys):
    before = (small_run / "results.csv").read_bytes()
    words = ["--scenarios", "2", "--tasks", "1", "--seed", str(SEED), "--out", str(small_run)]
    assert short_term.main(words) == 2
    assert "another run" in capsys.readouterr().err
    assert (small_run / "results.csv").read_bytes() == before


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--robots", "proactive,reactive,angel"], "angel"),
        (["--robots", "proactive"], "proactive and reactive"),
        (["--scenarios", "1"], "2 or more"),
        (["--tasks", "0"], "less than 1"),
        (["--noise", "nan"], "outside 0..1"),
        (["--noise", "1.5"], "outside 0..1"),
    ],
)
def test_words_that_cannot_be_meant_are_refused(words, complaint, capsys):
    with pytest.raises(SystemExit) as ended:
        short_term.main(words)
    assert ended.value.code == 2
    assert complaint in capsys.readouterr().err


def test_a_scenario_row_counts_warnings_and_averages_the_rest(tmp_path):
    rows = run_scenario(ScenarioJob("none", 0.0, SEED, 3, tmp_path)).rows
    row = scenario_row(rows)
    assert row["tasks"] == 3
    assert row["duration_s"] == pytest.approx(sum(r["duration_s"] for r in rows) / 3)
    assert row["stage2_accuracy"] is None
