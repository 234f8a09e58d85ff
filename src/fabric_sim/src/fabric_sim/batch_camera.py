# SPDX-License-Identifier: BSD-3-Clause
"""The headless loop on pictures: the same cell, drawn and looked at, and the same robot.

    with CameraRun(RunSetup(scenario="sorting", seed=101)) as run:
        results = [run.run_task() for _ in range(5)]

As the ROS graph with sensing:=camera it goes through every tick. Every message has its turn in
the order of docs/time.md; of a picture the cubes come first, then hand, containers, warning,
person.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import fabric_planner as fp
from fabric_abps import Selector
from fabric_msgs.msg import ContainerArray, SimScene
from fabric_perception.joint import JointHysteresis
from fabric_perception.observation_agent import ObservationAgent
from fabric_sim.batch_camera_eyes import Eyes, observation_parameters
from fabric_sim.batch_decider import Decider
from fabric_sim.batch_files import Files
from fabric_sim.batch_loop import TICKS_LIMIT, HeadlessRun, People, RunSetup
from fabric_sim.camera.filmed import LOAD_CELLS, SCENE, FilmedCell, SensorParameters

Message = Any


class CameraRun(HeadlessRun):
    """A run in which cameras and scales see, not labels. Equal setups give equal results.

    `setup.noise` has nothing to act on here. Close it to give back the graphics memory, or use it
    as a context; it belongs to the thread that made it.
    """

    def __init__(
        self,
        setup: RunSetup,
        files: Files | None = None,
        staff: People | None = None,
        decider: Decider | None = None,
        selector: Selector | None = None,
    ) -> None:
        """As HeadlessRun. Raises ValueError for a `setup.noise`, for a file or a setting that is
        wrong, and CannotDraw where no picture can be made."""
        if setup.noise is not None:
            raise ValueError(f"noise is {setup.noise}; pictures have their own, it must be None")
        files = files or Files()
        super().__init__(setup, files, staff, decider, True, selector)
        sensors = SensorParameters.load(files.share("fabric_sim") / "config/sensors.yaml")
        self._filmed = FilmedCell(self._cell, setup.seed, sensors)
        parameters = observation_parameters(files)
        self._observer = ObservationAgent(parameters)
        self._joint = JointHysteresis(parameters.joint_percepts)
        self._eyes = Eyes(files, setup.seed)
        planner = files.share("fabric_planner") / "config"
        limits = files.share("fabric_dobot_driver") / "config/magician.yaml"
        self._safety = fp.SafetyMonitor(str(planner / "safety.yaml"), str(limits))
        self._arm_place = fp.ArmPlace.load(str(files.share("fabric_bringup") / "config/cell.yaml"))
        unknown = self._safety.assess(0.0).level
        self._motion.on_separation(unknown, self._safety.slow_factor)
        self._hear: dict[str, Callable[[float, Message], None]] = {
            "truth": self._on_ground_truth,
            "arm/move/result": self._on_arm_result,
            "conveyor/state": self._on_conveyor,
            LOAD_CELLS: self._on_load_cells,
            SCENE: self._on_scene,
        }

    def __enter__(self) -> CameraRun:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Give back the graphics memory; the run is over."""
        self._eyes.close()

    # -- in place of what HeadlessRun does with labels ---------------------------------------------

    def _run_to_the_end(self) -> None:
        cell, last = self._cell, self._cell.tick + TICKS_LIMIT
        while cell.running:
            self._go_through_tick()
            if cell.tick > last:
                raise RuntimeError(f"task {self._task_number} did not end in {TICKS_LIMIT} ticks")

    def _go_through_tick(self) -> None:
        cell = self._cell
        output = self._filmed.step()
        cup = cell.arm.pose[:3]
        self._eyes.session.on_cup(output.t, cup)
        self._safety.on_tool(output.t, *cup)
        self._motion.on_tool(*cup)
        for stimulus in output.stimuli():
            if not cell.running:
                return
            for topic, message in stimulus.messages:
                if topic in self._hear:
                    self._hear[topic](output.t, message)

    def _publish_state(self) -> None:
        super()._publish_state()
        self._tell_containers(self._cell.now, self._eyes.session.on_task(self._manager.state))

    # -- messages of the cell ----------------------------------------------------------------------

    def _on_ground_truth(self, _: float, message: Message) -> None:
        self._meter.on_truth(message)

    def _on_arm_result(self, _: float, result: Message) -> None:
        self._move(self._motion.on_arm_result(result.number, result.outcome, result.reason))
        self._settle()

    def _on_conveyor(self, t: float, conveyor: Message) -> None:
        self._eyes.session.on_conveyor(conveyor)
        self._move(self._motion.on_conveyor(conveyor.cube_at_pick_point))
        self._score(t, self._manager.on_conveyor(t, conveyor))
        self._settle()

    def _on_load_cells(self, t: float, readings: Message) -> None:
        self._tell_containers(t, self._eyes.session.on_load_cells(readings))

    def _on_scene(self, t: float, scene: SimScene) -> None:
        sights = self._eyes.see(scene)
        if sights is None:
            return
        self._move(self._motion.on_cubes(sights.cubes))
        self._safety.on_hand(sights.hand, self._arm_place)
        self._keep_distance(self._safety.newest)
        self._settle()
        self._tell_containers(t, sights.containers)
        if sights.warning and self._cell.running:
            self._move(self._motion.on_warning())
            self._score(t, self._manager.on_warning(t))
            self._settle()
        for pair in sights.pairs:
            if self._cell.running:
                reading = self._joint.feed(self._observer.read(pair.activity, pair.head))
                age = pair.activity.evidence_age
                self._decide(t, self._observer.on_reading(t, reading, age))
                self._settle()

    def _keep_distance(self, now: float) -> None:
        level = self._safety.assess(now).level
        self._move(self._motion.on_separation(level, self._safety.slow_factor))

    def _tell_containers(self, t: float, containers: ContainerArray | None) -> None:
        if containers is not None and self._cell.running:
            self._score(t, self._manager.on_containers(t, containers))
            self._settle()
