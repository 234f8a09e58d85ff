# SPDX-License-Identifier: BSD-3-Clause
"""One candidate of a policy library: drawn, solved, and run with people."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path

import numpy as np

import fabric_planner as fp
from fabric_abps.candidates import BaseModel, CandidateError, solve
from fabric_abps.dials import Setting
from fabric_msgs.msg import Decision
from fabric_sim.batch_decider import AgentDecider
from fabric_sim.batch_loop import Files, HeadlessRun, RunSetup, TaskResult
from fabric_sim.character import Character, named_generator
from fabric_sim.staff import Staff
from fabric_sim.worker_model import ModelLibrary
from fabric_sim.worker_parameters import WorkerParameters

BASE = "proactive"
FIXED = (BASE, "reactive", "none")  # candidates that are written by hand
DRAWS = 50  # of a candidate until the model checker has nothing to say
SUFFIXES = {"model": ".pomdpx", "map": ".obs.yaml", "policy": ".policy"}


@dataclass(frozen=True)
class People:
    """Random points of the character cube; `again` is the same people on other seeds."""

    seed: int
    count: int
    again: bool = False

    @property
    def characters(self) -> list[Character]:
        """Who they are."""
        return [
            Character.random(named_generator(self.seed, "library person", number))
            for number in range(self.count)
        ]

    @property
    def dials(self) -> list[tuple[float, ...]]:
        """(count, 4), in [0, 1]."""
        return [character.dials for character in self.characters]

    def run_seed(self, number: int) -> int:
        """Root seed of the run with one of them, the same for every candidate."""
        rng = named_generator(self.seed, "library run", number, int(self.again))
        return int(rng.integers(2**31))


def draw(scenario: str, seed: int, name: str, parents: Sequence[dict] = ()) -> dict:
    """Name, setting (None when written by hand) and files of a candidate, as JSON takes them.

    parents: settings, as JSON takes them, that a child is drawn between. Raises CandidateError when
    the model checker has something to say about every draw.
    """
    source = Files().model(name if name in FIXED else BASE, scenario)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{name}.pomdpx"
        shutil.copyfile(source.with_suffix(".obs.yaml"), path.with_suffix(".obs.yaml"))
        drawn = _write_model(scenario, seed, source, path, parents)
        model = fp.load(path)
        fp.save_policy(solve(model), model, path.with_suffix(".policy"))
        files = {key: path.with_suffix(end).read_text("utf-8") for key, end in SUFFIXES.items()}
    return {"name": name, "setting": None if drawn is None else asdict(drawn), **files}


def _write_model(
    scenario: str, seed: int, source: Path, path: Path, parents: Sequence[dict]
) -> Setting | None:
    if path.stem in FIXED:
        shutil.copyfile(source, path)
        return None
    base, rng = BaseModel(source), named_generator(seed, scenario, path.stem)
    between = [Setting(**parent) for parent in parents]
    about = f"{BASE}, {scenario}, with other dials: {path.stem} of seed {seed}."
    for _ in range(DRAWS):
        setting = Setting.child(rng, between) if between else Setting.draw(rng)
        path.write_text(base.text(setting, about), encoding="utf-8")
        try:
            base.check(fp.load(path), path.stem)
        except CandidateError:
            continue
        return setting
    raise CandidateError(f"{scenario}, {path.stem}: nothing sound in {DRAWS} draws")


@contextmanager
def _files(found: dict) -> Iterator[Path]:
    """The files of a candidate in a folder of their own; the path of the model."""
    with tempfile.TemporaryDirectory() as folder:
        for key, end in SUFFIXES.items():
            (Path(folder) / f"{found['name']}{end}").write_text(found[key], encoding="utf-8")
        yield Path(folder) / f"{found['name']}.pomdpx"


@cache
def _workshop() -> tuple[Files, WorkerParameters, ModelLibrary]:
    parameters = WorkerParameters.load()
    return Files(), parameters, ModelLibrary(parameters.model)


def run(scenario: str, found: dict, people: People, tasks: int) -> dict:
    """Rewards (people, tasks) and the means of cards.NOTICES (people, 5) of a candidate.

    Everybody begins fresh and goes on for all tasks.
    """
    files, parameters, library = _workshop()
    rewards, notices = [], []
    with _files(found) as path:
        solved = fp.load_policy(path.with_suffix(".policy"), fp.load(path))
        decider = AgentDecider(files.offline_agent(path, solved))
        for number, character in enumerate(people.characters):
            seed = people.run_seed(number)
            staff = Staff(character.name, seed, parameters, library)
            setup = RunSetup(scenario, character.name, found["name"], seed)
            loop = HeadlessRun(setup, files, staff, decider)
            results = [loop.run_task() for _ in range(tasks)]
            rewards.append([result.row["discounted_reward"] for result in results])
            notices.append(np.mean([_noticed(result) for result in results], axis=0).tolist())
    return {"rewards": rewards, "notices": notices}


def _noticed(result: TaskResult) -> list[float]:
    actions = [decision.action for decision in result.decisions]
    row = result.row
    begun = [_begun(actions, action) for action in (Decision.GRASP, Decision.POINT)]
    return [row["success"], row["warnings"], *begun, row["duration_s"]]


def _begun(actions: list[int], action: int) -> int:
    """How often an action begins in a row of actions."""
    before = [None, *actions[:-1]]
    return sum(now == action != last for now, last in zip(actions, before, strict=True))
