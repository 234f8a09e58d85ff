# SPDX-License-Identifier: BSD-3-Clause
"""Labelled movements of many different people, to train and judge gesture recognition with.

    config = CellConfig.load(cell_yaml, magician_yaml, arm_yaml, sensing_yaml)
    stream = labelled_stream(config, person=7, seed=101, seconds=300.0)

The person works beside a robot that only pretends: it comes near and goes away again, so that
people who do not want it warn it. No picture is made and no error added.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fabric_msgs.msg import Cube, HumanActivity, RobotActionState, SortingRule, TaskState
from fabric_sim.camera.hand import held_at
from fabric_sim.camera.intent import intent_of
from fabric_sim.camera.manner import manner_of
from fabric_sim.camera.motion import PersonMotion, PersonPose
from fabric_sim.cell import TICK, Cell, CellConfig
from fabric_sim.cell_output import seen
from fabric_sim.character import Character, named_generator
from fabric_sim.stock import Place
from fabric_sim.worker import Worker
from fabric_sim.worker_events import (
    PHASE_APPROACH,
    PHASE_CONTACT,
    PHASE_REST,
    ROBOT_CANCEL,
    ROBOT_GRASP,
    ROBOT_IDLE,
    ROBOT_PLANNING,
)

BELT_SPEED = 0.05  # m/s
COLOURS = {Cube.COLOUR_RED: "red", Cube.COLOUR_GREEN: "green", Cube.COLOUR_BLUE: "blue"}
CUBES = {"inspection": 1, "sorting": 10}
NOWHERE = (np.nan,) * 3
TASK_TIME = 150.0  # s after which a task is given up
PIECES = (  # of what the robot pretends: s at least, s at most, action, phase
    (3.0, 14.0, ROBOT_IDLE, PHASE_REST),
    (1.0, 3.0, ROBOT_PLANNING, PHASE_REST),
    (1.5, 4.0, ROBOT_GRASP, PHASE_APPROACH),
    (0.5, 2.5, ROBOT_GRASP, PHASE_CONTACT),
    (0.5, 1.0, ROBOT_CANCEL, PHASE_REST),
)


class LabelledStream(NamedTuple):
    """One person over N moments; places in frame cell, m.

    t: (N,) s. hand: (N, 3). label: (N,) HumanActivity.IDLE, GRASP, WARN or OTHER, what the person
    really does. present, holding: (N,) bool. cube: (N, 3), the cube in play, NaN without one.
    head: (N, 3). yaw: (N,) rad, positive to the left. around: (N,) bool, looks around.
    """

    t: np.ndarray
    hand: np.ndarray
    label: np.ndarray
    present: np.ndarray
    holding: np.ndarray
    cube: np.ndarray
    head: np.ndarray
    yaw: np.ndarray
    around: np.ndarray


class PretendingRobot:
    """Comes near and goes away again, at random."""

    def __init__(self, rng: np.random.Generator) -> None:
        """rng: decides how long each piece lasts."""
        self._rng = rng
        self._piece = -1
        self._until = 0.0

    def at(self, t: float, warned: bool) -> RobotActionState:
        """What it shows at time t (s), not decreasing; a warning makes it cancel soon."""
        if warned and PIECES[self._piece][2] == ROBOT_GRASP:
            self._begin(len(PIECES) - 1, t + self._rng.uniform(0.1, 1.0))
        elif t >= self._until:
            self._begin((self._piece + 1) % len(PIECES), t)
        _, _, action, phase = PIECES[self._piece]
        return RobotActionState(current=action, phase=phase)

    def _begin(self, piece: int, t: float) -> None:
        self._piece = piece
        self._until = t + self._rng.uniform(*PIECES[piece][:2])


class _Session:
    """A person, the pretending robot and tasks one after another."""

    def __init__(
        self, config: CellConfig, person: int, seed: int, scenario: str, human: str
    ) -> None:
        rng = named_generator(seed, "character", person)
        worker = Worker(Character.parse(human, rng), named_generator(seed, "worker", person))
        self._scenario = scenario
        self._rng = named_generator(seed, "tasks", person)
        self._robot = PretendingRobot(named_generator(seed, "robot", person))
        self.cell = Cell(config, worker, _seed_of(seed, person))
        motion = named_generator(seed, "motion", person)
        self.motion = PersonMotion(config.geometry, manner_of(seed, person), motion)
        self._number, self._ends = 0, 0.0
        self._next_task()

    def step(self) -> None:
        """One tick."""
        cell = self.cell
        waits = any(cube.place is not Place.CONTAINER for cube in cell.stock.cubes.values())
        if not waits or cell.now >= self._ends:
            self._next_task()
        warns = cell.behaviour.activity == HumanActivity.WARN
        cell.on_robot_state(self._robot.at(cell.now, warns))
        cell.advance()
        self.motion.tell(cell.now, intent_of(cell))

    def _next_task(self) -> None:
        self._number += 1
        colours = self._rng.choice(list(COLOURS), CUBES[self._scenario]).tolist()
        sorting = self._scenario == "sorting"
        rules = [
            SortingRule(colour=c, label=COLOURS[c] if sorting else "inspected") for c in COLOURS
        ]
        task = TaskState(task_id=self._number, scenario=self._scenario, rules=rules)
        task.cube_colours, task.status = colours, TaskState.RUNNING
        task.cube_rules, task.load = [list(COLOURS).index(c) for c in colours], 1.0
        self.cell.on_task(task)
        self.cell.set_conveyor(BELT_SPEED, False)
        self._ends = self.cell.now + TASK_TIME


def labelled_stream(
    config: CellConfig,
    person: int,
    seed: int,
    seconds: float,
    scenario: str = "sorting",
    human: str = "random",
    rate: float = 30.0,
) -> LabelledStream:
    """Return what one person does in so many seconds, sampled at `rate` Hz.

    person, seed: decide manner, character (if `human` is random) and everything that happens.
    Raises ValueError for a scenario or human type that does not exist, or a time or rate that is
    not positive.
    """
    if not (0.0 < seconds < np.inf and 0.0 < rate < np.inf):
        raise ValueError(f"{seconds} s at {rate} Hz cannot be recorded: want positive numbers")
    config.geometry.trays(scenario)
    session = _Session(config, person, seed, scenario, human)
    rows: list[tuple] = []
    samples = int(seconds * rate)
    while len(rows) < samples:
        session.step()
        now = session.cell.now
        while len(rows) < samples and (t := len(rows) / rate) < now + TICK:
            rows.append(_row(session, t, session.motion.pose(max(t, now))))
    return LabelledStream(*(np.array(column) for column in zip(*rows, strict=True)))


def _row(session: _Session, t: float, pose: PersonPose) -> tuple:
    cell, behaviour = session.cell, session.cell.behaviour
    holding = cell.stock.held_by_person is not None
    places = {cube.id: place for cube, _, place in seen(cell)}
    in_play = cell.stock.in_play
    place = places.get(in_play.id, NOWHERE) if in_play else NOWHERE
    return (
        t,
        pose.hand,
        behaviour.activity,
        behaviour.present,
        holding,
        np.array(held_at(pose.hand, cell.geometry) if holding else place),
        pose.head,
        pose.yaw,
        behaviour.looking_around,
    )


def _seed_of(seed: int, person: int) -> int:
    return int(named_generator(seed, "cell", person).integers(2**31))
