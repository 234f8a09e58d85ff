# SPDX-License-Identifier: BSD-3-Clause
"""Whole runs of launch files, each with a master of its own, and of the headless runner."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from fabric_bringup import arguments, ports

DEADLINE = 400  # s, wall time for a whole run


@contextmanager
def running(
    folder: Path, *words: str, launch: str = "sim", named: str = "out_dir"
) -> Iterator[subprocess.Popen]:
    """A launch file with a master of its own; what it says is on stdout.

    named: the argument that is told the folder.
    """
    port = ports.any_free()
    environment = os.environ | {
        "ROS_MASTER_URI": f"http://localhost:{port}",
        "ROS_HOSTNAME": "localhost",
        "ROS_LOG_DIR": str(folder / "log"),
    }
    roslaunch = ["roslaunch", "--no-summary", "--skip-log-check", "-p", str(port), "fabric_bringup"]
    command = [*roslaunch, f"{launch}.launch", f"{named}:={folder}", *words]
    process = subprocess.Popen(
        command, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(DEADLINE)


def run(folder: Path, *words: str, launch: str = "sim") -> str:
    """A run to its end; returns what it said."""
    with running(folder, *words, launch=launch) as process:
        told, _ = process.communicate(timeout=DEADLINE)
    assert status(folder) == "finished", told
    return told


def outcome(folder: Path, launch: str, *words: str) -> dict:
    """Another launch file to its end; what is in the summary it writes last, `launch`.json."""
    with running(folder, *words, launch=launch) as process:
        told, _ = process.communicate(timeout=DEADLINE)
    summary = folder / f"{launch}.json"
    assert summary.exists(), told
    return json.loads(summary.read_text())


def status(folder: Path) -> str:
    return json.loads((folder / "run.json").read_text())["status"]


def event_log(told: str) -> str:
    """The hash of the event log in what a run said."""
    (line,) = [line for line in told.splitlines() if line.startswith("event log ")]
    return line.split()[-1]


def headless(folder: Path, *words: str) -> tuple[str, str]:
    """The results file and the event log's hash of the same words through the headless runner."""
    checked = arguments.parse("batch", [f"out_dir:={folder}", *words])
    command = [sys.executable, "-m", "fabric_sim.batch"]
    command += [f"{name}:={value}" for name, value in checked.items()]
    done = subprocess.run(command, check=True, timeout=DEADLINE, text=True, stdout=subprocess.PIPE)
    return (folder / "results.csv").read_text(), event_log(done.stdout)
