# SPDX-License-Identifier: BSD-3-Clause
"""Are dials found again that are known? Simulated people of random types, recorded and fitted."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fabric_sim.batch_loop import RunSetup
from fabric_sim.character import Character, named_generator
from fabric_sim.experiments.dial_fit import Exploration, Fit
from fabric_sim.experiments.explain import Explainer
from fabric_sim.experiments.jobs import run_jobs
from fabric_sim.experiments.recorder import ROBOTS, simulated_trials
from fabric_sim.experiments.watching import Watching


@dataclass(frozen=True)
class Recovery:
    """True dials (n, 4) of simulated people and what was fitted."""

    true: np.ndarray
    fits: tuple[Fit, ...]

    @property
    def best(self) -> np.ndarray:
        """(n, 4) maximum likelihood."""
        return np.stack([fit.best for fit in self.fits])

    @property
    def mean(self) -> np.ndarray:
        """(n, 4) means of the likelihood over the dials."""
        return np.stack([fit.mean for fit in self.fits])

    @property
    def covered(self) -> np.ndarray:
        """(n, 4): whether the 95 % interval holds the truth."""
        least = np.stack([fit.least for fit in self.fits])
        most = np.stack([fit.most for fit in self.fits])
        return (least <= self.true) & (self.true <= most)

    @property
    def error(self) -> np.ndarray:
        """(4,): root mean square error of `best`."""
        return np.sqrt(((self.best - self.true) ** 2).mean(axis=0))

    @property
    def correlation(self) -> np.ndarray:
        """(4,): of `best` with the truth."""
        return np.array([np.corrcoef(self.true[:, d], self.best[:, d])[0, 1] for d in range(4)])

    @property
    def width(self) -> np.ndarray:
        """(4,): mean width of the intervals."""
        return np.stack([fit.most - fit.least for fit in self.fits]).mean(axis=0)


def run(watching: Watching, people: int, seed: int, jobs: int) -> Recovery:
    """Draw people, let each sort ten cubes beside each of ROBOTS, fit them from what was seen."""
    rng = named_generator(seed, "recovery")
    true = [Character.random(rng) for _ in range(people)]
    work = partial(_fit, watching, seed)
    fits = run_jobs(work, list(enumerate(true)), jobs, "known dials")
    return Recovery(np.array([c.dials for c in true]), tuple(fits))


def _fit(watching: Watching, seed: int, person: tuple[int, Character]) -> Fit:
    number, character = person
    root = seed * 1000 + number
    trials = [
        trial
        for robot in ROBOTS
        for trial in simulated_trials(
            RunSetup("sorting", character.name, robot, root), 1, str(number), fresh=True
        )
    ]
    explainer = Explainer(replace(watching, carried=0.0, remembered=0.0))
    return Exploration(lambda points: explainer.person(points, trials), seed).fit()
