# SPDX-License-Identifier: BSD-3-Clause
"""The people of a folder: which types explain them, their dials, and what the dials predict."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.stats import t as student

from fabric_sim.character import CORNERS, Character
from fabric_sim.experiments.dial_fit import Exploration, Fit
from fabric_sim.experiments.explain import Explainer, persistence_scores, uniform_scores
from fabric_sim.experiments.jobs import run_jobs
from fabric_sim.experiments.likelihood_matrix import Explained, explained
from fabric_sim.experiments.trials import Trial, by_person
from fabric_sim.experiments.watching import Watching
from fabric_sim.experiments.watching_fit import watching_of_people

#: Predictions of held-out tasks: the fit, the baselines of the issue, two more for orientation.
PREDICTORS = ("fitted dials", "best known type", "uniform", "persistence", "average over dials")
GATED = ("uniform", "best known type")


@dataclass(frozen=True)
class PersonResult:
    """One person.

    types: how the 16 known types explain all tasks. predictions: (n_tasks, 5) log-likelihood of
    each task by PREDICTORS that saw the other tasks; None with a single task.
    """

    name: str
    fit: Fit
    types: Explained
    predictions: np.ndarray | None
    watching: Watching


@dataclass(frozen=True)
class Comparison:
    """Fitted dials against a baseline on held-out tasks, nats: total, mean a task and half of its
    95 % interval (Student's t over tasks), number of tasks."""

    baseline: str
    total: float
    mean: float
    half: float
    tasks: int

    @property
    def beaten(self) -> bool:
        """The dials predict more."""
        return self.total > 0.0


@dataclass(frozen=True)
class PeopleResult:
    """Everybody of a folder."""

    folder: str
    people: tuple[PersonResult, ...]

    @property
    def predictions(self) -> np.ndarray:
        """(n, 5): held-out tasks of everybody."""
        tables = [p.predictions for p in self.people if p.predictions is not None]
        return np.vstack(tables) if tables else np.empty((0, len(PREDICTORS)))

    @property
    def observations(self) -> int:
        """In all held-out tasks."""
        kept = [p for p in self.people if p.predictions is not None]
        return int(sum(p.types.observations.sum() for p in kept))

    def comparisons(self) -> list[Comparison]:
        """The fitted dials against every other predictor, paired by task."""
        table = self.predictions
        return [_compare(name, table[:, 0] - table[:, k]) for k, name in _others() if len(table)]

    @property
    def passed(self) -> bool:
        """The gate: better than both baselines of the issue."""
        found = {c.baseline: c.beaten for c in self.comparisons()}
        return bool(found) and all(found[name] for name in GATED)


def _others() -> list[tuple[int, str]]:
    return list(enumerate(PREDICTORS))[1:]


def _compare(name: str, gains: np.ndarray) -> Comparison:
    n = len(gains)
    half = math.nan
    if n > 1:
        half = float(student.ppf(0.975, n - 1) * gains.std(ddof=1) / math.sqrt(n))
    return Comparison(name, float(gains.sum()), float(gains.mean()), half, n)


def run(folder: str, trials: Sequence[Trial], start: Watching, seed: int, jobs: int):
    """Fit everybody; `start` is how the simulated cell watches."""
    people = by_person(trials)
    watching = watching_of_people(trials, start, jobs)
    work = partial(_fit, watching, seed)
    found = run_jobs(work, list(people.items()), jobs, "people")
    return PeopleResult(folder, tuple(found))


def _fit(watching: dict[str, Watching], seed: int, person: tuple[str, list[Trial]]):
    name, trials = person
    return fit_person(name, trials, watching[name], seed)


def fit_person(name: str, trials: list[Trial], watching: Watching, seed: int) -> PersonResult:
    """Return the dials of one person, and how well each task is predicted by the others."""
    explainer = Explainer(watching)

    def scores(characters: Sequence[Character]) -> np.ndarray:
        return explainer.person(characters, trials)

    exploration = Exploration(scores, seed)
    assert exploration.corner_table.shape[1] == len(CORNERS)
    types = explained(exploration.corner_table.copy(), trials)
    predictions = None
    if len(trials) > 1:
        predictions = np.array([_predict(exploration, trials, k) for k in range(len(trials))])
    return PersonResult(name, exploration.fit(), types, predictions, watching)


def _predict(exploration: Exploration, trials: list[Trial], k: int) -> list[float]:
    """Log-likelihood of task k by PREDICTORS."""
    best, corner, mixed = exploration.predict(k)
    held_in = trials[:k] + trials[k + 1 :]
    uniform = float(uniform_scores([trials[k]])[0])
    persistence = float(persistence_scores([trials[k]], held_in)[0])
    return [best, corner, uniform, persistence, mixed]
