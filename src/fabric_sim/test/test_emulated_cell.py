# SPDX-License-Identifier: BSD-3-Clause
"""The cubes of a cell follow an arm and a belt that are not its own."""

import json
from pathlib import Path

import pytest
from cell_helpers import CONFIG, R, ScriptedWorker, task

from fabric_msgs.msg import Container
from fabric_sim.cell import Cell
from fabric_sim.cell_parameters import CellParameters, ParameterError
from fabric_sim.emulated import EmulatedCell, EmulatorEyes, without_devices
from fabric_sim.lockstep import Stalled
from fabric_sim.quiescence import EDGES

PICK, ABOVE, TRAY = (281.0, 35.0, 12.0), (281.0, 35.0, 84.0), (160.0, -285.0, -39.0)


class Emulator:
    """What an emulator says at its control socket, as far as the cell asks."""

    def __init__(self) -> None:
        self.pose, self.suction, self.belt, self.homed = ABOVE, False, 0.0, True
        self.infrared = "off"
        self.said: list[str] = []
        self.gone = False

    def tell(self, link: Path, line: str) -> str:
        if self.gone:
            raise FileNotFoundError(str(link))
        self.said.append(line)
        if line.startswith("infrared"):
            self.infrared = line.split()[1]
            return "ok"
        return json.dumps(
            {
                "pose": [*self.pose, 0.0],
                "suction": self.suction,
                "belt_speed": [self.belt, 0.0],
                "homed": self.homed,
            }
        )


@pytest.fixture
def rig():
    """A running sorting task of one red cube, and the emulator that moves it."""
    cell, emulator = Cell(CONFIG, ScriptedWorker(), 101), Emulator()
    eyes = EmulatorEyes(Path("arm"), emulator.tell)
    cell.on_task(task(colours=(R,)))
    return cell, emulator, EmulatedCell(cell, cell, CONFIG, eyes)


def step_until(emulated, condition, limit=2000):
    for _ in range(limit):
        emulated.step()
        if condition():
            return
    raise AssertionError("not so in time")


def deliver(cell, emulator, emulated):
    """A cube stands at the pick point."""
    emulator.belt = 50.0
    step_until(emulated, lambda: emulator.infrared == "on")
    emulator.belt = 0.0
    emulated.step()


def test_the_belt_runs_as_the_emulated_one_and_the_sensor_sees_the_cube(rig):
    cell, emulator, emulated = rig
    deliver(cell, emulator, emulated)
    place = cell.stock.belt.places[1]
    assert 0.0 <= place < 0.01
    for _ in range(20):
        emulated.step()
    assert cell.stock.belt.places[1] == place
    assert emulator.said.count("infrared on") == 1


def test_a_belt_that_is_not_stopped_carries_the_cube_through_the_beam(rig):
    _, emulator, emulated = rig
    emulator.belt = 50.0
    step_until(emulated, lambda: emulator.infrared == "on")
    step_until(emulated, lambda: emulator.infrared == "off")


def test_the_emulated_cup_takes_the_cube_into_the_tray(rig):
    cell, emulator, emulated = rig
    deliver(cell, emulator, emulated)
    emulator.pose, emulator.suction = PICK, True
    emulated.step()
    assert cell.stock.held_by_robot is cell.stock.cubes[1]
    assert emulator.infrared == "off"
    emulator.pose = TRAY
    emulated.step()
    emulator.suction = False
    emulated.step()
    owner = {tray.id: tray.owner for tray in cell.stock.trays}
    assert owner[cell.stock.cubes[1].container] == Container.OWNER_ROBOT


def test_what_the_driver_says_is_not_said_twice(rig):
    _, _, emulated = rig
    topics = set()
    for _ in range(10):
        topics |= {t for s in emulated.step().stimuli() for t, _ in s.messages}
    assert "truth" in topics and "human/activity" in topics
    assert not {"conveyor/state", "arm/move/result", "arm/tcp"} & topics


def test_the_driver_s_topics_are_not_waited_for():
    left = {edge.topic for edge in without_devices(EDGES)}
    assert not {"conveyor/state", "arm/move/goal", "arm/move/cancel", "arm/move/result"} & left
    assert {"task/state", "decision", "robot/state"} <= left


def test_it_waits_for_an_emulator_that_is_homed(rig):
    _, emulator, emulated = rig
    assert emulated.missing() == []
    emulator.homed = False
    assert emulated.missing() == ["the emulated arm has not been homed"]
    emulator.gone = True
    assert emulated.missing() == ["no emulated arm is there (arm)"]


def test_an_emulator_that_goes_away_ends_the_run(rig):
    _, emulator, emulated = rig
    emulator.gone = True
    with pytest.raises(Stalled, match="the emulated arm is gone"):
        emulated.step()


def test_an_emulated_arm_needs_a_pace():
    names = ("cell_file", "limits_file", "arm_file", "sensing_file")
    values = dict.fromkeys(names, "file") | {"human": "random", "seed": 1, "sensing": "direct"}
    values |= {"expected": ["task"], "emulator": "/tmp/arm", "speed": 0}
    with pytest.raises(ParameterError, match="/cell/speed is 0, want more than 0 with an emulated"):
        CellParameters.load(values, "/cell")
