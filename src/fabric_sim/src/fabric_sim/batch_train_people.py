# SPDX-License-Identifier: BSD-3-Clause
"""Runs the people of a training: a job is a pure function of policy, type and seed.

A recipe holds the contents of the library's files, so a process on another machine needs nothing
but the sourced workspace, and files that change during a training change nothing.
"""

from __future__ import annotations

import hashlib
import tempfile
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

import fabric_planner as fp
from fabric_abps import Job, Library
from fabric_abps.train import Task
from fabric_sim.batch_decider import AgentDecider
from fabric_sim.batch_loop import Files, HeadlessRun, RunSetup
from fabric_sim.character import CORNERS, Character
from fabric_sim.staff import Staff
from fabric_sim.worker_model import ModelLibrary
from fabric_sim.worker_parameters import WorkerParameters

SOURCES = (  # of packages: what the result of a job may depend on
    "fabric_abps/src/fabric_abps/signals.py", "fabric_bringup/config/*.yaml",
    "fabric_dobot_driver/config/*.yaml", "fabric_msgs/msg/*.msg", "fabric_perception/src/*/*.py",
    "fabric_planner/config/*.yaml", "fabric_planner/include/**/*.hpp",
    "fabric_planner/src/**/*.cpp", "fabric_sim/config/**/*.yaml", "fabric_sim/models/*",
    "fabric_sim/src/fabric_sim/*.py", "fabric_study/config/**/*.yaml",
    "fabric_study/src/fabric_study/*.py",
)  # fmt: skip
INNER = 0.25  # how far from the corners the inner types lie


def known_types(number: int) -> list[str]:
    """The names of 4, 8, 16 or 32 known types, each set within the next.

    4: expertise and stamina both high or both low, attention and collaborativeness likewise. 8: the
    corners with an even number of high dials, so that any two dials take all four combinations. 16:
    all corners. 32: as many again, a quarter of the way to the opposite corner. Raises ValueError.
    """
    corners = list(CORNERS.items())
    if number == 4:
        return [name for name, (e, s, a, c) in _dials(corners) if e == s and a == c]
    if number == 8:
        return [name for name, dials in _dials(corners) if sum(dials) % 2 == 0]
    if number == 16:
        return [name for name, _ in corners]
    if number == 32:
        inner = [
            Character(*(INNER + (1.0 - 2.0 * INNER) * dial for dial in dials)).name
            for _, dials in _dials(corners)
        ]
        return known_types(16) + inner
    raise ValueError(f"there are 4, 8, 16 or 32 known types, not {number}")


def _dials(corners: Sequence[tuple[str, Character]]) -> list[tuple[str, tuple[float, ...]]]:
    return [(name, character.dials) for name, character in corners]


@dataclass(frozen=True)
class PolicyFiles:
    """What a policy's files hold."""

    name: str
    model: bytes
    observation_map: bytes | None
    solved: bytes

    @classmethod
    def read(cls, name: str, path: Path, solved: Path | None, scenario: str) -> PolicyFiles:
        """The contents of its files; a policy that was not solved beforehand is solved now."""
        if solved is not None:
            vectors = solved.read_bytes()
        else:
            with tempfile.TemporaryDirectory() as folder:
                file = Path(folder) / f"{name}.policy"
                fp.save_policy(Files().solve(str(path), scenario), fp.load(path), file)
                vectors = file.read_bytes()
        beside = path.with_suffix(".obs.yaml")
        return cls(
            name, path.read_bytes(), beside.read_bytes() if beside.is_file() else None, vectors
        )

    def agent(self, files: Files) -> fp.DecisionAgent:
        """What decides by this policy."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"{self.name}.pomdpx"
            path.write_bytes(self.model)
            if self.observation_map is not None:
                path.with_suffix(".obs.yaml").write_bytes(self.observation_map)
            path.with_suffix(".policy").write_bytes(self.solved)
            solved = fp.load_policy(path.with_suffix(".policy"), fp.load(path))
            return files.offline_agent(path, solved)


@dataclass(frozen=True)
class Recipe:
    """What all jobs of a training share."""

    scenario: str
    policies: tuple[PolicyFiles, ...]
    code: str  # fingerprint of the software

    @classmethod
    def of(cls, library: Library) -> Recipe:
        """Read what a library's policies are."""
        policies = tuple(
            PolicyFiles.read(policy.name, policy.path, policy.solved, library.scenario)
            for policy in library.policies
        )
        return cls(library.scenario, policies, code_fingerprint())

    @cached_property
    def key(self) -> str:
        """SHA-256 over everything that a job's result depends on but the job."""
        digest = hashlib.sha256(f"{self.scenario}\0{self.code}\0".encode())
        for policy in self.policies:
            for part in (policy.name.encode(), policy.model, policy.observation_map, policy.solved):
                content = part or b""
                digest.update(len(content).to_bytes(8, "little") + content)
        return digest.hexdigest()


@cache
def code_fingerprint() -> str:
    """SHA-256 over the sources and numbers of the packages that a run is made of."""
    digest = hashlib.sha256()
    for source in SOURCES:
        package, pattern = source.split("/", 1)
        share = Files().share(package)
        for path in sorted(path for path in share.glob(pattern) if path.is_file()):
            place = f"{package}/{path.relative_to(share)}\0"
            digest.update(place.encode() + path.read_bytes() + b"\0")
    return digest.hexdigest()


class Trainer:
    """Runs people new to the robot; what they share is prepared once."""

    def __init__(self, recipe: Recipe) -> None:
        """Raises RuntimeError when this machine runs another version of FABRIC."""
        if recipe.code != code_fingerprint():
            raise RuntimeError("this worker runs another version of FABRIC than who started it")
        self._scenario, self._files = recipe.scenario, Files()
        self._deciders = {
            policy.name: AgentDecider(policy.agent(self._files)) for policy in recipe.policies
        }
        self._parameters = WorkerParameters.load()
        self._library = ModelLibrary(self._parameters.model)

    def __call__(self, job: Job) -> list[Task]:
        """Tasks in a row of one person: discounted reward, type observation codes of each."""
        setup = RunSetup(self._scenario, job.type, job.policy, job.seed)
        staff = Staff(job.type, job.seed, self._parameters, self._library)
        run = HeadlessRun(setup, self._files, staff, self._deciders[job.policy])
        return [run.score_task() for _ in range(job.tasks)]


_trainers: dict[str, Trainer] = {}  # by key of the recipe
_one_at_a_time = threading.Lock()  # a worker of a cluster may have several threads


def trainer_of(recipe: Recipe) -> Trainer:
    """The trainer of this process for a recipe."""
    if recipe.key not in _trainers:
        _trainers[recipe.key] = Trainer(recipe)
    return _trainers[recipe.key]


def run_jobs(recipe: Recipe, jobs: Sequence[Job]) -> list[list[Task]]:
    """The tasks of several people."""
    with _one_at_a_time:
        trainer = trainer_of(recipe)
        return [trainer(Job(*job)) for job in jobs]
