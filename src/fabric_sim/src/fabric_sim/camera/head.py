# SPDX-License-Identifier: BSD-3-Clause
"""Where a person's head is turned: over the work, in small glances, or around the room."""

from __future__ import annotations

import math

import numpy as np

from fabric_sim.camera.manner import Manner
from fabric_sim.camera.trajectory import Track, Wobble

FOLLOW = 0.25  # share of the way to the hand that the head turns; the eyes do the rest
SAME_SIDE = 0.7  # probability that the next look around goes to the same side
DWELL = (0.7, 1.9)  # s that a look around rests
GLANCE = 0.10  # rad
UNSTEADY = math.radians(0.5)


class HeadPlan:
    """Yaw and pitch of one person's head, rad; yaw 0 looks straight ahead, pitch down."""

    def __init__(self, manner: Manner, rng: np.random.Generator) -> None:
        """rng: decides where the head turns to."""
        self._manner = manner
        self._rng = rng
        self._turn = Track((0.0, manner.nod))
        self._follows = Track((1.0,))
        self._wobble = Wobble(rng, UNSTEADY, (0.2, 1.5), axes=2)
        self._around = False
        self._side = 1.0
        self._next = self._rng.exponential(manner.glance_every)

    def tell(self, t: float, around: bool, alarmed: bool) -> None:
        """Say at time t (s) whether the person looks around, or at the robot."""
        if around != self._around:
            self._around = around
            self._follows.go(t, (0.0 if around else 1.0,), 0.4)
            if around:
                self._side = self._rng.choice((-1.0, 1.0))
            self._next = t
        if t < self._next:
            return
        if around:
            self._look_around(t)
        else:
            self._look_at_work(t, alarmed)

    def at(self, t: float, to_hand: np.ndarray) -> tuple[float, float]:
        """Yaw and pitch at time t (s); to_hand: (3,) from the head to the hand, frame person."""
        yaw, pitch = self._turn.at(t).p + self._wobble.at(t)
        share = FOLLOW * float(self._follows.at(t).p[0])
        yaw += share * math.atan2(to_hand[1], 0.25 + abs(to_hand[0]))
        return float(yaw), float(pitch)

    def _look_around(self, t: float) -> None:
        if self._rng.random() >= SAME_SIDE:
            self._side = -self._side
        yaw = self._side * self._rng.uniform(*self._manner.turn)
        self._go(t, yaw, self._rng.uniform(-0.10, 0.12))
        self._next = self._turn.done_at + self._rng.uniform(*DWELL)

    def _look_at_work(self, t: float, alarmed: bool) -> None:
        nod = 0.05 if alarmed else self._manner.nod
        self._go(t, self._rng.normal(0.0, GLANCE), nod + self._rng.normal(0.0, 0.05))
        self._next = self._turn.done_at + self._rng.exponential(self._manner.glance_every)

    def _go(self, t: float, yaw: float, pitch: float) -> None:
        way = abs(yaw - float(self._turn.at(t).p[0]))
        self._turn.go(t, (yaw, pitch), (0.25 + 0.30 * way) / self._manner.turn_pace)
