# SPDX-License-Identifier: BSD-3-Clause
"""`./fabric train`: builds a library of policies and trains the choice among them, from one seed.

    python3 -m fabric_sim.batch_train scenario:=inspection tasks:=90 seed:=1 jobs:=0 \\
        policies:=20 library:=new scheduler:= out_dir:=

Writes the folder <out_dir>/<scenario>; without out_dir into the package fabric_abps, where the
selector looks for it; a library that was there is kept as .<scenario>.before. With library:=keep
the policies there stay, and only models.npz is written anew. The same words give the same files,
whatever does the work and however often it was stopped.
"""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from tqdm import tqdm

from fabric_abps import Library, ModelsError, TrainedModels, train
from fabric_abps.library import INDEX, MODELS
from fabric_abps.train import SESSION, MapJobs, jobs_of
from fabric_sim import batch_library
from fabric_sim.batch_loop import Files
from fabric_sim.batch_train_dask import cluster
from fabric_sim.batch_train_folder import before, check_replaceable, replace_folder
from fabric_sim.batch_train_people import (
    Recipe,
    code_fingerprint,
    known_types,
    run_jobs,
    trainer_of,
)
from fabric_sim.batch_train_work import Work, chunks_of, spread

__all__ = ["Measured", "known_types", "main", "measure", "spread", "train_models"]

Progress = Callable[[int, int], None]
TYPES = 32  # known types: the corners, and as many inside the cube
MEASURED_TYPES = 16  # of the training that `measure` times
TASKS = 90  # a policy and type
SEED = 1
SHARE = 24  # of so many chunks `measure` runs one


def train_models(
    library: Library,
    types: Sequence[str] | None = None,
    tasks: int = TASKS,
    seed: int = SEED,
    map_chunks: MapJobs = map,
    progress: Progress | None = None,
    work: Path | None = None,
    cache: Path | None = None,
) -> TrainedModels:
    """Train the choice among the policies of a library.

    types: names of characters, known_types(TYPES) if None. map_chunks spreads the work (`spread`,
    `cluster`). work: folder that keeps what is finished, for a training that may be killed. cache:
    file that the models are taken from if they were trained in this way, and are kept in.
    """
    types = known_types(TYPES) if types is None else list(types)
    found = _cached(cache, library, types, tasks, seed)
    if found is not None:
        return found
    recipe = Recipe.of(library)
    jobs = Work(recipe, map_chunks, work and work / _key(recipe, types, tasks, seed))
    models = train(library, types, _not_here, tasks, seed, jobs, progress)
    if cache is not None:
        cache.parent.mkdir(parents=True, exist_ok=True)
        models.save(cache)
    jobs.forget()
    return models


def _not_here(job: object) -> None:
    """Jobs are run by Work, many at once."""
    raise RuntimeError(f"{job} was not run by the work of its training")


def _key(recipe: Recipe, types: Sequence[str], tasks: int, seed: int) -> str:
    words = json.dumps([recipe.key, list(types), tasks, seed, SESSION])
    return hashlib.sha256(words.encode()).hexdigest()[:16]


def _cached(
    path: Path | None, library: Library, types: Sequence[str], tasks: int, seed: int
) -> TrainedModels | None:
    if path is None or not path.is_file():
        return None
    try:
        models = TrainedModels.load(path)
        models.check(library)
    except ModelsError:
        return None
    same = list(models.types) == list(types) and models.seed == seed
    return models if same and (models.performance.count == tasks).all() else None


@dataclass(frozen=True)
class Measured:
    """How long a training takes."""

    scenario: str
    tasks: int  # run, of `all_tasks` in a full training
    all_tasks: int
    seconds: float  # wall time of those that were run

    @property
    def rate(self) -> float:
        """Tasks/s."""
        return self.tasks / self.seconds

    @property
    def full(self) -> float:
        """Seconds of the full training: the cost is linear in the tasks."""
        return self.all_tasks / self.rate


def measure(library: Library, processes: int = 2, share: int = SHARE, seed: int = 101) -> Measured:
    """Run every share-th chunk of a full training (16 types, 90 tasks); 1 runs all of it."""
    jobs = jobs_of(library, known_types(MEASURED_TYPES), TASKS, seed)
    recipe = Recipe.of(library)
    trainer_of(recipe)
    chunks = chunks_of(jobs, library.scenario)[:: max(1, share)]
    begin = time.perf_counter()
    results = list(spread(processes)(partial(run_jobs, recipe), chunks))
    seconds = time.perf_counter() - begin
    done = sum(len(session) for chunk in results for session in chunk)
    return Measured(library.scenario, done, sum(job.tasks for job in jobs), seconds)


@dataclass(frozen=True)
class Order:
    """What the command line asks for."""

    scenario: str
    tasks: int
    seed: int
    jobs: int
    policies: int
    keep: bool  # the policies that are there
    scheduler: str
    root: Path  # of the libraries

    @classmethod
    def of(cls, words: Sequence[str]) -> Order:
        """From words that fabric_bringup.arguments has checked."""
        value = dict(word.split(":=", 1) for word in words)
        root = value["out_dir"] or Files().share("fabric_abps") / "library"
        return cls(
            scenario=value["scenario"],
            tasks=int(value["tasks"]),
            seed=int(value["seed"]),
            jobs=int(value["jobs"]) or multiprocessing.cpu_count(),
            policies=int(value["policies"]),
            keep=value["library"] == "keep",
            scheduler=value["scheduler"],
            root=Path(root),
        )

    @property
    def target(self) -> Path:
        """The folder of the library."""
        return self.root / self.scenario

    @property
    def fresh(self) -> Path:
        """Where a new library is put together; equal orders to equal software go on there."""
        words = json.dumps([self.scenario, self.seed, self.policies, code_fingerprint()])
        return self.root / f".{self.scenario}.{hashlib.sha256(words.encode()).hexdigest()[:12]}"


def _build(order: Order, map_jobs: MapJobs) -> Library:
    """The first stage, unless it was finished before."""
    if (order.fresh / INDEX).is_file():
        return Library.load(order.fresh, order.scenario)
    plan = batch_library.Plan(order.scenario, order.seed, size=order.policies)
    with tqdm(total=plan.steps, unit="candidate") as bar:
        return batch_library.build(plan, order.fresh, map_jobs, _showing(bar))


def _showing(bar: tqdm) -> Progress:
    return lambda done, total: bar.update(done - bar.n)


def run(order: Order) -> int:
    """Both stages; return the exit code. Raises ValueError and RuntimeError."""
    begin = time.perf_counter()
    if not order.keep:
        check_replaceable(order.target, order.scenario)
    kept = Library.load(order.target, order.scenario) if order.keep else None
    order.root.mkdir(parents=True, exist_ok=True)
    with cluster(order.scheduler) if order.scheduler else nullcontext(spread(order.jobs)) as crew:
        library = kept or _build(order, crew)
        models = _train(order, library, crew)
    models.save((order.target if order.keep else order.fresh) / MODELS)
    replaced = not order.keep and replace_folder(order.fresh, order.target)
    print(f"library  {order.target}: {len(library.names)} policies")
    if replaced:
        print(f"before   {before(order.target)}: what was there")
    print(f"took     {time.perf_counter() - begin:.1f} s")
    return 0


def _train(order: Order, library: Library, map_jobs: MapJobs) -> TrainedModels:
    """The second stage, which says how fast it was."""
    total = TYPES * len(library.names) * order.tasks
    begin = time.perf_counter()
    with tqdm(total=total, unit="task") as bar:
        models = train_models(
            library,
            tasks=order.tasks,
            seed=order.seed,
            map_chunks=map_jobs,
            progress=_showing(bar),
            work=order.root / f".{order.scenario}.work",
        )
    rate = total / (time.perf_counter() - begin)
    print(f"trained  {total} tasks, {rate:.0f} tasks/s")
    return models


def main(words: Sequence[str]) -> int:
    """Train on words that fabric_bringup.arguments has checked; return the exit code."""
    try:
        return run(Order.of(words))
    except (ValueError, RuntimeError, OSError) as error:
        print(f"fabric: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("fabric: stopped; the same words go on from here", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
