# SPDX-License-Identifier: BSD-3-Clause
"""Line 1 of Algorithm 1: run every policy with every known type, and build both models."""

import hashlib
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from typing import Any

from fabric_abps.library import Library
from fabric_abps.models import TrainedModels
from fabric_abps.observation_model import ObservationModel, count_codes
from fabric_abps.performance import PerformanceModel

RunTask = Callable[[str, str, int], tuple[float, Sequence[int]]]
Job = tuple[str, str, int]  # policy, type, seed
MapJobs = Callable[[Callable[[Job], Any], Iterable[Job]], Iterable[Any]]


def child_seed(seed: int, *names: Any) -> int:
    """A seed in [0, 2^63) derived from the root seed by name."""
    text = "/".join([str(seed), *map(str, names)])
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "little") >> 1


def train(
    library: Library,
    types: Sequence[str],
    run_task: RunTask,
    tasks: int,
    seed: int,
    map_jobs: MapJobs = map,
    progress: Callable[[int, int], None] | None = None,
) -> TrainedModels:
    """Both models from `tasks` tasks of every pair.

    run_task(policy, type, seed) returns the utility of a task [points] and its codes (n_codes,);
    it is handed in, so this package knows no simulator. map_jobs may spread the work, keeping the
    order (map, Executor.map). progress(done, total) is called after every task. Raises ValueError
    naming policy, type and seed when a task returns something else.
    """
    if tasks < 2:
        raise ValueError(f"tasks must be 2 at least, got {tasks}")
    jobs = [
        (policy, tau, child_seed(seed, policy, tau, task))
        for tau in types
        for policy in library.names
        for task in range(tasks)
    ]
    results = _checked(map_jobs(partial(_run, run_task), jobs), jobs, progress)
    utilities: list[list[list[float]]] = []
    codes: list[list[list[Sequence[int]]]] = []
    for _ in types:
        rows = [[next(results) for _ in range(tasks)] for _ in library.names]
        utilities.append([[utility for utility, _ in row] for row in rows])
        codes.append([[sequence for _, sequence in row] for row in rows])
    return TrainedModels(
        scenario=library.scenario,
        types=tuple(types),
        policies=tuple(library.names),
        library_hash=library.hash,
        seed=seed,
        performance=PerformanceModel.fit(utilities),
        observation=ObservationModel.fit(codes),
    )


def _run(run_task: RunTask, job: Job) -> tuple[float, Sequence[int]]:
    return run_task(*job)


def _checked(
    results: Iterable[Any], jobs: Sequence[Job], progress: Callable[[int, int], None] | None
) -> Iterator[tuple[float, Sequence[int]]]:
    for done, ((policy, tau, seed), (utility, codes)) in enumerate(
        zip(jobs, results, strict=True), 1
    ):
        place = f"policy {policy} with {tau}, seed {seed}"
        if not math.isfinite(utility):
            raise ValueError(f"{place}: utility {utility} is not finite")
        try:
            count_codes(codes)
        except ValueError as error:
            raise ValueError(f"{place}: {error}") from error
        if progress is not None:
            progress(done, len(jobs))
        yield float(utility), codes
