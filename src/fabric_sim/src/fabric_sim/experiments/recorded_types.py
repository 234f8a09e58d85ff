# SPDX-License-Identifier: BSD-3-Clause
"""Are the people believable? Our workers beside the recorded behaviour of five types.

Recorded were the simulated workers of the original system in its inspection scenario, averaged over
that system's robots. Ours work beside our own robots, each task with a fresh person. What is
compared, and how it is made comparable, stands in MEASURES and in docs/models/worker.md.
"""

from __future__ import annotations

import math
import multiprocessing
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from scipy import stats
from tqdm import tqdm

from fabric_sim.batch_loop import HeadlessRun, RunSetup
from fabric_sim.character import Character
from fabric_sim.experiments.observed_worker import FreshStaff, TaskRecord
from fabric_sim.worker_model import ModelLibrary
from fabric_sim.worker_parameters import STATES, WorkerParameters

#: The recorded robots did not grasp again at once after a warning; nor do these.
ROBOTS = ("proactive", "patient", "eager", "reactive_waiting")
ALONE = "none"
LOST_AFTER = 52.0  # s; what a lost package counts, as in the recordings
STEP = 4.5  # s; a recorded turn in which the person only watches: a moment of idling, a decision
FEW_STEPS = 30.0  # fewer steps than this with an interfering robot are not judged
SEEDS, TASKS = range(1, 11), 25  # of a report: runs of each robot and type, tasks of each run
QUICK_SEEDS, QUICK_TASKS = range(1, 3), 4

Range = tuple[float, float]


@dataclass(frozen=True)
class Recorded:
    """A recorded type as the dials say it; ranges are those over all types that share the value."""

    name: str
    character: Character
    success: float
    by_robot: float
    duration: float
    decisions: float
    warned: Range
    lifted: Range


_WILLING, _UNWILLING = (0.09, 0.13), (0.47, 0.57)
_BEGINNERS, _DISTRACTED = (0.29, 0.33), (0.62, 0.73)
RECORDED = (
    Recorded(
        "beginner, rested", Character(0, 1, 1, 1), 0.782, 0.34, 36.5, 5.5, _WILLING, _BEGINNERS
    ),
    Recorded(
        "beginner, tired, unwilling",
        Character(0, 0, 1, 0), 0.786, 0.52, 35.6, 6.6, _UNWILLING, _BEGINNERS,
    ),
    Recorded(
        "distracted", Character(0.5, 0.5, 0, 1), 0.937, 0.55, 29.3, 5.7, _WILLING, _DISTRACTED
    ),
    Recorded("expert, rested", Character(1, 1, 1, 1), 0.996, 0.04, 11.1, 2.8, _WILLING, (1, 1)),
    Recorded(
        "expert, tired", Character(1, 0, 1, 1), 0.988, 0.30, 17.9, 4.1, _WILLING, (0.86, 0.89)
    ),
)  # fmt: skip


def seconds(record: TaskRecord) -> float:
    """Duration of a task in s; a lost package counts LOST_AFTER."""
    return record.duration if record.success else LOST_AFTER


def steps_interfered(records: Sequence[TaskRecord]) -> float:
    """Recorded-like steps with an interfering robot: one a warning, one each STEP of watching."""
    watched = sum(record.seconds["robot_interfered"] for record in records)
    return sum(record.refusals for record in records) + watched / STEP


def decisions(record: TaskRecord) -> float:
    """Recorded-like decisions of a task: actions begun, and one each STEP of watching the robot."""
    return record.actions + record.seconds["robot_interfered"] / STEP


def _warned(records: Sequence[TaskRecord]) -> float:
    steps = steps_interfered(records)
    return sum(record.refusals for record in records) / steps if steps else math.nan


def _lifted(records: Sequence[TaskRecord]) -> float:
    return _mean([lifted for record in records for lifted in record.attempts])


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if len(values) else math.nan


@dataclass(frozen=True)
class Measure:
    """One line of the comparison; the gate is absolute (within .05) or relative (within 20 %)."""

    name: str
    recorded: Callable[[Recorded], Range]
    ours: Callable[[Sequence[TaskRecord]], float]
    digits: int
    within: float | None = None
    share: float | None = None

    def tolerance(self, near: float) -> float | None:
        """How far from `near`, the nearest recorded value, ours may be; None without a gate."""
        return self.within if self.share is None else self.share * near


MEASURES = (
    Measure(
        "success",
        lambda r: (r.success, r.success),
        lambda tasks: _mean([task.success for task in tasks]),
        3,
        within=0.05,
    ),
    Measure(
        "done by the robot",
        lambda r: (r.by_robot, r.by_robot),
        lambda tasks: _mean([task.success and not task.by_person for task in tasks]),
        2,
    ),
    Measure(
        "time, s",
        lambda r: (r.duration, r.duration),
        lambda tasks: _mean([seconds(task) for task in tasks]),
        1,
        share=0.2,
    ),
    Measure(
        "decisions per task",
        lambda r: (r.decisions, r.decisions),
        lambda tasks: _mean([decisions(task) for task in tasks]),
        1,
        share=0.2,
    ),
    Measure("P(warn next | robot interfered)", lambda r: r.warned, _warned, 2, within=0.05),
    Measure(
        "P(success | grasp while evaluating)", lambda r: r.lifted, _lifted, 2, within=0.05
    ),
)  # fmt: skip


@dataclass(frozen=True)
class Line:
    """One type and measure: ours with the half width of its 95 % interval, and the gate.

    met is None without a gate, or where the robots interfered too rarely to judge.
    """

    type: str
    measure: str
    ours: float
    half: float
    recorded: Range
    digits: int
    met: bool | None


@dataclass(frozen=True)
class TypeResult:
    """Everything measured of one type: records by robot, then by seed."""

    recorded: Recorded
    records: dict[str, list[list[TaskRecord]]]

    def seeds(self) -> list[list[TaskRecord]]:
        """The records of each seed, over all robots."""
        return [sum(runs, []) for runs in zip(*(self.records[r] for r in ROBOTS), strict=True)]

    def tasks(self, robots: Sequence[str] = ROBOTS) -> list[TaskRecord]:
        """All records beside some robots."""
        return [record for robot in robots for run in self.records[robot] for record in run]

    def lines(self) -> list[Line]:
        """Return the comparison of this type."""
        return [self._line(measure) for measure in MEASURES]

    def _line(self, measure: Measure) -> Line:
        ours, half = jackknife(self.seeds(), measure.ours)
        least, most = measure.recorded(self.recorded)
        near = min(max(ours, least), most)
        tolerance = measure.tolerance(near)
        rare = measure.ours is _warned and steps_interfered(self.tasks()) < FEW_STEPS
        judged = tolerance is not None and not rare and math.isfinite(ours)
        met = abs(ours - near) <= tolerance if judged else None
        return Line(
            self.recorded.name, measure.name, ours, half, (least, most), measure.digits, met
        )

    def occupancy(self) -> dict[str, float]:
        """Share of the time in each state of STATES beside the robots; sums to 1."""
        tasks = self.tasks()
        spent = {state: sum(task.seconds[state] for task in tasks) for state in STATES}
        total = sum(spent.values())
        return {state: value / total for state, value in spent.items()}


def jackknife(
    groups: Sequence[Sequence[TaskRecord]], statistic: Callable[[Sequence[TaskRecord]], float]
) -> tuple[float, float]:
    """Return a statistic of all records and the half width of its 95 % interval.

    The interval leaves out one group (seed) at a time: the robots of a seed meet the same people.
    """
    value = statistic([record for group in groups for record in group])
    n = len(groups)
    if n < 2:
        return value, math.nan
    left = [
        statistic([record for j, group in enumerate(groups) if j != i for record in group])
        for i in range(n)
    ]
    spread = math.sqrt((n - 1) / n * float(np.sum((np.array(left) - np.mean(left)) ** 2)))
    return value, float(stats.t.ppf(0.975, n - 1)) * spread


@cache
def _people() -> tuple[WorkerParameters, ModelLibrary]:
    parameters = WorkerParameters.load()
    return parameters, ModelLibrary(parameters.model)


Job = tuple[Character, str, int, int]  # who, which robot, seed, tasks


def run_job(job: Job) -> list[TaskRecord]:
    """Run the inspection tasks of one seed; returns their records without the events."""
    character, robot, seed, tasks = job
    staff = FreshStaff(character, *_people())
    run = HeadlessRun(RunSetup("inspection", character.name, robot, seed), staff=staff)
    records = []
    for number in range(1, tasks + 1):
        run.run_task()
        records.append(staff.worker(number).record.without_events())
    return records


def measure(tasks: int, seeds: Sequence[int], jobs: int) -> list[TypeResult]:
    """Run every type beside every robot and alone: `tasks` tasks for each seed.

    jobs: processes. Raises ValueError for a number of tasks, seeds or processes below one.
    """
    for name, value in (("tasks", tasks), ("seeds", len(seeds)), ("jobs", jobs)):
        if value < 1:
            raise ValueError(f"{name}: {value} is less than 1")
    _people()  # before the processes fork
    cases = [(r, robot, seed) for r in RECORDED for robot in (*ROBOTS, ALONE) for seed in seeds]
    work = [(r.character, robot, seed, tasks) for r, robot, seed in cases]
    fork = multiprocessing.get_context("fork")
    with ProcessPoolExecutor(min(jobs, len(work)), mp_context=fork) as pool:
        done = tqdm(pool.map(run_job, work), total=len(work), unit="run", leave=False)
        found = list(done)
    by_case = iter(found)
    return [
        TypeResult(r, {robot: [next(by_case) for _ in seeds] for robot in (*ROBOTS, ALONE)})
        for r in RECORDED
    ]


def run(quick: bool, jobs: int) -> Any:
    """Measure with the seeds of a report; quick: few tasks, enough to see that it works."""
    from fabric_sim.experiments.recorded_types_report import RecordedTypes  # noqa: PLC0415

    seeds, tasks = (QUICK_SEEDS, QUICK_TASKS) if quick else (SEEDS, TASKS)
    return RecordedTypes(measure(tasks, seeds, jobs))
