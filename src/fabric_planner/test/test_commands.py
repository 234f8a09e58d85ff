# SPDX-License-Identifier: BSD-3-Clause
"""`./fabric plan` and `./fabric bench planner`, as the command runs them."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from fabric_planner import bench, plan

TIGER = Path(__file__).parent / "models" / "tiger.pomdpx"


def run(module: str, *arguments: str) -> subprocess.CompletedProcess:
    command = [sys.executable, "-m", f"fabric_planner.{module}", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_plan_prints_the_decision_as_one_json_object():
    done = run("plan", str(TIGER), "--json")
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    assert answer["action"] == "listen"
    assert answer["lower_bound"] <= 19.3714 <= answer["upper_bound"] + 1e-3


def test_plan_answers_for_a_given_belief(capsys):
    assert plan.main([str(TIGER), "--belief", "0.01,0.99", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["action"] == "open_left"
    assert plan.main([str(TIGER), "--belief", "left=0.99,right=0.01", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["action"] == "open_right"


def test_plan_tells_a_person(capsys):
    assert plan.main([str(TIGER)]) == 0
    shown = capsys.readouterr().out
    assert "action      listen" in shown and "optimal value in" in shown


def test_plan_knows_shipped_models_by_name(capsys):
    assert plan.main(["inspection_reactive", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["fully_observable"] is True


def test_plan_refuses_a_bad_file_naming_it(tmp_path, capsys):
    bad = tmp_path / "bad.POMDPx"
    bad.write_text(TIGER.read_text().replace("0.85 0.15 0.15 0.85", "0.85 0.15 0.15 0.85s"))
    assert plan.main([str(bad)]) == 2
    error = capsys.readouterr().err
    assert str(bad) in error and "O[listen] row right: '0.85s' is not a number" in error


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
    assert plan.main([str(TIGER), "--belief", belief]) == 2
    error = capsys.readouterr().err
    assert message in error and str(TIGER) in error


def test_plan_refuses_a_bad_option(capsys):
    assert plan.main([str(TIGER), "--gap", "-1"]) == 2
    assert "gap" in capsys.readouterr().err


def test_bench_prints_one_json_object_a_figure(monkeypatch, capsys):
    monkeypatch.setattr(bench, "benched_models", lambda: [bench.tiger()])
    assert bench.main(["--json"]) == 0
    figures = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [f["figure"] for f in figures] == [
        "belief_update", "offline_bounds", "decision", "deadline"
    ]  # fmt: skip
    assert figures[0]["baseline_over_ours"] > 0
    assert figures[2]["gap"] <= 1e-3


def test_bench_covers_tiger_and_every_shipped_model():
    names = [model.name for model in bench.benched_models()]
    assert names[0] == "tiger" and "inspection_proactive" in names
