# SPDX-License-Identifier: BSD-3-Clause
"""hardware.launch without hardware: the driver on the emulated arm moves simulated cubes."""

from __future__ import annotations

import csv

import pytest
from whole_runs import run

WORKER = "beginner_tired_distracted_collaborative"  # leaves the work to the robot
DEVICES = ("arm_port:=emulator", "cell:=simulated", "record:=false")


@pytest.mark.parametrize("scenario", ["inspection", "sorting"])
def test_a_whole_task_runs_through_the_driver(tmp_path, scenario):
    words = (f"scenario:={scenario}", "seed:=101", "speed:=2", f"human:={WORKER}")
    told = run(tmp_path, *DEVICES, *words, launch="hardware")
    (row,) = csv.DictReader((tmp_path / "results.csv").open())
    assert int(row["robot_succeeded"]) > int(row["robot_failed"]), told  # it may misread a colour
    assert "SIGKILL" not in told
    assert "the arm is homed" in told
