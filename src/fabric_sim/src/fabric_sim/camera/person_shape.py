# SPDX-License-Identifier: BSD-3-Clause
"""The person as shapes: trunk, head with helmet and markers, arm and yellow glove.

The glove's frame: origin in its middle, z along the fingers, x out of the palm.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fabric_sim.camera.looks import Appearance
from fabric_sim.camera.parameters import Plate
from fabric_sim.camera.place import quaternion_of
from fabric_sim.camera.shapes import body, box, capsule, cylinder, geom

UPPER_ARM, FOREARM = 0.29, 0.25  # m
WRIST = 0.085  # m from the glove's middle back to the wrist
RIM = 8.0 / 6.0  # a marker with its white rim, by its black square
PARTS = ("trunk", "head", "upper_arm", "forearm", "hand", "open_hand")
FINGERS = (-0.030, -0.010, 0.010, 0.030)  # m, across the palm


def person(look: Appearance, plates: Sequence[Plate]) -> list[str]:
    """Bodies named as in PARTS, each put anywhere."""
    shapes = {
        "trunk": _trunk(look),
        "head": _head(look, plates),
        "upper_arm": [capsule(0.047, (0, 0, -UPPER_ARM / 2), (0, 0, UPPER_ARM / 2), look.shirt)],
        "forearm": [
            capsule(0.038, (0, 0, -FOREARM / 2), (0, 0, FOREARM / 2 - 0.03), look.shirt),
            capsule(0.029, (0, 0, 0.0), (0, 0, FOREARM / 2), look.skin),
        ],
        "hand": _hand(look.glove, closed=True),
        "open_hand": _hand(look.glove, closed=False),
    }
    return [body(name, (0, 0, -5), shapes[name], mocap=True) for name in PARTS]


def _trunk(look: Appearance) -> list[str]:
    """In frame person: x ahead, z up. The left hand rests on the table's edge."""
    elbow, wrist = np.array([0.03, 0.24, 0.10]), np.array([0.17, 0.20, 0.045])
    return [
        geom("ellipsoid", (0.11, 0.19, 0.32), (-0.02, 0.0, 0.12), look.shirt),
        capsule(0.060, (0.0, -0.16, 0.34), (0.0, 0.16, 0.34), look.shirt),
        capsule(0.045, (0.0, 0.20, 0.34), elbow, look.shirt),
        capsule(0.038, elbow, 0.25 * elbow + 0.75 * wrist, look.shirt),
        capsule(0.028, elbow, wrist, look.skin),
        geom("ellipsoid", (0.048, 0.040, 0.018), wrist + (0.055, -0.01, -0.015), look.skin),
        *(
            capsule(0.009, wrist + (0.085, y, -0.018), wrist + (0.135, 1.2 * y, -0.028), look.skin)
            for y in FINGERS
        ),
    ]


def _head(look: Appearance, plates: Sequence[Plate]) -> list[str]:
    """In frame helmet: origin in the middle of the head, x ahead, y left."""
    parts = [
        capsule(0.050, (-0.015, 0.0, -0.22), (-0.01, 0.0, -0.08), look.skin),
        geom("ellipsoid", (0.096, 0.076, 0.112), (0.0, 0.0, -0.015), look.skin),
        geom("ellipsoid", (0.014, 0.011, 0.018), (0.096, 0.0, -0.03), look.skin),
        *(geom("sphere", (0.010,), (0.086, y, 0.005), (0.15, 0.12, 0.10)) for y in (-0.03, 0.03)),
        geom("ellipsoid", (0.010, 0.024, 0.006), (0.087, 0.0, -0.068), (0.62, 0.36, 0.33)),
        geom("ellipsoid", (0.118, 0.104, 0.100), (0.0, 0.0, 0.045), look.helmet),
        geom("ellipsoid", (0.042, 0.068, 0.006), (0.088, 0.0, 0.006), look.helmet),
    ]
    for plate in plates:
        parts += _plate(plate)
    return parts


def _plate(plate: Plate) -> list[str]:
    """A marker: its picture faces the plane's z, upright along the plane's y."""
    R = plate.pose[:3, :3]
    axes = np.column_stack([R[:, 1], R[:, 2], R[:, 0]])
    quat, at = quaternion_of(axes), plate.pose[:3, 3]
    half = RIM * plate.size / 2
    back = at - 0.0012 * R[:, 0]
    return [
        geom("plane", (half, half, 0.01), at, (1, 1, 1), material=f"marker{plate.id}", quat=quat),
        geom("box", (half, half, 0.001), back, (0.85, 0.85, 0.84), quat=quat),
        capsule(0.008, at - 0.012 * R[:, 0], at - 0.05 * R[:, 0], (0.3, 0.3, 0.3)),
    ]


def _hand(colour: Sequence[float], closed: bool) -> list[str]:
    parts = [
        geom("ellipsoid", (0.019, 0.043, 0.048), (0.0, 0.0, 0.0), colour),
        capsule(0.030, (0.0, 0.0, -0.035), (0.0, 0.0, -0.055), colour),
        cylinder(0.038, 0.014, (0.0, 0.0, -0.078), colour),
        box((0.012, 0.034, 0.030), (0.0, 0.0, 0.012), colour),
    ]
    for y in FINGERS:
        parts += _finger(0.7 * y if closed else y, closed, colour)
    if closed:
        parts.append(capsule(0.012, (0.008, 0.034, 0.0), (0.028, 0.022, 0.050), colour))
    else:
        parts.append(capsule(0.012, (0.004, 0.032, -0.012), (0.008, 0.078, 0.028), colour))
    return parts


def _finger(y: float, closed: bool, colour: Sequence[float]) -> list[str]:
    knuckle = (0.0, y, 0.040)
    if closed:
        middle, tip = (0.006, y, 0.066), (0.030, 0.75 * y, 0.082)
        return [capsule(0.0105, knuckle, middle, colour), capsule(0.0095, middle, tip, colour)]
    return [capsule(0.0102, knuckle, (0.0, 1.25 * y, 0.100 - 6.0 * y * y), colour)]
