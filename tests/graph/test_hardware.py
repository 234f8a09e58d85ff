# SPDX-License-Identifier: BSD-3-Clause
"""hardware.launch without hardware: the driver on the emulated arm moves simulated cubes."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
from pathlib import Path

import pytest

from fabric_bringup import ports

DEADLINE = 400  # s, wall time for a whole run
WORKER = "beginner_tired_distracted_collaborative"  # leaves the work to the robot


def run(folder: Path, *words: str) -> str:
    """hardware.launch with a master of its own to its end; what it said."""
    port = ports.any_free()
    environment = os.environ | {
        "ROS_MASTER_URI": f"http://localhost:{port}",
        "ROS_HOSTNAME": "localhost",
        "ROS_LOG_DIR": str(folder / "log"),
    }
    launch = ["roslaunch", "--no-summary", "--skip-log-check", "-p", str(port), "fabric_bringup"]
    devices = ["arm_port:=emulator", "cell:=simulated", "record:=false", f"out_dir:={folder}"]
    process = subprocess.Popen(
        [*launch, "hardware.launch", *devices, *words],
        env=environment,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    try:
        told, _ = process.communicate(timeout=DEADLINE)
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(DEADLINE)
    assert json.loads((folder / "run.json").read_text())["status"] == "finished", told
    return told


@pytest.mark.parametrize("scenario", ["inspection", "sorting"])
def test_a_whole_task_runs_through_the_driver(tmp_path, scenario):
    told = run(tmp_path, f"scenario:={scenario}", "seed:=101", "speed:=2", f"human:={WORKER}")
    (row,) = csv.DictReader((tmp_path / "results.csv").open())
    assert int(row["robot_succeeded"]) > int(row["robot_failed"]), told  # it may misread a colour
    assert "SIGKILL" not in told
    assert "the arm is homed" in told
