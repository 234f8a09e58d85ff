# SPDX-License-Identifier: BSD-3-Clause
"""Everything a picture shows at one moment, and how it comes from the cell's truth."""

from __future__ import annotations

from typing import NamedTuple

from fabric_msgs.msg import Cube
from fabric_sim.camera.hand import held_at
from fabric_sim.camera.intent import intent_of
from fabric_sim.camera.manner import manner_of
from fabric_sim.camera.motion import PersonMotion, PersonPose
from fabric_sim.cell import Cell
from fabric_sim.cell_output import seen
from fabric_sim.character import named_generator

Vector = tuple[float, float, float]


class SceneCube(NamedTuple):
    """A cube: Cube.COLOUR_*, its middle in the cell in m, its yaw in rad."""

    colour: int
    position: Vector
    yaw: float


class Scene(NamedTuple):
    """One moment. Places in frame cell, m and rad; defaults are an idle cell.

    scenario: whose trays stand there. hand: the glove's middle. stop: 0 to 1, how far the hand is
    raised against the robot. yaw, pitch: of the head, 0 faces the robot, positive is left and
    down. joints: j1 to j4 of the arm, rad, as the arm reports them.
    """

    scenario: str = "sorting"
    hand: Vector = (0.63, 0.235, 0.06)
    stop: float = 0.0
    shoulder: Vector = (0.80, 0.235, 0.36)
    head: Vector = (0.75, 0.035, 0.52)
    yaw: float = 0.0
    pitch: float = 0.2
    cubes: tuple[SceneCube, ...] = ()
    joints: tuple[float, float, float, float] = (0.0, 0.3, 0.4, 0.0)
    holding: bool = False  # the hand is closed around a cube
    t: float = 0.0  # s; from one scene to the next the cameras know how fast things move


class SceneSource:
    """Moves a person through a running cell and says what is to be seen."""

    def __init__(self, cell: Cell, seed: int) -> None:
        """seed: root seed of the run; decides the person's manner and small movements."""
        self._cell, self._seed = cell, seed
        self._person = 0
        self._worker: object = None
        self._motion = self._new_person()

    def step(self) -> None:
        """Take note of the cell's present tick: call it in every tick."""
        if self._cell.worker is not self._worker:
            self._motion = self._new_person()
        self._motion.tell(self._cell.now, intent_of(self._cell))

    def pose(self) -> PersonPose:
        """The person in the cell's present tick."""
        return self._motion.pose(self._cell.now)

    def scene(self) -> Scene:
        """What is to be seen in the cell's present tick."""
        return scene_of(self._cell, self.pose(), self._seed)

    def _new_person(self) -> PersonMotion:
        self._worker = self._cell.worker
        self._person += 1
        rng = named_generator(self._seed, "motion", self._person)
        manner = manner_of(self._seed, self._person)
        return PersonMotion(self._cell.geometry, manner, rng, self._cell.now)


def scene_of(cell: Cell, pose: PersonPose, seed: int) -> Scene:
    """Return the scene of the cell's present tick with the person in this pose."""
    held = cell.stock.held_by_person
    cubes = [
        SceneCube(cube.colour, place, _yaw_of(seed, cell.task.task_id, cube.id))
        for cube, where, place in seen(cell)
        if where != Cube.WHERE_PERSON
    ]
    if held is not None:
        place = held_at(pose.hand, cell.geometry)
        cubes.append(SceneCube(held.colour, place, _yaw_of(seed, cell.task.task_id, held.id)))
    return Scene(
        scenario=cell.task.scenario or "inspection",
        hand=tuple(pose.hand),
        stop=pose.stop,
        shoulder=tuple(pose.shoulder),
        head=tuple(pose.head),
        yaw=pose.yaw,
        pitch=pose.pitch,
        cubes=tuple(cubes),
        joints=tuple(cell.arm.joints),
        holding=held is not None,
        t=cell.now,
    )


def _yaw_of(seed: int, task: int, cube: int) -> float:
    """How a cube lies on the belt and in the trays: never quite straight."""
    return float(named_generator(seed, "cube yaw", task, cube).normal(0.0, 0.25))
