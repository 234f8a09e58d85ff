# SPDX-License-Identifier: BSD-3-Clause
"""Builds the policy library of a scenario from one seed (thesis 5.2.2.1, 5.3.1.2).

    python3 -m fabric_sim.batch_library inspection FOLDER --seed 101

Candidates are drawn around the base model, checked, solved and run with random people; further
generations are drawn between the best of those before. The weak are dropped, the rest run again and
clustered by what they earn from whom; those are kept that differ.
The same seed gives the same files, whatever map spreads the work. What is finished is kept beside
the folder until the library is complete, so a build that was stopped goes on where it was.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import os
import shutil
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from fabric_abps.cards import Candidate, card, names_of, sentence
from fabric_abps.dials import Setting
from fabric_abps.diversity import choose, shortlist
from fabric_abps.library import INDEX, Library, write_index
from fabric_sim.batch_candidates import BASE, FIXED, People, draw, run
from fabric_sim.batch_files import Files
from fabric_sim.batch_train_folder import before, check_replaceable, replace_folder
from fabric_sim.character import named_generator

MapJobs = Callable[[Callable[[Any], Any], Iterable[Any]], Iterable[Any]]
Progress = Callable[[int, int], None]
HELP = {
    "candidates": "drawn around the base model",
    "generations": "of candidates, the first included",
    "children": "a generation: drawn between the best of those before",
    "people": "random points of the character cube",
    "first": "tasks of each person with each candidate; 0: 6, sorting 3",
    "second": "the same on the short list; 0: 30, sorting 6",
    "size": "policies of the library",
}
ALWAYS = (BASE, "reactive")  # the baselines, in every library
ABLE = 0.75  # share of the short list that a library is chosen from
TASKS = {"inspection": (6, 30), "sorting": (3, 6)}  # of a person with a candidate, first and second
LEAST = {
    "candidates": 1, "generations": 1, "children": 0, "people": 1, "first": 0, "second": 0,
    "size": len(ALWAYS),
}  # fmt: skip


@dataclass(frozen=True)
class Plan:
    """What decides the library of a scenario; equal plans give equal files."""

    scenario: str
    seed: int
    candidates: int = 80  # drawn around the base model, beside the written ones
    generations: int = 3  # of candidates, the first included
    children: int = 60  # a generation: drawn between those of the ones before on a short list
    people: int = 32  # random points of the character cube
    first: int = 0  # tasks of each person with each candidate; 0 as TASKS says
    second: int = 0  # tasks of each person with each candidate on the short list; 0 likewise
    size: int = 20  # of the library

    def __post_init__(self) -> None:
        if self.scenario not in TASKS:
            raise ValueError(f"scenario is {self.scenario!r}, none of {', '.join(TASKS)}")
        for name, least in LEAST.items():
            value = getattr(self, name)
            if not isinstance(value, int) or value < least:
                raise ValueError(f"{name} is {value!r}; it must be a whole number >= {least}")
        if self.size > self.all:
            raise ValueError(f"size is {self.size}, there are {self.all} candidates")
        for name, tasks in zip(("first", "second"), TASKS[self.scenario], strict=True):
            object.__setattr__(self, name, getattr(self, name) or tasks)

    @property
    def names(self) -> list[str]:
        """Names of the first candidates: the written ones, then the drawn ones by number."""
        return [*FIXED, *(f"candidate_{number:03d}" for number in range(self.candidates))]

    @property
    def all(self) -> int:
        """How many candidates there are, children and written ones included."""
        return len(self.names) + (self.generations - 1) * self.children

    @property
    def short(self) -> int:
        """Length of the short list."""
        return min(2 * self.size, self.all)

    @property
    def steps(self) -> int:
        """What `progress` of `build` counts to: looks at candidates, first and second."""
        return self.all + self.short


def build(
    plan: Plan, folder: Path, map_jobs: MapJobs = map, progress: Progress | None = None
) -> Library:
    """Build the library in a folder and return it.

    map_jobs may spread the work, keeping the order; each job is one candidate and brings all that
    it needs. progress(done, total) is called after each. A library that is in the folder is
    replaced at the very end only, and kept where `batch_train_folder.before` says. Raises
    ValueError, before any work when something else is in the folder.
    """
    check_replaceable(folder, plan.scenario)
    work = folder.with_name(f".{folder.name}.work")
    bench = _Bench(work / _fingerprint(plan), map_jobs, progress, plan.steps)
    people = np.array(People(plan.seed, plan.people).dials)
    look = partial(first_look, plan)
    first = bench.run("first", [{"name": name, "parents": []} for name in plan.names], look)
    for generation in range(1, plan.generations):
        first |= bench.run("first", _children(plan, first, people, generation), look)
    short = _pick(shortlist, first, people, plan.short)
    second = _able(bench.run("second", short, partial(second_look, plan)), plan.size)
    kept = _pick(choose, second, people, plan.size)
    fresh = work / "library"
    _write(plan.scenario, fresh, [_candidate(second[name], people) for name in kept])
    replace_folder(fresh, folder)
    shutil.rmtree(work)
    return Library.load(folder, plan.scenario)


def _children(
    plan: Plan, first: dict[str, dict], people: np.ndarray, generation: int
) -> list[dict]:
    """Name and parents of the next generation: any two drawn ones of the short list so far."""
    able = _pick(shortlist, first, people, min(plan.short, len(first)))
    drawn = [found["setting"] for found in able if found["setting"] is not None]
    children = []
    for number in range((generation - 1) * plan.children, generation * plan.children):
        rng = named_generator(plan.seed, plan.scenario, "parents", number)
        pair = rng.choice(len(drawn), size=min(2, len(drawn)), replace=False)
        children.append({"name": f"child_{number:03d}", "parents": [drawn[i] for i in pair]})
    return children


def _able(results: dict[str, dict], size: int) -> dict[str, dict]:
    """Without the quarter that earns least on average, as long as there are enough for a library.

    A policy may differ from all others by being bad with everybody.
    """
    order = sorted(results, key=lambda name: -float(np.mean(results[name]["rewards"])))
    best = {*order[: max(size, math.ceil(len(order) * ABLE))], *ALWAYS}
    return {name: result for name, result in results.items() if name in best}


def first_look(plan: Plan, wanted: dict) -> dict:
    """Draw a candidate (or read a written one), solve it and run it with everybody."""
    found = draw(plan.scenario, plan.seed, wanted["name"], wanted["parents"])
    return {**found, **run(plan.scenario, found, People(plan.seed, plan.people), plan.first)}


def second_look(plan: Plan, found: dict) -> dict:
    """Run a candidate of the short list again, on other seeds."""
    people = People(plan.seed, plan.people, again=True)
    return {**found, **run(plan.scenario, found, people, plan.second)}


class _Bench:
    """Runs jobs and keeps what is finished in files."""

    def __init__(
        self, folder: Path, map_jobs: MapJobs, progress: Progress | None, total: int
    ) -> None:
        self._folder, self._map, self._progress = folder, map_jobs, progress
        self._total, self._done = total, 0
        folder.mkdir(parents=True, exist_ok=True)

    def run(self, look: str, items: Sequence[dict], function: Callable[[Any], dict]) -> dict:
        """Results by name; items have a name at least. Those in files are not run again."""
        names = [item["name"] for item in items]
        paths = [self._folder / f"{look}-{name}.json" for name in names]
        left = [i for i, path in enumerate(paths) if not path.is_file()]
        self._tell(len(paths) - len(left))
        for i, result in zip(left, self._map(function, [items[i] for i in left]), strict=True):
            _write_text(paths[i], json.dumps(result))
            self._tell(1)
        found = (json.loads(path.read_text(encoding="utf-8")) for path in paths)
        return dict(zip(names, found, strict=True))

    def _tell(self, finished: int) -> None:
        self._done += finished
        if self._progress is not None and finished:
            self._progress(self._done, self._total)


def _fingerprint(plan: Plan) -> str:
    """What results of other plans or models must not be mixed with."""
    digest = hashlib.sha256(json.dumps(asdict(plan)).encode())
    for name in FIXED:
        path = Files().model(name, plan.scenario)
        digest.update(path.read_bytes() + path.with_suffix(".obs.yaml").read_bytes())
    return digest.hexdigest()[:16]


def _pick(rule: Callable, results: dict[str, dict], people: np.ndarray, count: int) -> list:
    """What a rule of `diversity` takes: results after `shortlist`, names after `choose`."""
    names = list(results)
    utility = np.array([np.mean(result["rewards"], axis=1) for result in results.values()])
    taken = rule(utility, people, count, [names.index(name) for name in ALWAYS])
    return [results[names[i]] if rule is shortlist else names[i] for i in taken]


def _candidate(result: dict, people: np.ndarray) -> Candidate:
    setting = None if result["setting"] is None else Setting(**result["setting"])
    reward = np.mean(result["rewards"], axis=1)
    files = (result["model"], result["map"], result["policy"])
    return Candidate(result["name"], setting, *files, reward, np.array(result["notices"]), people)


def _write_text(path: Path, text: str) -> None:
    """A reader sees the old file or the new one, never half of it."""
    part = path.with_name(path.name + ".part")
    part.write_text(text, encoding="utf-8")
    os.replace(part, path)


def _write(scenario: str, folder: Path, candidates: Sequence[Candidate]) -> None:
    """The files of the chosen and their index; what a killed build has left there goes."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    entries, names = [], names_of(candidates, FIXED)
    for name, candidate in zip(names, candidates, strict=True):
        files = {"model": f"{name}.pomdpx", "solved": f"{name}.policy", "card": f"{name}.md"}
        (folder / files["model"]).write_text(candidate.model, encoding="utf-8")
        (folder / f"{name}.obs.yaml").write_text(candidate.map, encoding="utf-8")
        (folder / files["solved"]).write_text(candidate.policy, encoding="utf-8")
        (folder / files["card"]).write_text(card(scenario, name, candidate), encoding="utf-8")
        entries.append({"name": name, "about": sentence(candidate), **files})
    earned = [float(np.mean(candidate.reward)) for candidate in candidates]
    write_index(folder / INDEX, scenario, names[int(np.argmax(earned))], entries)


def main(words: Sequence[str] | None = None) -> int:
    """Build a library at the command line; return the exit code."""
    from fabric_sim.batch_train import spread  # noqa: PLC0415

    parser = argparse.ArgumentParser(description="Build the policy library of a scenario.")
    parser.add_argument("scenario", choices=list(TASKS))
    parser.add_argument(
        "folder", type=Path, help="a library in it is replaced at the end, and kept"
    )
    parser.add_argument("--seed", type=int, default=101, help="root of all randomness (101)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes (one a core)")
    for name, what in HELP.items():
        default = getattr(Plan, name)
        parser.add_argument(f"--{name}", type=int, default=default, help=f"{what} ({default})")
    given = vars(parser.parse_args(words))
    folder, jobs = given.pop("folder").resolve(), given.pop("jobs")
    try:
        _build_at_shell(Plan(**given), folder, spread(jobs))
    except ValueError as error:
        print(f"batch_library: {error}", file=sys.stderr)
        return 2
    return 0


def _build_at_shell(plan: Plan, folder: Path, map_jobs: MapJobs) -> None:
    replaces = (folder / INDEX).exists()
    with tqdm(total=plan.steps, unit="candidate") as bar:
        library = build(plan, folder, map_jobs, lambda done, _: bar.update(done - bar.n))
    print(f"library  {folder}: {', '.join(library.names)}")
    if replaces:
        print(f"before   {before(folder)}: what was there")


if __name__ == "__main__":
    sys.exit(main())
