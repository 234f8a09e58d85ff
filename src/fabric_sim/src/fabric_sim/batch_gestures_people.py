# SPDX-License-Identifier: BSD-3-Clause
"""Simulated people at work as a hand tracker would report them, with what they really did.

Each person works through tasks of both scenarios twice: beside a robot that meddles at random, so
that there is something to warn about, and beside the proactive one. Labels are the cell's truth at
each frame, as somebody who watches would set them: a wish becomes a gesture when the hand has begun
to move.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np

import fabric_planner as fp
from fabric_msgs.msg import Decision, HumanActivity, Observation
from fabric_perception.gestures.recording import UNLABELLED, Recording
from fabric_sim.batch_decider import AgentDecider, Decider
from fabric_sim.batch_files import Files
from fabric_sim.batch_gestures_other import PLACES, excursion
from fabric_sim.batch_loop import HeadlessRun, RunSetup
from fabric_sim.camera.intent import intent_of
from fabric_sim.camera.manner import Manner, manner_of
from fabric_sim.camera.motion import Intent, PersonMotion
from fabric_sim.cell import TICK, Cell, Moment
from fabric_sim.character import named_generator
from fabric_sim.geometry import CellGeometry, Point
from fabric_sim.truth import Truth

RATES = (30.0, 15.0, 10.0)  # frames a second of the cameras, one after another
POLICY = "eager"  # lends its names of states
MEDDLES = 0.5  # probability that the robot takes over when it decides
STICKS = 3.0  # s for which it does the same
SITUATIONS = {"beside a robot that meddles": "", "beside the proactive robot": "proactive"}
FILES = Files()
WORK = 60.0  # s of work in each scenario, at least
SCENARIOS = ("inspection", "sorting")
OUT_OF_VIEW = 0.35  # m that a person walks until the hand is no longer in the image
BREAK = 40.0  # s without work at the end
LEAST_PAUSE = 3.0  # s of idling that may be filled with something irrelevant
MARGIN = 0.4  # s of idling before and after that
FILLED = 0.6  # share of the pauses that are
VISIBLE = 0.015  # m that a hand must have moved until somebody sees that something began
SEEN_AFTER = 0.4  # s by which that may differ from the wish
LOST_CUBES = 0.25  # share of the cubes that the tracker loses in the hand
NOTICED_AFTER = 0.3  # s at most until it sees that a cube is in the hand


class TrackerNoise(NamedTuple):
    """How a tracker errs on one person: m, s, shares."""

    still: float  # standard deviation along each axis at rest
    moving: float  # more of it for each m/s
    dropped: float  # share of single frames without a hand
    hidden_every: float  # mean time between occlusions
    hidden_for: tuple[float, float]

    @classmethod
    def draw(cls, rng: np.random.Generator) -> TrackerNoise:
        """Return what the tracker makes of one person."""
        return cls(rng.uniform(1e-3, 3e-3), rng.uniform(2e-3, 8e-3), 0.05, 20.0, (0.15, 0.8))


class Meddler:
    """A robot that takes over by chance and lets go when it is warned (a Decider)."""

    model_hash = "meddler"

    def __init__(self, model: fp.Pomdp, rng: np.random.Generator) -> None:
        """model: whose names of states the record shows."""
        self.model = model
        self._rng = rng
        self.reset()

    def reset(self) -> None:
        """Begin idle."""
        self._action, self._until = Decision.IDLE, 0.0

    def set_model(self, path: str, keep_belief: bool) -> None:
        """Raises ValueError: it has no other model."""
        raise ValueError(f"the meddler cannot change to {path}")

    def decide(self, observation: Observation, truth: Truth) -> Decision:
        """Return what it does next, whatever is observed but a warning."""
        now = observation.header.stamp.to_sec()
        if observation.warning:
            self._action, self._until = Decision.CANCEL, now
        elif now >= self._until:
            self._action = Decision.GRASP if self._rng.random() < MEDDLES else Decision.IDLE
            self._until = now + STICKS
        size = len(self.model.states)
        return Decision(
            action=self._action, sequence=observation.sequence, task_id=observation.task_id,
            belief=[1.0 / size] * size,
        )  # fmt: skip


class _Frame(NamedTuple):
    """One image: the hand in the cell, the object of interest, whether the hand holds it, and
    HumanActivity's constant."""

    t: float
    hand: np.ndarray
    target: np.ndarray
    held: bool
    label: int


class WatchedRun(HeadlessRun):
    """A headless run whose person is also seen moving. frames: what was seen, in order."""

    def watch(self, motion: PersonMotion, rate: float) -> None:
        """Move this person from now on, seen in so many images a second."""
        self._body, self._rate = motion, rate
        self.frames: list[_Frame] = []
        self._count = 0

    def _next_moment(self) -> Moment:
        moment = super()._next_moment()
        self._look(self._cell)
        return moment

    def _look(self, cell: Cell) -> None:
        """Take the images between this tick and the next."""
        self._body.tell(cell.now, intent_of(cell))
        self._count = max(self._count, int(np.ceil(cell.now * self._rate - 1e-9)))
        while self._count / self._rate < cell.now + TICK - 1e-9:
            t = self._count / self._rate
            hand = self._body.pose(t).hand
            held = cell.stock.held_by_person is not None
            self.frames.append(_Frame(t, hand, _target(cell, hand), held, _label(cell, hand)))
            self._count += 1


def _target(cell: Cell, hand: np.ndarray) -> np.ndarray:
    """The cube in the hand, else the one at the pick point or next to it; NaN without one."""
    if cell.stock.held_by_person is not None:
        return hand - (0.0, 0.0, cell.geometry.edge)
    places = cell.stock.belt.places.values()
    if not places:
        return np.full(3, np.nan)
    nearest = min(places, key=abs)
    return np.array(cell.geometry.conveyor.to_cell(Point(nearest, 0.0, cell.geometry.edge / 2)))


def _label(cell: Cell, hand: np.ndarray) -> int:
    if not cell.behaviour.present or hand[0] > cell.geometry.person.x + OUT_OF_VIEW:
        return UNLABELLED
    return int(cell.behaviour.activity)


def simulate_person(
    seed: int, person: int, work: float = WORK, wishes: bool = False
) -> list[Recording]:
    """Return the recordings of the person of this number, one a situation; seed and number decide
    them.

    work: s in each of the two scenarios. wishes: labels begin with the wish to move instead of the
    movement.
    """
    manner = manner_of(seed, person)
    found = []
    for situation, policy in SITUATIONS.items():
        frames: list[_Frame] = []
        for scenario in SCENARIOS:
            frames += _later(frames, _worked(seed, person, manner, policy, scenario, work))
        if not policy:
            frames += _later(frames, _break(seed, person, manner))
        found.append(_tracked(seed, person, manner, situation, frames, wishes))
    return found


def _worked(
    seed: int, person: int, manner: Manner, policy: str, scenario: str, work: float
) -> list[_Frame]:
    """Tasks of one scenario for `work` s or more, at the side of one robot."""
    dials = named_generator(seed, "dials", person).uniform((0.0, 0.0, 0.2, 0.0), (1, 1, 1, 0.6))
    human = ",".join(f"{dial:.3f}" for dial in dials)
    names = (person, scenario, policy)
    run_seed = int(named_generator(seed, "gestures", *names).integers(2**31))
    robot = _robot(policy, scenario, named_generator(seed, "robot", *names))
    setup = RunSetup(scenario, human, policy or POLICY, run_seed, 0.0)
    run = WatchedRun(setup, FILES, decider=robot, every_tick=True)
    body = PersonMotion(_geometry(), manner, named_generator(seed, "motion", *names))
    run.watch(body, _rate(person))
    while not run.frames or run.frames[-1].t < work:
        run.run_task()
    return run.frames


def _rate(person: int) -> float:
    return RATES[person % len(RATES)]


@cache
def _geometry() -> CellGeometry:
    return FILES.cell().geometry


@cache
def _solved(policy: str, scenario: str) -> Any:
    return FILES.solve(policy, scenario)


def _robot(policy: str, scenario: str, rng: np.random.Generator) -> Decider:
    model = FILES.model(policy or POLICY, scenario)
    if not policy:
        return Meddler(fp.load(model), rng)
    return AgentDecider(FILES.offline_agent(model, _solved(policy, scenario)))


def _later(before: list[_Frame], frames: list[_Frame]) -> list[_Frame]:
    """The frames at times after the ones before."""
    shift = before[-1].t + 1.0 if before else 0.0
    return [frame._replace(t=frame.t + shift) for frame in frames]


def _break(seed: int, person: int, manner: Manner) -> list[_Frame]:
    """Resting with nothing to do."""
    body = PersonMotion(_geometry(), manner, named_generator(seed, "motion", person, "break"))
    frames, nothing, rate = [], np.full(3, np.nan), _rate(person)
    for k in range(round(BREAK * rate)):
        body.tell(k / rate, Intent())
        hand = body.pose(k / rate).hand
        frames.append(_Frame(k / rate, hand, nothing, False, HumanActivity.IDLE))
    return frames


def _tracked(
    seed: int, person: int, manner: Manner, situation: str, frames: list[_Frame], wishes: bool
) -> Recording:
    t = np.array([f.t for f in frames])
    hand = np.array([f.hand for f in frames])
    labels = np.array([f.label for f in frames])
    rng = named_generator(seed, "irrelevant", person, situation)
    _fill_pauses(t, hand, labels, _geometry(), manner, rng)
    rng = named_generator(seed, "tracker", person, situation)
    seen = _noisy(t, hand, TrackerNoise.draw(rng), rng)
    seen[labels == UNLABELLED] = np.nan
    target = _tracked_cube(t, frames, rng)
    if not wishes:
        labels = _as_seen(t, hand, labels)
    return Recording(f"P{person:02d}", t, seen, target, labels, situation)


def _as_seen(t: np.ndarray, hand: np.ndarray, labels: np.ndarray) -> np.ndarray:
    """The labels with each change where it can be seen: when the hand has begun to move, or, when
    it rests afterwards, when it came to rest."""
    seen = labels.copy()
    borders = np.flatnonzero(np.diff(labels)) + 1
    ends = [*borders[1:], len(t)]
    starts = [0, *borders[:-1]]
    for start, border, end in zip(starts, borders, ends, strict=True):
        if UNLABELLED in labels[border - 1 : border + 1]:
            continue
        away = np.linalg.norm(hand[start:end] - hand[border], axis=1) > VISIBLE
        begun = border + int(np.argmax(np.append(away[border - start :], True)))
        if begun < end and t[begun] - t[border] <= SEEN_AFTER:
            seen[border:begun] = labels[border - 1]
        else:
            moving = np.flatnonzero(
                away[: border - start] | (t[start:border] < t[border] - SEEN_AFTER)
            )
            rested = start + int(moving[-1]) + 1 if len(moving) else border
            seen[rested:border] = labels[border]
    return seen


def _tracked_cube(t: np.ndarray, frames: list[_Frame], rng: np.random.Generator) -> np.ndarray:
    """The object of interest (n, 3): in the hand it is noticed late and sometimes lost."""
    target = np.array([f.target for f in frames])
    held = np.array([f.held for f in frames])
    borders = np.flatnonzero(np.diff(held)) + 1
    for first, last in zip(borders, [*borders[1:], len(t)], strict=True):
        if held[first]:
            late = first + int(
                np.searchsorted(t[first:last] - t[first], rng.uniform(0.0, NOTICED_AFTER))
            )
            target[first:late] = target[first - 1]
            if rng.random() < LOST_CUBES:
                target[late:last] = np.nan
    return target + rng.normal(0.0, 2e-3, target.shape)


def _fill_pauses(
    t: np.ndarray, hand: np.ndarray, labels: np.ndarray, geometry: CellGeometry, manner: Manner,
    rng: np.random.Generator,
) -> None:  # fmt: skip
    """Let the hand do something irrelevant in some of the long pauses; changes hand and labels."""
    borders = np.flatnonzero(np.diff(labels)) + 1
    for first, last in zip([0, *borders], [*borders, len(t)], strict=True):
        at, end = t[first] + MARGIN, t[last - 1] - MARGIN
        while labels[first] == HumanActivity.IDLE and end - at > LEAST_PAUSE:
            at += rng.exponential(1.0)
            if rng.random() > FILLED or at > end:
                break
            begin = int(np.searchsorted(t, at))
            home = np.array(geometry.person.from_cell(Point(*hand[begin])))
            way = excursion(str(rng.choice(list(PLACES))), home, manner, rng, float(t[begin]))
            if way.done_at > end:
                break
            span = slice(begin, int(np.searchsorted(t, way.done_at)))
            moved = [geometry.person.to_cell(Point(*way.at(float(now)).p)) for now in t[span]]
            hand[span] += np.array(moved) - hand[begin]
            labels[span] = HumanActivity.OTHER
            at = way.done_at + 2.0 * MARGIN


def _noisy(
    t: np.ndarray, hand: np.ndarray, noise: TrackerNoise, rng: np.random.Generator
) -> np.ndarray:
    """The hand (n, 3) as tracked: noise that grows with speed, lost frames, occlusions as NaN."""
    speed = np.linalg.norm(np.gradient(hand, t, axis=0), axis=1)[:, None]
    seen = hand + rng.normal(0.0, 1.0, hand.shape) * (noise.still + noise.moving * speed)
    seen[rng.random(len(t)) < noise.dropped] = np.nan
    at = t[0] + rng.exponential(noise.hidden_every)
    while at < t[-1]:
        end = at + rng.uniform(*noise.hidden_for)
        seen[(t >= at) & (t < end)] = np.nan
        at = end + rng.exponential(noise.hidden_every)
    return seen
