# SPDX-License-Identifier: BSD-3-Clause
"""Irrelevant gestures of simulated people: what a classifier must not take for work or a warning.

Each is a short excursion of the hand from wherever it rests: to the helmet, along the table, aside.
Places are in the frame person, m.
"""

from __future__ import annotations

import numpy as np

from fabric_sim.camera.manner import Manner
from fabric_sim.camera.trajectory import Track

START_UP, A_METRE = 0.35, 0.95  # s; time of a leg at pace 1 is START_UP + A_METRE * way
RUBS = (2, 6)
SCATTER = 0.03  # m, of the places from person to person and from time to time
PLACES = {  # where the gesture is made, and how far the hand rubs or sways there
    "helmet": ((0.10, -0.10, 0.50), (0.03, 0.03, 0.02)),
    "other arm": ((0.18, 0.10, 0.20), (0.06, 0.02, 0.03)),
    "wiping": ((0.30, -0.05, 0.04), (0.05, 0.12, 0.0)),
    "aside": ((0.22, -0.42, 0.22), (0.04, 0.04, 0.04)),
    "hip": ((0.02, -0.28, 0.05), (0.01, 0.02, 0.02)),
    "talking": ((0.26, -0.10, 0.24), (0.08, 0.10, 0.06)),
}


def excursion(
    kind: str, home: np.ndarray, manner: Manner, rng: np.random.Generator, start: float
) -> Track:
    """Return the hand's way (frame person, m) from `home` (3,) at `start` (s) and back again."""
    place, size = PLACES[kind]
    middle = np.array(place) + rng.normal(0.0, SCATTER, 3)
    track = Track(home)
    track.go(start, middle, _time(home, middle, manner, rng), 0.0, 0.01)
    at, sign = middle, 1.0
    for _ in range(int(rng.integers(*RUBS))):
        sign = -sign
        goal = middle + sign * np.array(size) * rng.uniform(0.3, 1.0, 3)
        pause = rng.uniform(0.0, 0.25)
        track.then(pause, goal, rng.uniform(0.8, 1.2) * _time(at, goal, manner, rng))
        at = goal
    track.then(rng.uniform(0.0, 0.5), home, _time(at, home, manner, rng))
    return track


def _time(start: np.ndarray, end: np.ndarray, manner: Manner, rng: np.random.Generator) -> float:
    way = float(np.linalg.norm(end - start))
    return (START_UP + A_METRE * way) / manner.pace * rng.uniform(0.85, 1.15)
