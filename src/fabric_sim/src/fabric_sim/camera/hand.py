# SPDX-License-Identifier: BSD-3-Clause
"""What a person's working hand does: legs of least jerk, pauses, corrections, fidgets, waving.

Everything in the frame person, before the body's own swaying and walking.
"""

from __future__ import annotations

import math

import numpy as np

from fabric_sim.camera.manner import Manner
from fabric_sim.camera.trajectory import Track, Wobble
from fabric_sim.geometry import CellGeometry, Point

START_UP, A_METRE = 0.30, 0.95  # s; time of a movement at pace 1 is START_UP + A_METRE * way
USUAL_WAY = 0.3  # m, over which an arc bends as the manner says
MARGIN = 0.85  # of the time left that a movement may take
QUICKEST = 0.28  # s
GRIP = Point(-0.068, 0.0, 0.040)  # m, from a cube's middle to that of the hand that holds it
LIFT = 0.07  # m
INSPECT = Point(0.30, -0.04, 0.27)  # where a cube is looked at
HANGING = Point(0.10, -0.24, -0.02)
WORTH_A_LOOK = 0.7  # s to spare from which on a cube is held up and looked at
SWELL = 0.25  # s until waving is full, or has died away


def held_at(hand: np.ndarray, geometry: CellGeometry) -> Point:
    """The middle of a cube in a hand at (3,) m in the cell, likewise in the cell."""
    own = geometry.person.from_cell(Point(*map(float, hand)))
    return geometry.person.to_cell(Point(*(a - b for a, b in zip(own, GRIP, strict=True))))


class HandPlan:
    """The plan of one hand; `begin_*` replaces what was planned, `go_on` adds small movements.

    home: (3,) where it rests, frame person, m.
    """

    def __init__(self, geometry: CellGeometry, manner: Manner, rng: np.random.Generator) -> None:
        """geometry: where things are. rng: decides pauses, corrections and fidgets."""
        self._geometry, self._manner, self._rng = geometry, manner, rng
        body = geometry.body
        self.home = np.array(body.rest) + manner.rest
        self._stop = np.array(body.stop) + manner.stop
        at_pick_point = geometry.conveyor.to_cell(Point(0.0, 0.0, 0.5 * geometry.edge))
        self._cube = self._hand_over(at_pick_point)
        self._track = Track(self.home)
        self._tremor = Wobble(rng, manner.tremor, manner.tremor_band)
        self._upright = Track((0.0,))
        self._waves = Track((0.0,))  # how much of it
        self._waves_since = 0.0
        self._second = rng.uniform(0.9, 1.1)  # no two waves are alike
        self._mood = "rest"
        self._next = math.inf  # s, when a small movement is due

    def at(self, t: float) -> np.ndarray:
        """The hand at time t (s), (3,)."""
        return self._track.at(t).p + self._tremor.at(t) + self._wave(t)

    def raised(self, t: float) -> float:
        """How far it is turned up against the robot at time t (s), 0 to 1."""
        return float(self._upright.at(t).p[0])

    # -- what it sets out for -------------------------------------------------------------------

    def begin_rest(self, t: float, deadline: float = math.inf) -> None:
        """Go home, and fidget there."""
        self._calm(t, "rest")
        time = self._within(t, deadline, self._time_to(t, self.home))
        self._track.go(t, self.home, time, self._arc(t, self.home), self._onset())
        self._next = self._track.done_at + self._rng.exponential(self._manner.fidget_every)

    def begin_hanging(self, t: float) -> None:
        """Let the arm hang: walking."""
        self._calm(t, "hanging")
        self._track.go(t, HANGING, self._time_to(t, np.array(HANGING)))

    def begin_reach(self, t: float, deadline: float) -> None:
        """Reach for the cube at the pick point, to be there before the deadline (s)."""
        self._calm(t, "reach")
        natural, onset = self._time_to(t, self._cube), self._onset()
        time = self._within(t + onset, deadline, natural)
        spare = deadline - t - onset - 1.5 * time
        arc = self._arc(t, self._cube)
        if spare > 0.5 and self._rng.random() < self._manner.hesitation:
            start = self._track.at(t).p
            halfway = start + self._rng.uniform(0.35, 0.7) * (self._cube - start)
            self._track.go(t, halfway, 0.65 * time, 0.6 * arc, onset)
            self._track.then(self._rng.uniform(0.1, min(0.5, spare)), self._cube, 0.6 * time)
        elif spare > 0.3 and self._rng.random() < self._manner.overshoot:
            miss = self._cube + self._rng.normal(0.0, 0.010, 3) * (1.0, 1.0, 0.5)
            self._track.go(t, miss, time, arc, onset)
            self._track.then(0.03, self._cube, 0.22)
        else:
            self._track.go(t, self._cube, time, arc, onset)
        self._next = self._track.done_at + 0.35

    def begin_carry(self, t: float, goal: Point | None, deadline: float, lifted: bool) -> None:
        """Bring a cube to the tray whose floor's middle is `goal` (m, cell), there by the deadline.

        With neither known it is held up and looked at. lifted: off the belt already.
        """
        self._calm(t, "carry")
        if goal is None or deadline == math.inf:
            self._track.go(t, INSPECT, self._time_to(t, np.array(INSPECT)))
            return
        end = self._hand_over(Point(*goal[:2], goal.z + 0.6 * self._geometry.edge))
        stops = [] if lifted else [self._track.at(t).p + (0.0, 0.0, LIFT)]
        way = self._time_between(stops[0] if stops else self._track.at(t).p, end)
        spare = (MARGIN * (deadline - t)) - way - 0.75
        inspects = not lifted and spare > WORTH_A_LOOK
        if inspects:
            stops.append(np.array(INSPECT) + self._rng.normal(0.0, 0.02, 3))
        self._chain(t, [*stops, end + (0.0, 0.0, LIFT), end], 0.94 * (deadline - t), inspects)

    def begin_stop(self, t: float) -> None:
        """Raise the hand against the robot, and wave as this person does."""
        self._mood = "stop"
        time = 0.85 * self._time_to(t, self._stop)
        self._track.go(t, self._stop, time, 0.0, self._onset())
        self._upright.go(t, (1.0,), 0.8 * time)
        self._waves.go(t, (1.0,), time + SWELL)
        self._waves_since = t + 0.6 * time

    def go_on(self, t: float) -> None:
        """Make the small movements that are due at time t (s)."""
        if t < self._next or t < self._track.done_at:
            return
        if self._mood == "rest":
            self._fidget(t)
        elif self._mood == "reach":
            self._fumble(t)

    # -- small movements ------------------------------------------------------------------------

    def _fidget(self, t: float) -> None:
        """Move a little and come back."""
        size = self._manner.fidget_size
        beside = self.home + self._rng.normal(0.0, size, 3) * (0.7, 1.0, 0.4)
        beside[2] = max(beside[2], self.home[2] - 0.01)
        self._track.go(t, beside, self._time_between(self.home, beside))
        pause = self._rng.uniform(0.1, 1.5)
        self._track.then(pause, self.home, self._time_between(beside, self.home))
        self._next = self._track.done_at + self._rng.exponential(self._manner.fidget_every)

    def _fumble(self, t: float) -> None:
        """Pull at a cube that does not come, push it, take it anew."""
        pull = self._rng.normal(0.0, 0.012, 3)
        pull[2] = abs(pull[2]) + 0.004
        self._track.go(t, self._cube + pull, self._rng.uniform(0.22, 0.45))
        self._track.then(self._rng.uniform(0.0, 0.3), self._cube, self._rng.uniform(0.2, 0.4))
        self._next = self._track.done_at + self._rng.uniform(0.05, 0.5)

    def _wave(self, t: float) -> np.ndarray:
        manner, much = self._manner, float(self._waves.at(t).p[0])
        if much == 0.0:
            return np.zeros(3)
        phase = 2.0 * math.pi * manner.wave_rate * (t - self._waves_since)
        swing = math.sin(phase) + 0.25 * math.sin(0.47 * self._second * phase)
        return much * manner.wave_size * swing * np.array(manner.wave_axis)

    def _calm(self, t: float, mood: str) -> None:
        self._mood, self._next = mood, math.inf
        if self._upright.end[0] != 0.0:
            self._upright.go(t, (0.0,), 0.35)
            self._waves.go(t, (0.0,), SWELL)

    def _hand_over(self, cube: Point) -> np.ndarray:
        """The hand that holds a cube at this place (m, cell), (3,) in frame person."""
        return np.array(self._geometry.person.from_cell(cube)) + GRIP + self._manner.grip

    # -- times and ways -------------------------------------------------------------------------

    def _chain(self, t: float, stops: list[np.ndarray], time: float, inspects: bool) -> None:
        """Visit the stops within `time` s; what is to spare goes into looking or into slowness."""
        here = self._track.at(t).p
        pairs = zip([here, *stops[:-1]], stops, strict=True)
        times = [max(QUICKEST, self._time_between(a, b)) for a, b in pairs]
        slower = time / sum(times)
        slower = min(slower, self._rng.uniform(1.0, 1.25)) if inspects else min(slower, 1.6)
        look = max(0.0, time - slower * sum(times))
        for i, (stop, needed) in enumerate(zip(stops, times, strict=True)):
            pause = look if i == len(stops) - 2 else 0.0  # before the way to the tray
            if i == 0:
                self._track.go(t, stop, slower * needed, 0.0, pause)
            else:
                self._track.then(pause, stop, slower * needed, self._bend(stops[i - 1], stop))

    def _time_to(self, t: float, end: np.ndarray) -> float:
        return self._time_between(self._track.at(t).p, end)

    def _time_between(self, start: np.ndarray, end: np.ndarray) -> float:
        way = float(np.linalg.norm(end - start))
        return (START_UP + A_METRE * way) / self._manner.pace * self._rng.uniform(0.92, 1.1)

    @staticmethod
    def _within(t: float, deadline: float, time: float) -> float:
        return max(QUICKEST, min(time, MARGIN * (deadline - t)))

    def _arc(self, t: float, end: np.ndarray) -> np.ndarray:
        return self._bend(self._track.at(t).p, end)

    def _bend(self, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """How far a way bends: upwards and sideways, more on a longer way."""
        up, aside = self._manner.arc
        scale = min(1.5, float(np.linalg.norm(end - start)) / USUAL_WAY)
        return scale * self._rng.uniform(0.6, 1.3) * np.array([0.0, aside, up])

    def _onset(self) -> float:
        return float(self._rng.uniform(*self._manner.onset))
