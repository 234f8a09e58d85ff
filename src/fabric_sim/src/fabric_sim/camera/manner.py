# SPDX-License-Identifier: BSD-3-Clause
"""How one person moves: pace, tremor, habits of the hand and of the head."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fabric_sim.character import named_generator

WAVES = ("hold", "wave", "push")  # ways to say stop with a raised hand


@dataclass(frozen=True)
class Manner:
    """One person's manner of moving. Lengths m, angles rad, times s, frequencies Hz.

    Offsets are in the frame person. Directions of `wave_axis` too, of length 1.
    """

    pace: float  # of all movements, 1 is an average adult's
    onset: tuple[float, float]  # from the wish to the movement
    tremor: float  # standard deviation along each axis
    tremor_band: tuple[float, float]
    sway: float  # of the standing body
    arc: tuple[float, float]  # bend of a reach: upwards, sideways; at 0.3 m of way
    rest: tuple[float, float, float]  # habitual place of the resting hand, from the usual one
    stop: tuple[float, float, float]  # habitual place of the raised hand, from the usual one
    grip: tuple[float, float, float]  # of the hand over the cube, from its middle
    wave: str  # one of WAVES
    wave_size: float  # amplitude
    wave_rate: float
    wave_axis: tuple[float, float, float]
    overshoot: float  # probability that a reach needs a correction
    hesitation: float  # probability of a pause on the way
    fidget_every: float  # mean time between small moves of the resting hand
    fidget_size: float
    turn: tuple[float, float]  # how far the head turns when looking around
    turn_pace: float
    glance_every: float  # mean time between small moves of the head
    nod: float  # how far the head bends over the work

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Manner:
        """Return the manner of a person whom this generator stands for."""
        u = rng.uniform
        wave = WAVES[int(rng.choice(3, p=(0.3, 0.5, 0.2)))]
        yaw = u(-0.5, 0.5)
        along = (np.cos(yaw), np.sin(yaw), 0.0)  # ahead
        across = (-np.sin(yaw), np.cos(yaw), u(-0.2, 0.2))
        axis = np.array(along if wave == "push" else across)
        turn = u(0.90, 1.10)
        return cls(
            pace=u(0.75, 1.35),
            onset=(0.02, u(0.05, 0.18)),
            tremor=u(0.05e-3, 0.4e-3),
            tremor_band=(u(6.0, 8.0), u(9.0, 12.0)),
            sway=u(1e-3, 4e-3),
            arc=(u(0.02, 0.07), u(-0.03, 0.03)),
            rest=(u(-0.05, 0.05), u(-0.06, 0.06), u(0.0, 0.04)),
            stop=(u(-0.07, 0.06), u(-0.08, 0.10), u(-0.08, 0.06)),
            grip=(u(-0.006, 0.006), u(-0.006, 0.006), u(-0.004, 0.006)),
            wave=wave,
            wave_size={"hold": u(0.003, 0.012), "wave": u(0.04, 0.11), "push": u(0.03, 0.07)}[wave],
            wave_rate=u(1.1, 2.6),
            wave_axis=tuple(axis / np.linalg.norm(axis)),
            overshoot=u(0.1, 0.5),
            hesitation=u(0.0, 0.25),
            fidget_every=u(4.0, 15.0),
            fidget_size=u(0.02, 0.07),
            turn=(turn, turn + u(0.1, 0.45)),
            turn_pace=u(0.8, 1.3),
            glance_every=u(2.0, 6.0),
            nod=u(0.15, 0.45),
        )


def manner_of(seed: int, person: int) -> Manner:
    """Return the manner of the person of this number; seed and number decide it."""
    return Manner.draw(named_generator(seed, "manner", person))
