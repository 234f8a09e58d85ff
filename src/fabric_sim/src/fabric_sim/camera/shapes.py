# SPDX-License-Identifier: BSD-3-Clause
"""Pieces of MJCF: boxes, cylinders, capsules, bodies. Sizes are half sizes, m and rad."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

Numbers = ArrayLike


def numbers(values: Numbers) -> str:
    """Values for an attribute."""
    return " ".join(f"{float(value):.7g}" for value in np.asarray(values, dtype=float).ravel())


def geom(
    kind: str,
    size: Numbers,
    at: Numbers,
    colour: Numbers,
    material: str = "",
    euler: Numbers = (0.0, 0.0, 0.0),
    quat: Numbers | None = None,
    name: str = "",
) -> str:
    """A shape at (x, y, z), turned by angles about x, y, z or by a quaternion w x y z."""
    words = f'type="{kind}" size="{numbers(size)}" pos="{numbers(at)}" rgba="{numbers(colour)} 1"'
    if quat is not None:
        words += f' quat="{numbers(quat)}"'
    else:
        words += f' euler="{numbers(np.degrees(np.asarray(euler, dtype=float)))}"'
    words += f' material="{material}"' if material else ""
    words += f' name="{name}"' if name else ""
    return f'<geom {words} contype="0" conaffinity="0" mass="0.01"/>'


def box(half: Numbers, at: Numbers, colour: Numbers, material: str = "") -> str:
    """A box."""
    return geom("box", half, at, colour, material)


def cylinder(
    radius: float, half: float, at: Numbers, colour: Numbers, euler: Numbers = (0.0, 0.0, 0.0)
) -> str:
    """A cylinder along its z."""
    return geom("cylinder", (radius, half), at, colour, euler=euler)


def capsule(radius: float, start: Numbers, end: Numbers, colour: Numbers) -> str:
    """A capsule from one end to the other."""
    ends = numbers([*np.asarray(start, dtype=float), *np.asarray(end, dtype=float)])
    words = f'type="capsule" size="{radius:g}" fromto="{ends}" rgba="{numbers(colour)} 1"'
    return f'<geom {words} contype="0" conaffinity="0" mass="0.01"/>'


def body(
    name: str,
    at: Numbers,
    parts: Iterable[str],
    yaw: float = 0.0,
    joint: str = "",
    mocap: bool = False,
) -> str:
    """A body of parts; with an axis it turns about it, with mocap it is put anywhere."""
    turn = f' euler="0 0 {math.degrees(yaw):.6g}"' if yaw else ""
    free = ' mocap="true"' if mocap else ""
    hinge = f'<joint name="{name}" type="hinge" axis="{joint}"/>' if joint else ""
    inside = "".join(parts)
    return f'<body name="{name}" pos="{numbers(at)}"{turn}{free}>{hinge}{inside}</body>'
