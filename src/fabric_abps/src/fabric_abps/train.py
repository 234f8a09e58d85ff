# SPDX-License-Identifier: BSD-3-Clause
"""Line 1 of Algorithm 1: run every policy with every known type, and build both models.

The tasks of a pair are done by several people of that type one after another, each of them going on
for a session: ABPS meets people who have a history, and who has been helped well or badly ten times
behaves and earns otherwise than somebody new.
"""

import hashlib
import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, NamedTuple

from fabric_abps.library import Library
from fabric_abps.models import TrainedModels
from fabric_abps.observation_model import ObservationModel, check_codes
from fabric_abps.performance import PerformanceModel

SESSION = 30  # tasks of one person at most
LEAST_PEOPLE = 3  # a pair, if it has so many tasks


class Job(NamedTuple):
    """One person of a known type with one policy."""

    policy: str
    type: str
    seed: int
    tasks: int  # in a row


Task = tuple[float, Sequence[int]]  # utility in points, codes
RunJob = Callable[[Job], Sequence[Task]]
MapJobs = Callable[[Callable[[Any], Any], Sequence[Any]], Iterable[Any]]


def child_seed(seed: int, *names: Any) -> int:
    """A seed in [0, 2^63) derived from the root seed by name."""
    text = "/".join([str(seed), *map(str, names)])
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "little") >> 1


def sessions(tasks: int) -> list[int]:
    """How many tasks each person of a pair does; they differ by one at most, and sum to tasks."""
    people = min(tasks, max(LEAST_PEOPLE, math.ceil(tasks / SESSION)))
    return [tasks // people + (person < tasks % people) for person in range(people)]


def jobs_of(library: Library, types: Sequence[str], tasks: int, seed: int) -> list[Job]:
    """All jobs of a training, by type, then policy, then person.

    Raises ValueError when a pair has fewer than two tasks.
    """
    if tasks < 2:
        raise ValueError(f"tasks must be 2 at least, got {tasks}")
    return [
        Job(policy, tau, child_seed(seed, policy, tau, person), length)
        for tau in types
        for policy in library.names
        for person, length in enumerate(sessions(tasks))
    ]


def train(
    library: Library,
    types: Sequence[str],
    run_job: RunJob,
    tasks: int,
    seed: int,
    map_jobs: MapJobs = map,
    progress: Callable[[int, int], None] | None = None,
) -> TrainedModels:
    """Both models from `tasks` tasks of every pair.

    run_job(job) returns utility and codes of each task of a person; it is handed in, so this
    package knows no simulator. map_jobs may spread the work, keeping the order (map, Executor.map).
    progress(done, total) counts tasks. Raises ValueError naming policy, type and seed when a job
    returns something else, and when the map does not give one result for each job.
    """
    jobs = jobs_of(library, types, tasks, seed)
    library_hash = library.hash  # before the work: a file may be edited meanwhile
    results = _checked(map_jobs(run_job, jobs), jobs, progress)
    people = [person for person, length in enumerate(sessions(tasks)) for _ in range(length)]
    utilities: list[list[list[float]]] = []
    codes: list[list[list[Sequence[int]]]] = []
    for _ in types:
        rows = [_pair(results, tasks) for _ in library.names]
        utilities.append([[utility for utility, _ in row] for row in rows])
        codes.append([[sequence for _, sequence in row] for row in rows])
    next(results, None)  # lets the map end, and finds results that nobody asked for
    everybody = [[people] * len(library.names)] * len(types)
    return TrainedModels(
        scenario=library.scenario,
        types=tuple(types),
        policies=tuple(library.names),
        library_hash=library_hash,
        seed=seed,
        performance=PerformanceModel.fit(utilities).shrunk(),
        observation=ObservationModel.fit(codes, people=everybody),
    )


def _pair(results: Iterator[Sequence[Task]], tasks: int) -> list[Task]:
    done: list[Task] = []
    while len(done) < tasks:
        done += next(results)
    return done


def _checked(
    results: Iterable[Sequence[Task]],
    jobs: Sequence[Job],
    progress: Callable[[int, int], None] | None,
) -> Iterator[Sequence[Task]]:
    done, total = 0, sum(job.tasks for job in jobs)
    for job, session in itertools.zip_longest(jobs, results):
        if job is None or session is None:
            raise ValueError(f"the map does not give one result for each of {len(jobs)} jobs")
        _check(job, session)
        done += job.tasks
        if progress is not None:
            progress(done, total)
        yield session


def _check(job: Job, session: Sequence[Task]) -> None:
    place = f"policy {job.policy} with {job.type}, seed {job.seed}"
    if len(session) != job.tasks:
        raise ValueError(f"{place}: {len(session)} tasks instead of {job.tasks}")
    for number, (utility, codes) in enumerate(session, 1):
        if not math.isfinite(utility):
            raise ValueError(f"{place}: utility {utility} of task {number} is not finite")
        try:
            check_codes(codes)
        except ValueError as error:
            raise ValueError(f"{place}: task {number}: {error}") from error
