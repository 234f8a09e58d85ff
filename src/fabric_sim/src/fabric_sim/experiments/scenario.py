# SPDX-License-Identifier: BSD-3-Clause
"""One scenario of the short-term study: one drifting person, one robot, task after task."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from fabric_sim.batch_loop import HeadlessRun, RunSetup
from fabric_sim.drift import DriftingStaff
from fabric_sim.experiments.observed_worker import ObservedWorker, TaskRecord
from fabric_sim.experiments.robots import (
    FILES,
    RUNNING,
    SCENARIO,
    STAGE_1,
    STAGE_2,
    Believed,
    decider_of,
    model_of,
)
from fabric_sim.worker_model import ModelLibrary
from fabric_sim.worker_parameters import WorkerParameters
from fabric_study.meter import COLUMNS, Value

#: What the person was seen to be in: name of the column of seconds, states of the worker.
OCCUPIED = {
    "evaluating_s": ("evaluating",),  # without the time of a grasp, which is work
    "no_attention_s": ("no_attention",),
    "tired_s": ("tired", "recovery"),
    "failed_to_grasp_s": ("failed_to_grasp",),
    "warning_s": ("warns_the_robot",),
}
OWN_COLUMNS = ("noise", "robot", "scenario_seed", "mood")
COUNT_COLUMNS = (
    "stage1_right",
    "stage1_judged",
    "stage2_right",
    "stage2_judged",
    "all_right",
    "all_judged",
)
TASK_COLUMNS = (*OWN_COLUMNS, *COLUMNS, *COUNT_COLUMNS, "present_s", *OCCUPIED)


@dataclass(frozen=True)
class ScenarioJob:
    """What defines a scenario. folder: where models made for the study lie."""

    robot: str
    noise: float  # probability that a stretch of behaviour is recognised wrongly
    seed: int
    tasks: int
    folder: Path


@dataclass(frozen=True)
class ScenarioResult:
    """rows: one a task, TASK_COLUMNS. believed: counts of decisions over the scenario."""

    job: ScenarioJob
    rows: list[dict[str, Value]]
    believed: Counter[Believed]


@cache
def _people() -> tuple[WorkerParameters, ModelLibrary]:
    """Parameters and models of people, shared by the scenarios of a process."""
    parameters = WorkerParameters.load()
    return parameters, ModelLibrary(parameters.model)


def run_scenario(job: ScenarioJob) -> ScenarioResult:
    """Run all tasks of a scenario in order."""
    staff = DriftingStaff(job.seed, None, *_people(), make_worker=ObservedWorker)
    worker = staff.worker(1)
    decider = decider_of(job.robot, model_of(job.robot, job.folder))
    setup = RunSetup(SCENARIO, "drifting", job.robot, job.seed, job.noise)
    run = HeadlessRun(setup, FILES, staff=staff, decider=decider)
    rows, believed = [], Counter()
    for number in range(1, job.tasks + 1):
        row = run.run_task().row
        own = dict(
            zip(OWN_COLUMNS, (job.noise, job.robot, job.seed, staff.mood(number)), strict=True)
        )
        seconds = occupied_seconds(worker.record)
        rows.append({**own, **row, **stage_counts(decider.believed), **seconds})
        believed += decider.believed
    return ScenarioResult(job, rows, believed)


def stage_counts(believed: Mapping[Believed, int]) -> dict[str, int]:
    """Return COUNT_COLUMNS: decisions while the truth was in a stage, and those that were right.

    `all` takes every decision but the one that the task's end brings, which nobody can get wrong.
    """
    counts = []
    for stage in (STAGE_1, STAGE_2, RUNNING):
        judged = {pair: n for pair, n in believed.items() if pair.truth in stage}
        counts.append(sum(n for pair, n in judged.items() if pair.truth == pair.belief))
        counts.append(sum(judged.values()))
    return dict(zip(COUNT_COLUMNS, counts, strict=True))


def occupied_seconds(record: TaskRecord) -> dict[str, float]:
    """Return the seconds from the package's coming to its end, and those of OCCUPIED."""
    seconds = dict(record.seconds)
    present = sum(seconds.values())
    seconds["evaluating"] -= record.handling
    occupied = {name: sum(seconds[state] for state in states) for name, states in OCCUPIED.items()}
    return {"present_s": present, **occupied}
