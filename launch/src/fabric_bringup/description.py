# SPDX-License-Identifier: BSD-3-Clause
"""Writes the URDF of the cell: table, belt and the Magician, from cell.yaml and magician.yaml.

`python3 -m fabric_bringup.description CELL MAGICIAN > urdf/cell.urdf`; a test compares.

The parallelogram keeps j2 and j3 absolute (j2 from the vertical, j3 from the horizontal), so
each is undone by a mimicking joint before the next link.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

Numbers = Sequence[float]
COLOURS = {
    "wood": (0.97, 0.93, 0.86, 1.0),
    "steel": (0.35, 0.37, 0.40, 1.0),
    "shell": (0.93, 0.94, 0.95, 1.0),
    "joint": (0.10, 0.42, 0.72, 1.0),
    "rubber": (0.12, 0.12, 0.13, 1.0),
}
HEAD = """<?xml version="1.0"?>
<!-- SPDX-License-Identifier: BSD-3-Clause -->
<!-- Made from cell.yaml and magician.yaml by fabric_bringup.description. -->
<robot name="fabric_cell">"""


def numbers(values: Numbers) -> str:
    """Values for an attribute, six decimals at most."""
    return " ".join(f"{round(value, 6) + 0.0:g}" for value in values)


def link(name: str, *shapes: str) -> str:
    """A link with the given visuals."""
    return "\n".join([f'  <link name="{name}">', *shapes, "  </link>"])


def shape(geometry: str, at: Numbers, colour: str, turn: Numbers = (0.0, 0.0, 0.0)) -> str:
    """A visual; origin in m and rad of its link."""
    return (
        f'    <visual><origin xyz="{numbers(at)}" rpy="{numbers(turn)}"/>'
        f'<geometry>{geometry}</geometry><material name="{colour}"/></visual>'
    )


def box(size: Numbers) -> str:
    """A box of full extents."""
    return f'<box size="{numbers(size)}"/>'


def cylinder(radius: float, length: float) -> str:
    """A cylinder along z."""
    return f'<cylinder radius="{radius:g}" length="{length:g}"/>'


def fixed(parent: str, child: str, at: Numbers, yaw: float = 0.0) -> str:
    """A joint that does not move."""
    return (
        f'  <joint name="{parent}_to_{child}" type="fixed"><parent link="{parent}"/>'
        f'<child link="{child}"/><origin xyz="{numbers(at)}" rpy="{numbers((0, 0, yaw))}"/></joint>'
    )


def turning(
    name: str, ends: tuple[str, str], at: Numbers, axis: str, limits: Numbers, mimic: str = ""
) -> str:
    """A revolute joint; limits in degrees. `mimic` names the joint whose negative it follows."""
    low, high = (math.radians(limit) for limit in limits)
    copy = f'<mimic joint="{mimic}" multiplier="-1"/>' if mimic else ""
    return (
        f'  <joint name="{name}" type="revolute"><parent link="{ends[0]}"/>'
        f'<child link="{ends[1]}"/><origin xyz="{numbers(at)}"/><axis xyz="{axis}"/>'
        f'<limit lower="{low:.5f}" upper="{high:.5f}" effort="10" velocity="5.6"/>{copy}</joint>'
    )


def furniture(cell: dict[str, Any]) -> list[str]:
    """World, cell, table and the belt's body."""
    table, belt = cell["table"], cell["belt"]
    conveyor = cell["frames"]["conveyor"]
    length = belt["end"] - belt["feeder"]
    middle = (belt["end"] + belt["feeder"]) / 2
    height = conveyor["z"] - 0.006
    thick = table["size"][2]
    return [
        link("world"),
        fixed("world", "cell", (0, 0, 0)),
        link("cell", shape(box(table["size"]), (table["x"], table["y"], -thick / 2), "wood")),
        fixed("cell", "conveyor", [conveyor[key] for key in "xyz"], conveyor["yaw"]),
        link(
            "conveyor",
            shape(
                box((length, belt["width"] + 0.012, height)),
                (middle, 0, -0.006 - height / 2),
                "steel",
            ),
        ),
    ]


def arm(cell: dict[str, Any], magician: dict[str, Any]) -> list[str]:
    """The Magician from its base to the suction cup."""
    frame = cell["frames"]["arm_base_link"]
    links, joints = magician["links"], magician["joints"]
    rear, fore, tool = links["rear_arm"], links["forearm"], links["tool_x"]
    tip = (0, links["tool_y"], -links["tool_z"])
    side = (math.pi / 2, 0, 0)
    lower = frame["z"]
    return [
        fixed("cell", "arm_base_link", [frame[key] for key in "xyz"], frame["yaw"]),
        link(
            "arm_base_link",
            shape(box((0.16, 0.16, lower - 0.07)), (0, 0, -lower / 2 - 0.035), "shell"),
        ),
        turning("j1", ("arm_base_link", "arm_turret"), (0, 0, 0), "0 0 1", joints["j1"]),
        link(
            "arm_turret",
            shape(cylinder(0.060, 0.075), (0, 0, -0.035), "shell"),
            shape(cylinder(0.032, 0.090), (0, 0, 0), "joint", side),
        ),
        turning("j2", ("arm_turret", "arm_rear"), (0, 0, 0), "0 1 0", joints["j2"]),
        link("arm_rear", shape(box((0.036, 0.050, rear)), (0, 0, rear / 2), "shell")),
        turning("j2_undone", ("arm_rear", "arm_elbow"), (0, 0, rear), "0 1 0", (-180, 180), "j2"),
        link("arm_elbow", shape(cylinder(0.024, 0.064), (0, 0, 0), "joint", side)),
        turning("j3", ("arm_elbow", "arm_fore"), (0, 0, 0), "0 1 0", joints["j3"]),
        link("arm_fore", shape(box((fore, 0.036, 0.032)), (fore / 2, 0, 0), "shell")),
        turning("j3_undone", ("arm_fore", "arm_wrist"), (fore, 0, 0), "0 1 0", (-180, 180), "j3"),
        link(
            "arm_wrist",
            shape(cylinder(0.018, 0.050), (0, 0, 0), "joint", side),
            shape(box((tool, 0.030, 0.020)), (tool / 2, 0, 0.012), "shell"),
        ),
        turning("j4", ("arm_wrist", "arm_tool"), (tool, 0, 0), "0 0 1", joints["j4"]),
        link(
            "arm_tool",
            shape(cylinder(0.013, 0.040), (0, 0, 0.032), "joint"),
            shape(cylinder(0.008, 0.012), (0, 0, 0.006), "rubber"),
        ),
        fixed("arm_tool", "arm_tcp", tip),
        link("arm_tcp"),
    ]


def urdf(cell: dict[str, Any], magician: dict[str, Any]) -> str:
    """The URDF of the contents of cell.yaml and magician.yaml."""
    materials = [
        f'  <material name="{name}"><color rgba="{numbers(rgba)}"/></material>'
        for name, rgba in COLOURS.items()
    ]
    return "\n".join([HEAD, *materials, *furniture(cell), *arm(cell, magician), "</robot>", ""])


if __name__ == "__main__":
    sys.stdout.write(urdf(*(yaml.safe_load(Path(path).read_text()) for path in sys.argv[1:3])))
