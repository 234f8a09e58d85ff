# SPDX-License-Identifier: BSD-3-Clause
"""Cores know no ROS, and packages lean on each other in one direction only."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
import tree

ROS = ("rospy", "roscpp", "rosbag", "actionlib", "tf", "tf2_ros", "roslaunch", "rosgraph")
BLOCK_AND_IMPORT = """
import importlib, sys
for name in sys.argv[1].split(","):
    sys.modules[name] = None
for name in sys.argv[2:]:
    importlib.import_module(name)
"""

CORES = {"fabric_abps", "fabric_perception", "fabric_planner", "fabric_sim", "fabric_study"}
CORES |= {"fabric_dobot_driver"}
ALLOWED = {  # package: the others of ours that its core may import, besides fabric_msgs
    "fabric_msgs": set(),
    "fabric_planner": set(),
    "fabric_dobot_driver": set(),
    "fabric_perception": set(),
    "fabric_study": set(),
    "fabric_abps": {"fabric_planner"},
    "fabric_sim": {"fabric_planner", "fabric_dobot_driver"},
    "fabric_bringup": CORES,
}
MAY_USE_EVERY_CORE = {  # the headless driver and what is run with it, files or folders
    "src/fabric_sim/src/fabric_sim/batch",
    "src/fabric_sim/src/fabric_sim/experiments/",
    "src/fabric_sim/src/fabric_sim/rehearsal/",
}
DECIDING = ("decision_node", "motion_node", "observation_node", "abps_node", "task_node")


def ours(names) -> set[str]:
    """Our packages among dotted names."""
    return {name.split(".")[0] for name in names if name.startswith("fabric_")}


def allowed_for(path: Path, package: str) -> set[str]:
    """Packages of ours that this file may import."""
    allowed = {package, "fabric_msgs"}
    if tree.is_node(path):
        return allowed | (CORES if package == "fabric_bringup" else set())
    if any(tree.shown(path).startswith(place) for place in MAY_USE_EVERY_CORE):
        return allowed | CORES
    return allowed | ALLOWED[package]


@pytest.mark.parametrize("package", [name for name in tree.PACKAGES if tree.core_modules(name)])
def test_core_imports_without_ros(package):
    command = [sys.executable, "-c", BLOCK_AND_IMPORT, ",".join(ROS), *tree.core_modules(package)]
    told = subprocess.run(command, capture_output=True, text=True, check=False)
    assert told.returncode == 0, told.stderr


@pytest.mark.parametrize("package", [name for name in tree.PACKAGES if name != "fabric_tests"])
def test_python_arrows_point_one_way(package):
    wrong = []
    for path in sorted(tree.PACKAGES[package].rglob("*.py")):
        if "test" in path.relative_to(tree.PACKAGES[package]).parts:
            continue
        for other in ours(tree.imports(path)) - allowed_for(path, package):
            wrong.append(f"{tree.shown(path)} imports {other}")
    assert not wrong


@pytest.mark.parametrize("package", list(tree.PACKAGES))
def test_cpp_arrows_point_one_way(package):
    wrong = []
    for path in tree.files(".hpp", ".cpp", ".h", tops=(tree.shown(tree.PACKAGES[package]),)):
        included = re.findall(r'#include [<"](\w+)/', path.read_text())
        for other in ours(included) - allowed_for(path, package):
            wrong.append(f"{tree.shown(path)} includes {other}")
    assert not wrong


def test_cpp_cores_include_no_ros():
    wrong = []
    for path in tree.files(".hpp", ".cpp", ".h", tops=("src",)):
        if tree.is_node(path) or "fabric_msgs" in path.parts or "test" in path.parts:
            continue
        if re.search(r'#include [<"](ros|actionlib|tf|tf2_ros|rosbag)/', path.read_text()):
            wrong.append(tree.shown(path))
    assert not wrong


def test_no_package_imports_a_node():
    wrong = [
        f"{tree.shown(path)} imports {name}"
        for path in tree.files(".py", tops=("src", "launch"))
        for name in tree.imports(path)
        if name.startswith("fabric_") and (name.endswith("_node") or ".nodes" in name)
    ]
    assert not wrong


def test_no_deciding_node_names_the_truth():
    """Whatever it is called after remapping: the word stands in no deciding node's source."""
    seen, wrong = set(), []
    for path in tree.files(".py", ".cpp", tops=("src",)):
        if path.stem in DECIDING:
            seen.add(path.stem)
            if re.search(r"""["']/?truth["']""", path.read_text()):
                wrong.append(tree.shown(path))
    assert not wrong
    assert seen == set(DECIDING)
