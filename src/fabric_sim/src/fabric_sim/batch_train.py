# SPDX-License-Identifier: BSD-3-Clause
"""`./fabric train`: runs every policy of the library with every known type, and keeps what it saw.

    python3 -m fabric_sim.batch_train scenario:=inspection tasks:=30 seed:=1 jobs:=0 out_dir:=DIR

Writes <out_dir>/<scenario>.npz; without out_dir into the package fabric_abps, where the selector
looks for it. The same words give the same file, whatever `jobs` is.
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
from fabric_sim.batch_loop import Files, HeadlessRun, RunSetup
from fabric_sim.character import CORNERS

CHUNK = 4  # jobs that a process takes at once


def run_task(
    scenario: str, paths: dict[str, str], policy: str, person: str, seed: int
) -> tuple[float, list[int]]:
    """One task of a person new to the robot: discounted reward and type observation codes."""
    result = HeadlessRun(RunSetup(scenario, person, paths[policy], seed)).run_task()
    return result.row["discounted_reward"], result.codes


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
    tasks = int(value["tasks"])
    with tqdm(total=len(CORNERS) * len(paths) * tasks, unit="task") as bar:
        models = train(
            library,
            list(CORNERS),
            partial(run_task, scenario, paths),
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
