# SPDX-License-Identifier: BSD-3-Clause
"""The cell as the lockstep runs it when cameras and slow sensors see it, not labels.

filmed = FilmedCell(cell, seed, SensorParameters.load(sensors_yaml))
Lockstep(filmed, graph, pace).run()
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

from fabric_msgs.msg import (
    Container,
    ConveyorState,
    GroundTruth,
    InfraredReadings,
    LoadCellReadings,
    SimScene,
)
from fabric_sim.camera import messages
from fabric_sim.camera.hand import held_at
from fabric_sim.camera.motion import PersonPose
from fabric_sim.camera.scene import SceneSource, scene_of
from fabric_sim.cell import TICK, Cell, CellOutput, Stimulus
from fabric_sim.character import named_generator
from fabric_sim.entries import Entries
from fabric_sim.infrared import InfraredBarrier, InfraredParameters
from fabric_sim.load_cells import LoadCellBank, LoadCellParameters

TOUCH = 0.025  # m above the floor of a tray, up to which fingers press on it
SCENE, LOAD_CELLS, INFRARED = "sim/scene", "sensors/load_cells", "sensors/infrared"
TOPICS = {
    "truth": GroundTruth,
    "conveyor/state": ConveyorState,
    LOAD_CELLS: LoadCellReadings,
    INFRARED: InfraredReadings,
    SCENE: SimScene,
}
SENT = ("truth", "arm/move/result", "conveyor/state")  # of what is sent with direct sensing


@dataclass(frozen=True)
class SensorParameters:
    """Numbers of the slow sensors."""

    load_cells: LoadCellParameters
    infrared: InfraredParameters

    @classmethod
    def load(cls, path: str | Path) -> SensorParameters:
        """Read sensors.yaml. Raises ConfigError naming the file, the entry and its value."""
        entries = Entries.read(path)
        return cls(
            LoadCellParameters.read(entries.branch("load_cells")),
            InfraredParameters.read(entries.branch("infrared")),
        )


@dataclass(frozen=True)
class FilmedOutput:
    """What a tick brought: messages in their order. t: s. pose: of the person."""

    t: float
    pose: PersonPose
    messages: tuple[Stimulus, ...]

    def stimuli(self) -> list[Stimulus]:
        """The messages, the scene last, together what is handed on together."""
        return list(self.messages)


class FilmedCell:
    """A cell that sends scenes and raw readings in place of what direct sensing would say."""

    def __init__(self, cell: Cell, seed: int, parameters: SensorParameters) -> None:
        """seed: root seed of the run; decides how the person moves and how sensors err."""
        self._cell, self._seed, self._p = cell, seed, parameters
        self._source = SceneSource(cell, seed)
        self._task = -1
        self._begin_task()

    @property
    def running(self) -> bool:
        """Whether a task lets time pass."""
        return self._cell.running

    def step(self) -> FilmedOutput:
        """Advance by one tick; report as the devices do."""
        output = self._cell.step()
        if self._cell.task.task_id != self._task:
            self._begin_task()
        self._source.step()
        pose = self._source.pose()
        readings = self._readings(output.t, pose)
        kept = self._kept(output)
        scene = scene_of(self._cell, pose, self._seed)
        shown = (SCENE, messages.scene_message(scene, self._task))
        return FilmedOutput(output.t, pose, (*kept, Stimulus(readings), Stimulus((shown,))))

    def _begin_task(self) -> None:
        """New trays, emptied; every task draws anew."""
        self._task = self._cell.task.task_id
        rngs = (
            named_generator(self._seed, name, self._task) for name in ("infrared", "load cells")
        )
        self._barrier = InfraredBarrier(self._p.infrared, next(rngs))
        mine = [t.id for t in self._cell.stock.trays if t.owner == Container.OWNER_PERSON]
        self._bank = LoadCellBank(self._p.load_cells, mine, next(rngs))
        self._weights: dict[int, float] = {}

    def _kept(self, output: CellOutput) -> list[Stimulus]:
        """What devices say anyway; the light barrier in the words of the belt's controller."""
        kept = []
        for stimulus in output.stimuli():
            pairs = tuple(
                (topic, self._as_sensed(message) if topic == "conveyor/state" else message)
                for topic, message in stimulus.messages
                if topic in SENT
            )
            kept += [Stimulus(pairs)] if pairs else []
        return kept

    def _as_sensed(self, state: ConveyorState) -> ConveyorState:
        return ConveyorState(state.header, state.speed, self._barrier.level)

    def _readings(self, t: float, pose: PersonPose) -> tuple:
        there = self._cell.stock.at_pick_point is not None
        levels = self._barrier.step(TICK, there)
        counts = self._bank.step(TICK, self._loads(), self._pressed(pose))
        p = self._p
        cells = messages.load_cell_readings(t, p.load_cells.rate, self._bank.trays, counts)
        barrier = messages.infrared_readings(t, p.infrared.rate, levels)
        return ((LOAD_CELLS, cells), (INFRARED, barrier))

    def _loads(self) -> dict[int, float]:
        """What lies in each tray, g."""
        loads: dict[int, float] = defaultdict(float)
        for cube in self._cell.stock.cubes.values():
            if cube.container is not None:
                loads[cube.container] += self._weight(cube.id)
        return loads

    def _weight(self, cube: int) -> float:
        if cube not in self._weights:
            self._weights[cube] = self._bank.weight()
        return self._weights[cube]

    def _pressed(self, pose: PersonPose) -> list[int]:
        """Trays that the person's fingers touch."""
        fingers = held_at(pose.hand, self._cell.geometry)
        return [
            tray.id
            for tray in self._cell.stock.trays
            if tray.holds(fingers) and fingers.z <= tray.floor.z + TOUCH
        ]
