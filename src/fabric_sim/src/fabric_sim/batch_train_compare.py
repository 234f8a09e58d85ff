# SPDX-License-Identifier: BSD-3-Clause
"""Which observation model, and how much a task may weigh: the tables of docs/models/abps.md.

    python3 -m fabric_sim.batch_train_compare inspection --seed 101

Known types judge representations by the likelihood of tasks of people held out. People whom nobody
knows judge the weight of a task: by how well the belief predicts what every policy earns with them.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fabric_abps import Job, Library, ObservationModel, TypeBelief, child_seed
from fabric_abps.representations import REPRESENTATIONS, held_out
from fabric_abps.train import Task, jobs_of
from fabric_sim.batch_loop import Files
from fabric_sim.batch_train_people import Recipe, known_types, run_jobs, trainer_of
from fabric_sim.batch_train_work import chunks_of, spread
from fabric_sim.character import Character, named_generator

WEIGHTS = (1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, math.inf)  # effective observations a task
AFTER = (1, 3, 6, 10)  # tasks, of which the tables tell
PERSON = 30  # tasks of a person whom nobody knows


def run_all(recipe: Recipe, jobs: Sequence[Job], processes: int) -> list[list[Task]]:
    """The tasks of every job."""
    trainer_of(recipe)
    chunks = chunks_of(jobs, recipe.scenario)
    found = spread(processes)(partial(run_jobs, recipe), chunks)
    return [session for chunk in found for session in chunk]


def table(sessions: Sequence[Sequence[Task]], rows: int, columns: int) -> list:
    """Sessions as [row][column][person]."""
    people = len(sessions) // (rows * columns)
    it = iter(sessions)
    return [[[next(it) for _ in range(people)] for _ in range(columns)] for _ in range(rows)]


def representations(known: list) -> list[str]:
    """The table of representations."""
    codes = [[[[c for _, c in person] for person in pair] for pair in row] for row in known]
    codes = [
        [[[np.array(c, dtype=np.int64) for c in p] for p in pair] for pair in row] for row in codes
    ]
    after = ", ".join(map(str, AFTER))
    lines = [f"{'representation':<34} {'nats/task':>10}  ln P(true type) after {after} tasks"]
    for representation in REPRESENTATIONS:
        found = {w: held_out(codes, representation, effective=w) for w in WEIGHTS}
        best = max(WEIGHTS, key=lambda w: found[w].log_posterior[: AFTER[-1]].mean())
        truth = found[best].log_posterior
        told = " ".join(f"{truth[n - 1]:6.2f}" for n in AFTER if n <= len(truth))
        likelihood = found[best].likelihood
        lines.append(f"{representation.name:<34} {likelihood:10.2f}  {told}  (weight {best:g})")
    return lines


def weights(known: list, unknown: list, types: Sequence[str]) -> list[str]:
    """The table of weights: errors of what the belief predicts for people whom nobody knows."""
    codes = [[[c for p in pair for _, c in p] for pair in row] for row in known]
    people = [[[n for n, p in enumerate(pair) for _ in p] for pair in row] for row in known]
    model = ObservationModel.fit(codes, people=people)
    mean = _means(known)
    truth = _means(unknown)
    sessions = [[u for u, _ in pair[0]] for row in unknown for pair in row]
    noise = np.mean([np.var(utilities, ddof=1) / len(utilities) for utilities in sessions])
    prior = np.mean((truth - mean.mean(axis=0)) ** 2)
    lines = [
        f"mean squared error of the expected utility, points^2: prior {prior:.2f}, of which chance "
        f"{noise:.2f}",
        f"{'weight':<8} " + " ".join(f"{n:>6}" for n in AFTER) + "  tasks seen",
    ]
    for weight in WEIGHTS:
        errors = [
            _errors(model, weight, mean, truth[number], policy, pair[0], types)
            for number, row in enumerate(unknown)
            for policy, pair in enumerate(row)
        ]
        told = " ".join(f"{error:6.2f}" for error in np.mean(errors, axis=0))
        lines.append(f"{weight:<8g} {told}")
    return lines


def _means(runs: list) -> NDArray:
    """Mean utility, (n_rows, n_policies) points."""
    return np.array([[np.mean([u for p in pair for u, _ in p]) for pair in row] for row in runs])


def _errors(
    model: ObservationModel,
    weight: float,
    mean: NDArray,
    truth: NDArray,
    policy: int,
    session: Sequence[Task],
    types: Sequence[str],
) -> list[float]:
    """Mean squared error over the policies after some tasks of a person with one policy."""
    belief, errors = TypeBelief(types), []
    for number, (_, codes) in enumerate(session, 1):
        belief.update(model.log_likelihood(codes, policy, weight))
        if number in AFTER:
            errors.append(float(np.mean((belief.probability @ mean - truth) ** 2)))
    return errors


def main(words: Sequence[str] | None = None) -> int:
    """Run people and print the tables; return the exit code."""
    parser = argparse.ArgumentParser(description="Compare observation models.")
    parser.add_argument("scenario", choices=["inspection", "sorting"])
    parser.add_argument("--library", type=Path, help="folder or index; empty is the shipped one")
    parser.add_argument("--seed", type=int, default=101)
    parser.add_argument("--tasks", type=int, default=90, help="of a policy and type")
    parser.add_argument("--people", type=int, default=24, help="whom nobody knows")
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args(words)
    shipped = Files().share("fabric_abps") / "library" / given.scenario
    library = Library.load(given.library or shipped, given.scenario)
    recipe, types = Recipe.of(library), known_types(16)
    characters = [
        Character.random(named_generator(given.seed, "comparison person", number)).name
        for number in range(given.people)
    ]
    strangers = [
        Job(policy, name, child_seed(given.seed, "stranger", policy, name), PERSON)
        for name in characters
        for policy in library.names
    ]
    jobs = jobs_of(library, types, given.tasks, given.seed)
    known = table(run_all(recipe, jobs, given.jobs), len(types), len(library.names))
    unknown = table(run_all(recipe, strangers, given.jobs), given.people, len(library.names))
    print("\n".join([*representations(known), "", *weights(known, unknown, types)]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
