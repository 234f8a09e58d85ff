# SPDX-License-Identifier: BSD-3-Clause
"""The bench of perception: figures say what was measured, on pictures of a task."""

import json

import pytest

from fabric_sim import batch_bench_perception as bench
from fabric_sim.batch_bench_perception import Work


def test_costs_add_up_to_a_share_of_a_core_and_a_latency():
    work = [Work(4.0, 1.0)] * 100
    found = {f["figure"]: f for f in bench.costs(work, head_ms=3.0)}
    assert found["gesture"]["value"] == pytest.approx(1.0)
    assert found["core"]["value"] == pytest.approx(0.1 * 8.0 * 30.0)
    assert (found["core"]["target"], found["core"]["met"]) == (60.0, True)
    assert found["latency"]["value"] == pytest.approx(5.0)
    assert found["latency"]["met"]


def test_a_stage_stands_beside_plain_opencv_and_a_whole_part_is_judged_by_it():
    part = bench.stage("head", 3.2, 2.0, judged=True)
    assert (part["ratio"], part["target"], part["met"]) == (1.6, 3.0, False)
    assert (part["baseline"], part["baseline_value"]) == ("plain OpenCV", 2.0)
    assert "met" not in bench.stage("contours", 3.2, 2.0, judged=False)


def test_a_drawn_task_passes_through_every_stage(monkeypatch, capsys):
    monkeypatch.setattr(bench, "QUICK", (3, 1))
    assert bench.main(["--quick", "--json"]) == 0
    found = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert found[0]["figure"] == "hardware"
    names = {f["figure"] for f in found}
    assert names >= {"segmentation", "tracking", "head", "yaw_error", "gesture", "core", "latency"}
    assert all(f["bench"] == "perception" for f in found)
    assert all(f["value"] > 0.0 for f in found[1:])
