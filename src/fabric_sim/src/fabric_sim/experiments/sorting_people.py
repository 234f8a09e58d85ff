# SPDX-License-Identifier: BSD-3-Clause
"""People who sort beside recorded ones: the protocol of Experiment-1 (thesis section 6.3.2).

Every simulated person, a random point of the character cube, sorts once alone, three times beside
the reactive robot and three times beside the proactive one, ten cubes each time; every other person
meets the proactive robot first. Recorded were 14 people, whose means are published. No goal is
set: the cube is not that study's choice of people, and its robots were others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np
from scipy import stats

from fabric_planner import AlphaVectors
from fabric_sim.batch_decider import AgentDecider
from fabric_sim.batch_loop import Files, HeadlessRun, RunSetup
from fabric_sim.character import Character, named_generator
from fabric_sim.experiments.jobs import run_jobs
from fabric_sim.staff import Staff

SCENARIO = "sorting"
ALONE = "none"
ROBOTS = (ALONE, "reactive", "proactive")
TASKS = {ALONE: 1, "reactive": 3, "proactive": 3}
NAMES = {ALONE: "alone", "reactive": "reactive", "proactive": "proactive"}


@dataclass(frozen=True)
class Measure:
    """A line of the comparison; published: the mean with each of ROBOTS, None if there is none."""

    name: str
    published: tuple[float | None, float | None, float | None]
    digits: int


#: Figures of a task (Eq. 6.2-6.6), in the order of `figures`, and what is worked out of them.
MEASURES = (
    Measure("task success", (0.6036, 0.8119, 0.8478), 2),
    Measure("success of the person's own", (0.6036, 0.7418, 0.8129), 2),
    Measure("contribution of the person", (0.6036, 0.5571, 0.6952), 2),
    Measure("efficiency", (0.39, 0.47, 0.61), 2),
    Measure("placed right by the robot, share", (0.0, 0.2548, 0.1526), 2),
    Measure("warnings", (None, 6.79, 1.88), 1),
    Measure("reward", (None, 10.88, 28.95), 1),
    Measure("duration, s", (None, None, None), 0),
)
CUBES = 10  # of a task
RATIO = Measure("its right cubes / (these + warnings)", (None, 0.273, 0.448), 2)


def figures(row: dict[str, Any]) -> list[float]:
    """Return what MEASURES names of one row of results.csv; NaN where it is undefined."""
    success, contribution = row["task_success_rate"], row["human_contribution"]
    own = row["human_success_rate"]
    return [
        success,
        np.nan if own is None else own,
        contribution,
        row["efficiency"],
        success - contribution,
        row["warnings"],
        row["discounted_reward"],
        row["duration_s"],
    ]


@dataclass(frozen=True)
class SortingPeople:
    """Means of each person's tasks, (n_people, len(ROBOTS), len(MEASURES)), NaN if undefined."""

    people: np.ndarray
    seed: int

    def means(self) -> tuple[np.ndarray, np.ndarray]:
        """Return means over people and half widths of their 95 % intervals (jackknife).

        (len(ROBOTS), len(MEASURES) + 1) each; RATIO comes last.
        """
        found, n = _means(self.people), len(self.people)
        left = np.stack([_means(np.delete(self.people, i, axis=0)) for i in range(n)])
        spread = np.sqrt((n - 1) / n * ((left - left.mean(axis=0)) ** 2).sum(axis=0))
        return found, stats.t.ppf(0.975, n - 1) * spread

    def table(self) -> list[list[str]]:
        """Return ours and, in the column after it, the published."""
        head = [""]
        for robot in ROBOTS:
            head += [NAMES[robot], "published"]
        means, halves = self.means()
        lines = [head]
        for m, measure in enumerate((*MEASURES, RATIO)):
            line = [measure.name]
            for r in range(len(ROBOTS)):
                line += [_ours(means[r, m], halves[r, m], measure.digits)]
                line += [_theirs(measure.published[r], measure.digits)]
            lines.append(line)
        return lines

    def json_rows(self) -> list[dict[str, Any]]:
        """One object a robot and measure."""
        means, halves = self.means()
        return [
            {
                "robot": NAMES[robot],
                "measure": measure.name,
                "ours": _number(means[r, m]),
                "half_width_95": _number(halves[r, m]),
                "published": measure.published[r],
            }
            for r, robot in enumerate(ROBOTS)
            for m, measure in enumerate((*MEASURES, RATIO))
        ]


def _means(people: np.ndarray) -> np.ndarray:
    """(len(ROBOTS), len(MEASURES) + 1) over people; the last column is RATIO."""
    known = np.isfinite(people)
    counts = known.sum(axis=0)
    total = np.where(known, people, 0.0).sum(axis=0)
    means = np.where(counts > 0, total / np.maximum(counts, 1), np.nan)
    names = [measure.name for measure in MEASURES]
    placed = CUBES * means[:, names.index("placed right by the robot, share")]
    asked = placed + means[:, names.index("warnings")]
    ratio = np.where(asked > 0.0, placed / np.where(asked > 0.0, asked, 1.0), np.nan)
    return np.column_stack((means, ratio))


def _ours(mean: float, half: float, digits: int) -> str:
    return f"{mean:.{digits}f} +- {half:.{digits}f}" if np.isfinite(mean) else "-"


def _theirs(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"


def _number(value: float) -> float | None:
    return round(float(value), 6) if np.isfinite(value) else None


@cache
def _solved(robot: str) -> AlphaVectors:
    return Files().solve(robot, SCENARIO)


def run(people: int, seed: int, jobs: int) -> SortingPeople:
    """Let `people` random people go through the protocol; equal for the same people and seed.

    Raises ValueError for fewer than two people: their means would have no interval.
    """
    if people < 2:
        raise ValueError(f"people: {people} is less than 2")
    for robot in ROBOTS[1:]:
        _solved(robot)  # before the processes fork
    found = run_jobs(partial(_person, seed), range(people), jobs, "people who sort")
    return SortingPeople(np.array(found), seed)


def order_of(number: int) -> Sequence[str]:
    """The robots in the order in which a person meets them."""
    return ROBOTS if number % 2 == 0 else (ALONE, *reversed(ROBOTS[1:]))


def _person(seed: int, number: int) -> list[list[float]]:
    """(len(ROBOTS), len(MEASURES)): means of one person's tasks; the person goes on through all."""
    root = 1000 * seed + number
    person = Character.random(named_generator(root, "people who sort")).name
    staff, files, found = Staff(person, root), Files(), {}
    for robot in order_of(number):
        setup = RunSetup(SCENARIO, person, robot, root)
        run = HeadlessRun(setup, files, staff, _decider(robot, files))
        rows = [figures(run.run_task().row) for _ in range(TASKS[robot])]
        found[robot] = [_mean(column) for column in np.array(rows, dtype=float).T]
    return [found[robot] for robot in ROBOTS]


def _decider(robot: str, files: Files) -> AgentDecider:
    model = files.model(robot, SCENARIO)
    if robot == ALONE:
        return AgentDecider(files.agent(model))
    return AgentDecider(files.offline_agent(model, _solved(robot)))


def _mean(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else float("nan")
