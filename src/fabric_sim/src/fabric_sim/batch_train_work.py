# SPDX-License-Identifier: BSD-3-Clause
"""Where a training goes on after it was killed: finished chunks of jobs are kept in a folder."""

from __future__ import annotations

import json
import multiprocessing
import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

from fabric_abps import Job
from fabric_abps.train import MapJobs, Task
from fabric_sim.batch_train_people import Recipe, run_jobs, trainer_of

CHUNK_TASKS = {"inspection": 120, "sorting": 30}  # of a chunk; a fraction of a second

_function: Callable[[Any], Any] | None = None  # of the processes that are forked next


def _call(item: Any) -> Any:
    return _function(item)


def spread(processes: int, at_once: int = 1) -> MapJobs:
    """A map over forked processes that keeps the order; functions need not be picklable.

    at_once: items that a process takes at a time.
    """

    def map_jobs(function: Callable[[Any], Any], items: Sequence[Any]) -> Iterator[Any]:
        global _function
        _function = function
        fork = multiprocessing.get_context("fork")
        with ProcessPoolExecutor(processes, mp_context=fork) as pool:
            try:
                yield from pool.map(_call, items, chunksize=at_once)
            finally:
                pool.shutdown(cancel_futures=True)

    return map_jobs


def chunks_of(jobs: Sequence[Job], scenario: str) -> list[list[Job]]:
    """Jobs in a row that are run at once; the same whoever runs them."""
    wanted, chunks = CHUNK_TASKS[scenario], []
    for job in jobs:
        if not chunks or sum(other.tasks for other in chunks[-1]) + job.tasks > wanted:
            chunks.append([])
        chunks[-1].append(job)
    return chunks


class Work:
    """Runs the jobs of one training; with a folder it keeps what is finished."""

    def __init__(self, recipe: Recipe, map_chunks: MapJobs, folder: Path | None = None) -> None:
        """folder: of this recipe, these types, tasks and seed alone; it is made when needed."""
        self._recipe, self._map, self._folder = recipe, map_chunks, folder

    def __call__(self, function: Any, jobs: Sequence[Job]) -> Iterator[list[Task]]:
        """The results of all jobs in order, as a map; what runs a job is in the recipe."""
        chunks = chunks_of(jobs, self._recipe.scenario)
        missing = [chunk for number, chunk in enumerate(chunks) if not self._has(number)]
        if missing:
            trainer_of(self._recipe)  # before processes are forked
        fresh = iter(self._map(partial(run_jobs, self._recipe), missing) if missing else ())
        for number, chunk in enumerate(chunks):
            if self._has(number):
                results = self._read(number, chunk)
            else:
                results = next(fresh)
                self._keep(number, results)
            yield from results
        next(fresh, None)  # lets the map end in its own way

    def forget(self) -> None:
        """Remove the folder, and the one it lies in when that is empty."""
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)
            with suppress(OSError):  # another training keeps its work there
                self._folder.parent.rmdir()

    def _path(self, number: int) -> Path:
        return self._folder / f"{number:05d}.json"

    def _has(self, number: int) -> bool:
        return self._folder is not None and self._path(number).is_file()

    def _read(self, number: int, chunk: Sequence[Job]) -> list[list[Task]]:
        path = self._path(number)
        try:
            results = json.loads(path.read_text(encoding="ascii"))
            if [len(session) for session in results] != [job.tasks for job in chunk]:
                raise ValueError("it holds other tasks")
            return [[(float(utility), codes) for utility, codes in tasks] for tasks in results]
        except (ValueError, TypeError) as error:
            raise ValueError(f"{path}: broken, remove it to run it again: {error}") from error

    def _keep(self, number: int, results: Sequence[Sequence[Task]]) -> None:
        if self._folder is None:
            return
        self._folder.mkdir(parents=True, exist_ok=True)
        path = self._path(number)
        partial_file = path.with_suffix(f".{os.getpid()}.part")
        with partial_file.open("w", encoding="ascii") as stream:
            json.dump(results, stream)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(partial_file, path)
