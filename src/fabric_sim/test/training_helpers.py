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


def write_library(root: Path, scenario: str = "inspection", name: str = "") -> Library:
    """A library of two policies in root/scenario, or under another name."""
    files, folder = Files(), root / (name or scenario)
    folder.mkdir(parents=True)
    entries = []
    for policy in POLICIES:
        source = files.model(policy, scenario)
        shutil.copy(source, folder / f"{policy}.pomdpx")
        shutil.copy(source.with_suffix(".obs.yaml"), folder / f"{policy}.obs.yaml")
        solved = fp.solve(fp.load(source), work=1e6).lower
        fp.save_policy(solved, fp.load(source), folder / f"{policy}.policy")
        named = {"model": f"{policy}.pomdpx", "solved": f"{policy}.policy"}
        entries.append({"name": policy, "about": policy, **named})
    write_index(folder / "library.yaml", scenario, POLICIES[0], entries)
    return Library.load(folder, scenario)


def words(root: Path, **changes: object) -> list[str]:
    """The words of `./fabric train` for the library in root."""
    value = {
        "scenario": "inspection", "tasks": 6, "seed": 101, "jobs": 1, "policies": 2,
        "library": "keep", "scheduler": "", "out_dir": root,
    } | changes  # fmt: skip
    return [f"{name}:={text}" for name, text in value.items()]
