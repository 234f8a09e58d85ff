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


# --- evaluating --------------------------------------------------------------------------------


def test_an_evaluation_repeats_exactly_with_its_seed(capsys):
    options = [str(TIGER), "--evaluate", "5", "--nodes", "20", "--deadline", "1e6"]
    told = [answer(capsys, *options, "--seed", seed)["evaluation"] for seed in ("1", "1", "2")]
    assert told[0] == told[1]
    assert told[0]["mean_return"] != told[2]["mean_return"]


# --- files -------------------------------------------------------------------------------------


def test_a_model_is_converted_without_loss(capsys, tmp_path):
    written = tmp_path / "copy.pomdpx"
    assert answer(capsys, str(TIGER), "--convert", str(written))["converted"] == str(written)
    ours, theirs = fp.load_pomdpx(written), fp.load_pomdpx(TIGER)
    for table in ("transition", "observation", "reward", "initial_belief"):
        np.testing.assert_array_equal(getattr(ours, table), getattr(theirs, table))


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
        (["--evaluate", "0"], "--evaluate"),
        (["--tree", "0"], "--tree"),
        (["--convert", "no_such_folder/x.pomdpx"], "no_such_folder/x.pomdpx"),
        (["--tree-json", "no_such_folder/tree.json"], "no_such_folder/tree.json"),
        (["--wrong"], "--wrong"),
    ],
)
def test_plan_refuses_a_bad_option_in_one_line(options, message, capsys):
    assert message in refusal(capsys, str(TIGER), *options)
