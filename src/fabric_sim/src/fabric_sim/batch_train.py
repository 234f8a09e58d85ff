# SPDX-License-Identifier: BSD-3-Clause
"""`./fabric train`: runs every policy of the library with every known type, and keeps what it saw.

    python3 -m fabric_sim.batch_train scenario:=inspection tasks:=30 seed:=1 jobs:=0 out_dir:=DIR

Writes <out_dir>/<scenario>.npz; without out_dir into the package fabric_abps, where the selector
looks for it. The robot decides by policies that are solved beforehand. The same words give the same
file, whatever `jobs` is.
"""

from __future__ import annotations

import multiprocessing
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

from tqdm import tqdm

from fabric_abps import Library, train
from fabric_sim.batch_decider import AgentDecider
from fabric_sim.batch_loop import Files, HeadlessRun, RunSetup
from fabric_sim.character import CORNERS
from fabric_sim.staff import Staff
from fabric_sim.worker_model import ModelLibrary
from fabric_sim.worker_parameters import WorkerParameters

CHUNK = 16  # jobs that a process takes at once


class Trainer:
    """Runs single tasks of people new to the robot; what these share is prepared once.

    The robot decides by policies that were solved beforehand, so no task depends on another.
    """

    def __init__(self, scenario: str, paths: dict[str, str]) -> None:
        """paths: model files by the policy's name."""
        self._scenario, self._paths, self._files = scenario, paths, Files()
        self._solved = {name: self._files.solve(path, scenario) for name, path in paths.items()}
        self._deciders: dict[str, AgentDecider] = {}
        self._parameters = WorkerParameters.load()
        self._library = ModelLibrary(self._parameters.model)

    def __call__(self, policy: str, person: str, seed: int) -> tuple[float, list[int]]:
        """One task of a person new to the robot: discounted reward, type observation codes."""
        setup = RunSetup(self._scenario, person, self._paths[policy], seed)
        staff = Staff(person, seed, self._parameters, self._library)
        run = HeadlessRun(setup, self._files, staff, self._decider(policy))
        result = run.run_task()
        return result.row["discounted_reward"], result.codes

    def _decider(self, policy: str) -> AgentDecider:
        if policy not in self._deciders:
            path, solved = Path(self._paths[policy]), self._solved[policy]
            self._deciders[policy] = AgentDecider(self._files.offline_agent(path, solved))
        return self._deciders[policy]


_trainers: dict[str, Trainer] = {}  # by scenario, made before the processes are forked


def run_task(scenario: str, policy: str, person: str, seed: int) -> tuple[float, list[int]]:
    """A task of the trainer that this process was forked with."""
    return _trainers[scenario](policy, person, seed)


def spread(jobs: int) -> Callable[[Callable[[Any], Any], Iterable[Any]], Iterator[Any]]:
    """A map over processes that keeps the order."""

    def map_jobs(function: Callable[[Any], Any], items: Iterable[Any]) -> Iterator[Any]:
        fork = multiprocessing.get_context("fork")
        with ProcessPoolExecutor(jobs, mp_context=fork) as pool:
            yield from pool.map(function, items, chunksize=CHUNK)

    return map_jobs


def main(words: Sequence[str]) -> int:
    """Train on words that fabric_bringup.arguments has checked; return the exit code."""
    value = dict(word.split(":=", 1) for word in words)
    scenario, jobs = value["scenario"], int(value["jobs"]) or multiprocessing.cpu_count()
    package = Files().share("fabric_abps")
    library = Library.load(package / "config/library.yaml", scenario)
    paths = {policy.name: str(policy.path) for policy in library.policies}
    _trainers[scenario] = Trainer(scenario, paths)
    tasks = int(value["tasks"])
    with tqdm(total=len(CORNERS) * len(paths) * tasks, unit="task") as bar:
        models = train(
            library,
            list(CORNERS),
            partial(run_task, scenario),
            tasks,
            int(value["seed"]),
            spread(jobs),
            lambda done, total: bar.update(done - bar.n),
        )
    path = Path(value["out_dir"] or package / "models") / f"{scenario}.npz"
    path.parent.mkdir(parents=True, exist_ok=True)
    models.save(path)
    print(f"models   {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
