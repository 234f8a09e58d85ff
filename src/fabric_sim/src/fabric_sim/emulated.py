# SPDX-License-Identifier: BSD-3-Clause
"""A cell whose arm and belt are those of the emulated Magician: cubes follow its cup and its belt.

The driver moves the emulator over its port, as it would a real arm. The cell looks at the emulator
from outside, at its control socket, as physics would: where the cup is, whether it sucks, how fast
the belt runs; and it tells what stands in front of the infrared sensor. The arm moves in real time,
so such a cell is to run in real time too.
"""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from fabric_dobot_driver import ToolPose, units
from fabric_dobot_driver.emulator import tell
from fabric_sim.arm import Arm
from fabric_sim.belt import MAX_SPEED
from fabric_sim.cell import Cell, CellConfig, Stimulus
from fabric_sim.lockstep import Stalled
from fabric_sim.quiescence import Edge
from fabric_sim.topics import DEVICES


class Devices(NamedTuple):
    """The emulated devices at a moment. pose: m and rad in arm_base_link; belt: m/s."""

    pose: ToolPose
    suction: bool
    belt: float
    homed: bool


class EmulatorEyes:
    """The emulated arm as seen from outside.

    tell: carries a line of words to the emulator and returns its answer, or raises OSError.
    """

    def __init__(self, link: Path, tell: Callable[[Path, str], str] = tell) -> None:
        self._link, self._tell = link, tell
        self._shown: bool | None = None

    def look(self) -> Devices:
        """What the devices do now. Raises OSError when no emulator is there."""
        state = json.loads(self._tell(self._link, "state"))
        belt = min(max(0.0, 1e-3 * state["belt_speed"][0]), MAX_SPEED)
        pose = units.pose_from_wire(*state["pose"])
        return Devices(pose, state["suction"], belt, state["homed"])

    def show(self, cube: bool) -> None:
        """Have the infrared sensor see a cube, or none. Raises OSError as look."""
        if cube != self._shown:
            self._tell(self._link, f"infrared {'on' if cube else 'off'}")
            self._shown = cube


class _Output:
    """What a tick brought, without what the driver says of its devices."""

    def __init__(self, output: Any) -> None:
        self._output = output
        self.t = output.t
        self.pose = getattr(output, "pose", None)

    def stimuli(self) -> list[Stimulus]:
        """As of the cell."""
        kept = []
        for stimulus in self._output.stimuli():
            pairs = tuple(pair for pair in stimulus.messages if pair[0] not in DEVICES)
            kept += [Stimulus(pairs)] if pairs else []
        return kept


class EmulatedCell:
    """See the module."""

    def __init__(self, runs: Any, cell: Cell, config: CellConfig, eyes: EmulatorEyes) -> None:
        """runs: the cell, or what films it. config: of the cell."""
        self._runs, self._cell, self._config, self._eyes = runs, cell, config, eyes

    @property
    def running(self) -> bool:
        """Whether a task lets time pass."""
        return self._runs.running

    def missing(self) -> list[str]:
        """What is not ready yet."""
        try:
            homed = self._eyes.look().homed
        except OSError as error:
            return [f"no emulated arm is there ({error})"]
        return [] if homed else ["the emulated arm has not been homed"]

    def step(self) -> _Output:
        """Advance by one tick with the arm and the belt as they are. Raises Stalled."""
        try:
            return self._step()
        except OSError as error:
            raise Stalled(f"the emulated arm is gone: {error}") from error

    def _step(self) -> _Output:
        cell, devices = self._cell, self._eyes.look()
        cell.arm = self._arm_at(devices.pose)
        if devices.suction != cell.arm.suction:
            cell.set_suction(devices.suction)
        if devices.belt != cell.stock.belt.speed:
            cell.set_conveyor(devices.belt, ignore_sensor=True)
        output = _Output(self._runs.step())
        self._eyes.show(cell.stock.belt.at_pick_point is not None)
        return output

    def _arm_at(self, pose: ToolPose) -> Arm:
        """An arm that stands there; it sucks as before."""
        arm = Arm(replace(self._config.arm, home=pose), self._config.limits)
        arm.suction = self._cell.arm.suction
        return arm


def without_devices(edges: tuple[Edge, ...]) -> tuple[Edge, ...]:
    """The counted topics that are left when arm and belt are not the cell's."""
    return tuple(edge for edge in edges if edge.topic not in DEVICES)
