# SPDX-License-Identifier: BSD-3-Clause
"""A small library for the tests of training, solved beforehand."""

from __future__ import annotations

import shutil
from pathlib import Path

import fabric_planner as fp
from fabric_abps import Library
from fabric_abps.library import write_index
from fabric_sim.batch_loop import Files

POLICIES = ("reactive", "none")


def write_library(root: Path, scenario: str = "inspection") -> Library:
    """A library of two policies in root/scenario."""
    files, folder = Files(), root / scenario
    folder.mkdir(parents=True)
    entries = []
    for name in POLICIES:
        source = files.model(name, scenario)
        shutil.copy(source, folder / f"{name}.pomdpx")
        shutil.copy(source.with_suffix(".obs.yaml"), folder / f"{name}.obs.yaml")
        solved = fp.solve(fp.load(source), work=1e6).lower
        fp.save_policy(solved, fp.load(source), folder / f"{name}.policy")
        entries.append(
            {"name": name, "model": f"{name}.pomdpx", "solved": f"{name}.policy", "about": name}
        )
    write_index(folder / "library.yaml", scenario, POLICIES[0], entries)
    return Library.load(folder, scenario)


def words(root: Path, **changes: object) -> list[str]:
    """The words of `./fabric train` for the library in root."""
    value = {
        "scenario": "inspection", "tasks": 6, "seed": 101, "jobs": 1, "policies": 2,
        "library": "keep", "scheduler": "", "out_dir": root,
    } | changes  # fmt: skip
    return [f"{name}:={text}" for name, text in value.items()]
