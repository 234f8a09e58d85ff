# SPDX-License-Identifier: BSD-3-Clause
"""`./fabric plan` as the command runs it."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import fabric_planner as fp
from fabric_planner import plan

TIGER = Path(__file__).parent / "models" / "tiger.pomdpx"
TIGER_VALUE = 19.3714  # of the initial belief, Cassandra's solver
PNG = b"\x89PNG\r\n\x1a\n"


def run(*arguments: str) -> subprocess.CompletedProcess:
    command = [sys.executable, "-m", "fabric_planner.plan", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def answer(capsys, *arguments: str) -> dict:
    """What --json prints, exit code 0."""
    assert plan.main([*arguments, "--json"]) == 0, capsys.readouterr().err
    return json.loads(capsys.readouterr().out)


def refusal(capsys, *arguments: str) -> str:
    """The one line on stderr, exit code 2."""
    try:
        code = plan.main(arguments)
    except SystemExit as end:  # argparse
        code = end.code
    assert code == 2
    told = capsys.readouterr()
    assert told.out == "" and told.err.count("\n") == 1
    return told.err


# --- what to do at a belief --------------------------------------------------------------------


def test_plan_prints_the_decision_as_one_json_object():
    done = run(str(TIGER), "--json")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["action"] == "listen"
    assert told["lower_bound"] <= TIGER_VALUE <= told["upper_bound"] + 1e-3


def test_plan_answers_for_a_given_belief(capsys):
    assert answer(capsys, str(TIGER), "--belief", "0.01,0.99")["action"] == "open_left"
    told = answer(capsys, str(TIGER), "--belief", "left=0.99,right=0.01")
    assert told["action"] == "open_right"


def test_plan_tells_a_person(capsys):
    assert plan.main([str(TIGER)]) == 0
    shown = capsys.readouterr().out
    assert "action      listen" in shown and "optimal value in" in shown


def test_plan_knows_shipped_models_by_name(capsys):
    assert answer(capsys, "inspection_reactive")["fully_observable"] is True


def test_plan_shows_the_tree_as_text_json_and_picture(capsys, tmp_path):
    files = {"--tree-json": tmp_path / "tree.json", "--tree-plot": tmp_path / "tree.png"}
    options = [text for pair in files.items() for text in map(str, pair)]
    assert plan.main([str(TIGER), "--nodes", "50", "--tree", "1", *options]) == 0
    shown = capsys.readouterr().out
    assert "\nroot [" in shown and "├─> listen" in shown and "0.500 left" in shown
    tree = json.loads((tmp_path / "tree.json").read_text())
    assert [a["action"] for a in tree["actions"]] == ["listen", "open_left", "open_right"]
    assert (tmp_path / "tree.png").read_bytes().startswith(PNG)


# --- solving -----------------------------------------------------------------------------------


def test_solving_ends_at_the_gap_and_tells_how_the_bounds_moved(capsys, tmp_path):
    picture = tmp_path / "bounds.png"
    told = answer(capsys, str(TIGER), "--solve", "20", "--gap", "0.01", "--plot", str(picture))
    assert told["lower_bound"] <= TIGER_VALUE <= told["upper_bound"]
    assert told["upper_bound"] - told["lower_bound"] <= 0.01
    times, lower, upper = np.array(told["history"]).T
    assert (np.diff(times) >= 0).all()
    assert (np.diff(lower) >= 0).all() and (np.diff(upper) <= 0).all()
    assert told["action"] == "listen"
    assert picture.read_bytes().startswith(PNG)


def test_solving_shows_its_progress_to_a_person(capsys):
    assert plan.main([str(TIGER), "--solve", "20", "--gap", "0.01"]) == 0
    shown = capsys.readouterr().out
    assert "lower" in shown and "upper" in shown and "action      listen" in shown


def test_a_saved_policy_can_be_asked_and_evaluated(capsys, tmp_path):
    policy = str(tmp_path / "tiger.policy")
    solve = [str(TIGER), "--solve", "20", "--gap", "0.01", "--save-policy", policy]
    told = answer(capsys, *solve)
    again = answer(capsys, str(TIGER), "--policy", policy)
    assert again["action"] == "listen"
    assert again["value"] == pytest.approx(told["lower_bound"], abs=1e-9)
    sure = answer(capsys, str(TIGER), "--policy", policy, "--belief", "0.01,0.99")
    assert sure["action"] == "open_left"
    options = ["--policy", policy, "--evaluate", "100", "--seed", "3"]
    found = answer(capsys, str(TIGER), *options)["evaluation"]
    assert found["episodes"] == 100 and found["standard_error"] > 0.0
    assert abs(found["cv"] - TIGER_VALUE) < 0.05
    assert abs(found["mean_return"] - TIGER_VALUE) < 5 * found["standard_error"]


def test_an_evaluation_repeats_exactly_with_its_seed(capsys):
    options = [str(TIGER), "--evaluate", "5", "--nodes", "20", "--deadline", "1e6"]
    told = [answer(capsys, *options, "--seed", seed)["evaluation"] for seed in ("1", "1", "2")]
    assert told[0] == told[1]
    assert told[0]["mean_return"] != told[2]["mean_return"]


# --- files -------------------------------------------------------------------------------------


def test_a_model_is_converted_without_loss(capsys, tmp_path):
    written = tmp_path / "copy.pomdpx"
    assert answer(capsys, str(TIGER), "--convert", str(written))["converted"] == str(written)
    ours, theirs = fp.load(written), fp.load(TIGER)
    for table in ("transition", "observation", "reward", "initial_belief"):
        np.testing.assert_array_equal(getattr(ours, table), getattr(theirs, table))


def test_lint_tells_what_it_found_and_plans_nothing(capsys):
    assert plan.main([str(TIGER), "--lint"]) == 0
    assert capsys.readouterr().out.count("\n") >= 2
    told = answer(capsys, str(TIGER), "--lint")
    assert all(finding["severity"] != "error" for finding in told["lint"])
    assert "action" not in told


def test_lint_ends_with_1_when_a_model_has_no_finite_value(capsys, tmp_path):
    endless = fp.Pomdp(
        ["work", "rest"], ["go"], ["nothing"], [[[0.5, 0.5], [0.5, 0.5]]],
        np.ones((1, 2, 1)), np.array([[1.0, 0.0]]), 1.0, [1.0, 0.0],
    )  # fmt: skip
    file = tmp_path / "endless.pomdpx"
    fp.save_pomdpx(endless, file)
    assert plan.main([str(file), "--lint"]) == 1
    assert "error: " in capsys.readouterr().out


# --- refusals ----------------------------------------------------------------------------------


def test_plan_refuses_a_bad_file_naming_it(tmp_path, capsys):
    bad = tmp_path / "bad.POMDPx"
    bad.write_text(TIGER.read_text().replace("0.85 0.15 0.15 0.85", "0.85 0.15 0.15 0.85s"))
    error = refusal(capsys, str(bad))
    assert str(bad) in error and "O[listen] row right: '0.85s' is not a number" in error
    assert "no_such_file" in refusal(capsys, "no_such_file.pomdpx")


@pytest.mark.parametrize(
    ("belief", "message"),
    [
        ("0.5,0.6", "belief sums to 1.1"),
        ("0.5,x", "'x' is not a number"),
        ("0.5,0.5,0", "more numbers than the 2 states"),
        ("nan,1", "belief column left is NaN"),
        ("middle=1", "unknown state 'middle' (known: left, right)"),
    ],
)
def test_plan_refuses_a_bad_belief(belief, message, capsys):
    error = refusal(capsys, str(TIGER), "--belief", belief)
    assert message in error and str(TIGER) in error


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--gap", "-1"], "gap"),
        (["--gap", "nan"], "gap"),
        (["--gap", "x"], "--gap: invalid float value: 'x'"),
        (["--deadline", "-1"], "deadline"),
        (["--solve", "-1"], "--solve"),
        (["--solve", "nan"], "--solve"),
        (["--plot", "x.png"], "--save-policy and --plot want --solve"),
        (["--evaluate", "0"], "--evaluate"),
        (["--tree", "0"], "--tree"),
        (["--policy", "no_such.policy"], "no_such.policy"),
        (["--convert", "no_such_folder/x.pomdpx"], "no_such_folder/x.pomdpx"),
        (["--tree-json", "no_such_folder/tree.json"], "no_such_folder/tree.json"),
        (["--wrong"], "--wrong"),
    ],
)
def test_plan_refuses_a_bad_option_in_one_line(options, message, capsys):
    assert message in refusal(capsys, str(TIGER), *options)
