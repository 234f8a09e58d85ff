# SPDX-License-Identifier: BSD-3-Clause
"""Section 6.4.2, Fig. 6.29a: how likely is what one known type did, if it had been another one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from fabric_sim.batch_loop import RunSetup
from fabric_sim.character import CORNERS
from fabric_sim.experiments.explain import Explainer
from fabric_sim.experiments.jobs import run_jobs
from fabric_sim.experiments.recorder import ROBOTS, simulated_trials
from fabric_sim.experiments.watching import Watching

TYPES = tuple(CORNERS)
SHORT = {
    "beginner": "B", "expert": "E", "tired": "T", "rested": "R", "distracted": "D",
    "attentive": "A", "noncollaborative": "N", "collaborative": "C",
}  # fmt: skip
NEEDED = 14  # rows whose largest entry has to be on the diagonal


def short_name(name: str) -> str:
    """Four letters for a corner's name, ERAC for expert_rested_attentive_collaborative."""
    return "".join(SHORT[word] for word in name.split("_"))


@dataclass(frozen=True)
class Explained:
    """Trials of one person or type: scores (n_trials, 16) under the types, observations of each."""

    scores: np.ndarray
    observations: np.ndarray

    @property
    def mean_log_likelihood(self) -> np.ndarray:
        """(16,): nats per observation."""
        return self.scores.sum(axis=0) / self.observations.sum()

    @property
    def likelihood(self) -> np.ndarray:
        """(16,): per observation, the geometric mean over all of them."""
        return np.exp(self.mean_log_likelihood)

    @property
    def task_mean(self) -> np.ndarray:
        """(16,): the mean over tasks of each task's geometric mean per observation."""
        return np.exp(self.scores / self.observations[:, None]).mean(axis=0)


@dataclass(frozen=True)
class Matrix:
    """One `Explained` a generating type, in the order of TYPES."""

    rows: tuple[Explained, ...]
    tasks: int
    seed: int

    @property
    def likelihood(self) -> np.ndarray:
        """(16, 16): row who did it, column who explains it."""
        return np.stack([row.likelihood for row in self.rows])

    @property
    def mean_log_likelihood(self) -> np.ndarray:
        """(16, 16), nats per observation."""
        return np.stack([row.mean_log_likelihood for row in self.rows])

    @property
    def task_mean(self) -> np.ndarray:
        """(16, 16): `Explained.task_mean`."""
        return np.stack([row.task_mean for row in self.rows])

    @property
    def on_diagonal(self) -> int:
        """Rows whose largest likelihood is on the diagonal."""
        return int((self.likelihood.argmax(axis=1) == np.arange(len(TYPES))).sum())

    @property
    def passed(self) -> bool:
        """The gate of the issue."""
        return self.on_diagonal >= NEEDED


def run(watching: Watching, tasks: int, seed: int, jobs: int) -> Matrix:
    """Let every type do `tasks` inspection tasks beside each robot, as a new person each time."""
    work = partial(_row, watching, tasks, seed)
    rows = run_jobs(work, TYPES, jobs, "known types")
    return Matrix(tuple(rows), tasks * len(ROBOTS), seed)


def _row(watching: Watching, tasks: int, seed: int, name: str) -> Explained:
    trials = []
    for robot in ROBOTS:
        setup = RunSetup("inspection", name, robot, seed)
        trials += simulated_trials(setup, tasks, name, fresh=True)
    return explained(Explainer(watching).fresh(list(CORNERS.values()), trials), trials)


def explained(scores: np.ndarray, trials: Sequence) -> Explained:
    """Return scores (n_trials, 16) together with how much was observed."""
    return Explained(scores, np.array([trial.observations for trial in trials]))
