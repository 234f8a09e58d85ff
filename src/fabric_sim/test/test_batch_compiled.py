# SPDX-License-Identifier: BSD-3-Clause
"""The compiled modules and their sources are one program."""

import os
import pickle
import subprocess
import sys

import pytest

from fabric_sim.batch_files import Files
from fabric_sim.batch_loop import HeadlessRun, RunSetup

STORY = """
import hashlib, sys
from fabric_sim import batch_loop, cell
from fabric_sim.batch_loop import HeadlessRun, RunSetup
scenario, human, tasks = sys.argv[1:]
run = HeadlessRun(RunSetup(scenario, human, "reactive", 109, 0.2))
told = hashlib.sha256()
for _ in range(int(tasks)):
    result = run.run_task()
    told.update(repr((run.event_log(), result.row, result.codes)).encode())
print(told.hexdigest(), {module.__file__.endswith(".py") for module in (batch_loop, cell)})
"""


def story(compiled, *arguments):
    """Hash of everything that happened, and whether it was the sources that ran."""
    environment = os.environ | {"FABRIC_COMPILED": "1" if compiled else "0"}
    command = [sys.executable, "-c", STORY, *arguments]
    told = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return told.stdout.split()


@pytest.mark.parametrize("human", ["mixed", "drifting"])
@pytest.mark.parametrize("scenario, tasks", [("inspection", "8"), ("sorting", "1")])
def test_the_same_events_come_out(scenario, human, tasks):
    digest, from_sources = story(False, scenario, human, tasks)
    assert from_sources == "{True}"
    assert story(True, scenario, human, tasks)[0] == digest


def test_settings_and_results_travel_between_processes():
    setup = RunSetup(seed=109)
    config = Files().cell()
    for thing in (setup, config.sensing, config.arm, HeadlessRun(setup).run_task().row):
        assert pickle.loads(pickle.dumps(thing)) == thing
