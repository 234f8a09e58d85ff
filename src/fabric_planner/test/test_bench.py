# SPDX-License-Identifier: BSD-3-Clause
"""The planner benchmark: its baselines, its figures and how they are shown."""

import json
import time
from pathlib import Path

import numpy as np
import pytest

import fabric_planner as fp
from fabric_planner import bench, bench_standard
from fabric_planner.bench_baselines import NumpyFilter, PlainPomcp, value_iteration
from fabric_planner.bench_episodes import make_model, make_options, measure
from fabric_planner.bench_record import beside, figure, hardware
from fabric_planner.bench_report import line, table, write_plot
from fabric_planner.bench_standard import RUNS, Run, standard
from fabric_planner.bench_tabular import (
    belief_update,
    bounds_in_time,
    cold,
    deadline_overrun,
    pomcp_trials,
    random_run,
    tiger,
    warm_decision,
)
from fabric_planner.paths import models_folder, shipped_models

TIGER = Path(__file__).parent / "models" / "tiger.pomdpx"
PNG = b"\x89PNG\r\n\x1a\n"
FAST = beside(figure("update", "m", 0.1, "us", at_most=0.2, reference=2900.0), "numpy", 4.0)
SLOW = figure("cold", "m", 80.0, "ms", at_most=50.0, detail="from a file")
GOOD = figure("return", "Tag", -6.0, "reward", at_least=-6.3, reference=-9.0, standard_error=0.1)
BARE = figure("memory", "Tag", None, "MB")


def test_a_figure_meets_a_limit_from_the_right_side():
    assert FAST["met"] and not SLOW["met"] and GOOD["met"] and "met" not in BARE
    assert not figure("return", "Tag", -6.4, "reward", at_least=-6.3)["met"]
    assert not figure("time", "m", None, "s", at_most=1.0)["met"]


def test_a_missed_target_is_told_in_standard_errors():
    short = figure("return", "Tag", -6.5, "reward", at_least=-6.3, standard_error=0.4)
    assert short["missed_by_errors"] == pytest.approx(0.5)
    assert "missed_by_errors" not in GOOD
    assert "NO, by 0.5 se" in table([short])


def test_a_baseline_is_told_as_a_ratio():
    assert FAST["baseline"] == "numpy" and FAST["baseline_over_ours"] == pytest.approx(40.0)


def test_the_hardware_is_told():
    told = hardware()
    assert told["figure"] == "hardware" and told["cores"] >= 1 and told["cpu"]


def test_the_table_shows_every_figure_and_counts_the_targets():
    lines = table([hardware(), FAST, SLOW, GOOD, BARE]).splitlines()
    assert len(lines) == 2 + 4 + 1
    assert "0.1 us" in lines[2] and "<= 0.2" in lines[2] and "4 (numpy, 40 x ours)" in lines[2]
    assert lines[3].split()[-1] == "NO" and "cold from a file" in lines[3]
    assert "-6 +- 0.1 reward" in lines[4] and "-9" in lines[4]
    assert lines[-1] == "2 of 3 targets met"


def test_a_line_tells_all_but_long_lists():
    told = line(figure("bound", "m", 1.0, "s", history=[[1, 2]], seed=3))
    assert told.split() == ["bound", "m", "1", "s", "seed=3"]


@pytest.mark.parametrize("figures", [[FAST, SLOW, GOOD, BARE], [GOOD], [SLOW], []])
def test_the_picture_shows_what_there_is(figures, tmp_path):
    write_plot(figures, tmp_path / "bench.png")
    assert (tmp_path / "bench.png").read_bytes().startswith(PNG)


def test_the_numpy_filter_agrees_with_the_exact_one():
    model = fp.load(shipped_models()[0])
    ours, plain = fp.BeliefFilter(model), NumpyFilter(model)
    for action, observation in zip(*random_run(model, 50, seed=1), strict=True):
        if ours.update(int(action), int(observation)) == fp.UpdateStatus.RECOVERED:
            break
        plain.update(action, observation)
        np.testing.assert_allclose(plain.belief, ours.belief, atol=1e-12)


def test_value_iteration_in_numpy_agrees_with_the_solver():
    model = fp.load(shipped_models()[0])
    np.testing.assert_allclose(
        value_iteration(model).max(axis=0), fp.solve_mdp(model).value, atol=1e-4
    )


def test_plain_pomcp_opens_the_door_it_is_sure_of():
    planner = PlainPomcp(tiger(), exploration=110.0, seed=1)
    assert planner.search(np.array([0.99, 0.01]), 1000) == 2
    assert planner.search(np.array([0.01, 0.99]), 1000) == 1


def test_a_belief_update_is_measured_beside_numpy():
    (found,) = belief_update(tiger())
    assert found["unit"] == "us" and found["baseline"] == "numpy"
    assert 0.0 < found["value"] < found["baseline_value"]


def test_overruns_are_measured_for_each_deadline():
    found = list(deadline_overrun(tiger(), 3))
    assert [f["detail"] for f in found] == ["at 1 ms", "at 5 ms", "at 20 ms"]
    assert all(f["value"] is None or f["value"] >= 0.0 for f in found)


def test_a_solution_is_told_by_its_time_and_its_gap():
    model = tiger()
    solution = fp.solve(model, time=20.0, gap=0.01)
    told = list(bounds_in_time(model, solution, 19.3))
    assert [f["figure"] for f in told][0] == "lower_bound_time"
    assert told[0]["value"] <= solution.history[-1, 0] and told[0]["detail"] == "to 19.3"
    assert next(bounds_in_time(model, solution, 100.0))["value"] is None
    assert told[1]["lower"] <= 19.3714 <= told[1]["upper"]


def test_warm_decisions_are_measured_beside_qmdp():
    model = fp.load(models_folder() / "inspection_proactive.pomdpx")
    reference = fp.solve(model, time=0.2).lower
    told = list(warm_decision(model, reference, 20, None))
    assert [f["figure"] for f in told] == ["warm_decision", "policy_cv"] * 2
    assert all(f["value"] > 0.0 for f in told)
    assert told[1]["met"] and told[1]["value"] > told[1]["baseline_value"]


def test_cold_and_pomcp_are_measured_beside_plain_python():
    (told,) = cold(str(shipped_models()[0]))
    assert told["value"] > 0.0 and told["baseline"] == "load, value iteration in numpy"
    (told,) = pomcp_trials(tiger())
    assert told["value"] > told["baseline_value"] > 0.0


# --- the standard problems -----------------------------------------------------------------------


def test_episodes_of_a_problem_are_summed_up():
    found = measure("Tiger", "DESPOT", 5e-3, 4, 60.0)
    assert found["episodes"] == 4 and found["steps"] > 1.0
    assert found["step_median"] <= found["step_p99"] <= found["step_max"]
    assert found["trials_per_second"] > 0.0


def test_a_problem_that_is_short_of_time_runs_fewer_episodes():
    assert measure("Tiger", "POMCP", 1e-3, 1000, 0.0)["episodes"] < 1000


@pytest.mark.parametrize("run", RUNS, ids=lambda run: run.name)
def test_every_problem_of_the_benchmark_exists(run):
    assert make_model(run.problem).n_actions > 1
    assert make_options(run.planner, 0.01).cpu_time


def test_standard_problems_run_in_processes_of_their_own(monkeypatch):
    monkeypatch.setattr(bench_standard, "BUDGET", 1e-3)
    runs = [Run("Tiger", episodes=4, target=-100.0), Run("Tiger", "POMCP", episodes=4)]
    told = list(standard(runs, 1.0, time.monotonic() + 60.0))
    names = [(f["figure"], f["detail"]) for f in told]
    assert names[0] == ("return", "DESPOT, 1 ms a step") and len(told) == 8
    assert told[0]["met"] and told[0]["episodes"] == 4 and "met" not in told[4]
    assert all(0.1 < f["value"] < 200.0 for f in told if f["figure"] == "memory")


# --- the command ---------------------------------------------------------------------------------


def test_the_command_prints_the_hardware_first_and_a_json_object_a_figure(capsys, tmp_path):
    options = ["--only", "belief", "--json", "--plot", str(tmp_path / "bench.png")]
    assert bench.main(options) == 0
    told = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert told[0]["figure"] == "hardware"
    assert {f["model"] for f in told[1:]} >= {"tiger", "inspection_proactive"}
    assert all(f["bench"] == "planner" for f in told)
    assert (tmp_path / "bench.png").read_bytes().startswith(PNG)


def test_the_command_measures_a_model_of_ones_own(capsys):
    assert bench.main(["--model", str(TIGER), "--only", "belief"]) == 0
    shown = capsys.readouterr().out
    assert "tiger" in shown and "inspection" not in shown and "1 of 1 targets met" in shown


def test_the_command_refuses_what_it_does_not_know(capsys):
    assert bench.main(["--only", "nothing"]) == 2
    assert "there are belief_update" in capsys.readouterr().err
    assert bench.main(["--model", "no_such.pomdpx"]) == 2
    assert "no_such.pomdpx" in capsys.readouterr().err
