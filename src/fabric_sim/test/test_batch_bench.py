# SPDX-License-Identifier: BSD-3-Clause
"""The bench of simulated tasks: figures say what was measured."""

import json

import pytest

from fabric_sim import batch_bench
from fabric_sim.batch_bench import Work
from fabric_sim.batch_train import Measured


def test_figures_are_medians_of_what_the_processes_did():
    ones = [Work(10, 20, 50, 0.001, 0.5, wall) for wall in (1.0, 2.0, 4.0)]
    twos = [Work(20, 40, 100, 0.004, 1.0, wall) for wall in (1.0, 2.5, 5.0)]
    slow = [Work(1, 2, 5, 0.0001, 0.4, 1.0)] * 3
    found = {(f["figure"], f.get("detail")): f for f in batch_bench.figures(
        "inspection", ones, twos, slow)}  # fmt: skip
    assert found["throughput", "1 process"]["value"] == 5.0
    two = found["throughput", "2 processes"]
    assert (two["value"], two["target"], two["met"]) == (8.0, 2000.0, False)
    assert found["speed_up", "1 to 2 processes"]["value"] == pytest.approx(1.6)
    assert found["subtasks", "2 processes"]["value"] == 16.0
    cpu = found["throughput", "a CPU second"]
    assert (cpu["value"], cpu["baseline_value"], cpu["times_every_tick"]) == (20.0, 2.5, 8.0)
    assert found["decision", "1 process"]["value"] == pytest.approx(20.0)
    assert found["decisions", None]["value"] == 5.0
    assert all(f["bench"] == "training" and json.dumps(f) for f in found.values())


def test_a_senseless_number_of_repetitions_is_refused(capsys):
    assert batch_bench.main(["--repeats", "0"]) == 2
    assert "--repeats is 0" in capsys.readouterr().err


def test_a_full_training_is_told_from_a_share_of_it(monkeypatch):
    asked = []

    def measured(library, processes, share, seed):
        asked.append((library.scenario, processes, share))
        return Measured("sorting", 600, 28800, 2.0)

    monkeypatch.setattr(batch_bench, "measure_training", measured)
    found = batch_bench.full_training("sorting", 12)
    assert asked == [("sorting", 2, 12)]
    assert found["value"] == pytest.approx(16 * 20 * 90 / 300.0)
    assert (found["target"], found["met"], found["tasks_run"]) == (60.0, False, 600)
