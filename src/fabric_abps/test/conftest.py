# SPDX-License-Identifier: BSD-3-Clause
"""A tiny library and a synthetic world for the tests."""

from pathlib import Path

import numpy as np
import pytest

from fabric_abps import Job, Library, child_seed

TYPES = ("calm", "hasty", "touchy")
POLICIES = ("waits", "helps", "asks")
# codes 33 idle, 5 success, 9 failed attempt, 17 warning, 1 at work
CODES = np.array([33, 5, 9, 17, 1])
EMISSION = {"calm": [0.5, 0.3, 0.05, 0.0, 0.15], "hasty": [0.1, 0.3, 0.3, 0.05, 0.25],
            "touchy": [0.3, 0.2, 0.05, 0.3, 0.15]}  # fmt: skip
UTILITY = {"calm": [5.0, 3.0, 4.0], "hasty": [1.0, 5.0, 3.0], "touchy": [2.0, -3.0, 4.5]}


def write_library(folder: Path) -> Path:
    """An index of three policies with the base 'waits'; returns its path."""
    lines = ["tiny:", "  base: waits", "  policies:"]
    for name in POLICIES:
        (folder / f"{name}.pomdpx").write_text(f"<!-- {name} -->\n")
        lines.append(f"    - {{name: {name}, model: {name}.pomdpx, about: It {name}.}}")
    index = folder / "library.yaml"
    index.write_text("\n".join(lines) + "\n")
    return index


def run_task(policy: str, tau: str, seed: int):
    """A categorical person: utility around a table, codes by its emission; 12 codes a task."""
    rng = np.random.default_rng(seed)
    utility = UTILITY[tau][POLICIES.index(policy)] + rng.normal(0.0, 1.0)
    return utility, rng.choice(CODES, size=12, p=EMISSION[tau]).tolist()


def run_job(job: Job):
    """All tasks of one such person."""
    seeds = [child_seed(job.seed, task) for task in range(job.tasks)]
    return [run_task(job.policy, job.type, seed) for seed in seeds]


@pytest.fixture
def index(tmp_path: Path) -> Path:
    return write_library(tmp_path)


@pytest.fixture
def library(index: Path) -> Library:
    return Library.load(index, "tiny")
