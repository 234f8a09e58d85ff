# SPDX-License-Identifier: BSD-3-Clause
"""The tracker among the other devices: pictures, cup, belt and load cells in; messages out.

session = TrackingSession(workspace, palette, parameters, Scales(scale_parameters(values)))
session.use_camera(camera)
session.on_task(task_state)
answer = session.on_pictures(header, bgr, depth)  # the percepts of one pair of pictures
"""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from std_msgs.msg import Header

from fabric_msgs.msg import (
    Container,
    ContainerArray,
    ConveyorState,
    Cube,
    CubeArray,
    HandState,
    LoadCellReadings,
    TaskState,
)
from fabric_perception.camera import Camera
from fabric_perception.tracking.carriers import Signals
from fabric_perception.tracking.colours import Palette
from fabric_perception.tracking.containers import Containers
from fabric_perception.tracking.hand import HandTrack
from fabric_perception.tracking.parameters import TrackingParameters
from fabric_perception.tracking.pipeline import Seen, SeenCube, Tracking
from fabric_perception.tracking.weighing import Scales
from fabric_perception.tracking.workspace import Workspace

RUNNING = (TaskState.SHOWING_RULES, TaskState.RUNNING)
CUPS = 20  # places of the cup that are kept: its way is needed at the time of a picture
UPRIGHT = Quaternion(0.0, 0.0, 0.0, 1.0)


class Answer(NamedTuple):
    """What one pair of pictures shows, as it is published. containers: None without a change."""

    seen: Seen
    cubes: CubeArray
    hand: HandState
    containers: ContainerArray | None


class TrackingSession:
    """Everything that the tracking node does, but for ROS. Poses in the frame of the cell.

    tracking: the tracker of the present scenario; None until there is a camera.
    """

    def __init__(
        self,
        workspace: Workspace,
        palette: Palette,
        parameters: TrackingParameters | None = None,
        scales: Scales | None = None,
    ) -> None:
        """scales: without them, cubes in a person's trays count when seen lying."""
        self._workspace, self._palette = workspace, palette
        self._parameters = parameters or TrackingParameters()
        self._scales = scales
        self._trackers: dict[str, Tracking] = {}
        self.tracking: Tracking | None = None
        self._scenario = workspace.scenario
        self._task_id = 0
        self._told: tuple[Tracking | None, int] = (None, 0)
        self._sequence = 0
        self._cups: deque[tuple[float, np.ndarray]] = deque(maxlen=CUPS)
        self._conveyor: ConveyorState | None = None

    # -- what it is told ------------------------------------------------------------------------

    def use_camera(self, camera: Camera) -> Tracking:
        """Begin to track with this camera; the trackers of all scenarios are made, which takes a
        moment."""
        for name in self._workspace.scenarios:
            workspace = replace(self._workspace, scenario=name)
            self._trackers[name] = Tracking(camera, workspace, self._palette, self._parameters)
        self.tracking = self._trackers[self._scenario]
        return self.tracking

    def forget_camera(self) -> None:
        """Its calibration has changed: the trackers are of no use any more."""
        self._trackers, self.tracking = {}, None

    def on_cup(self, t: float, place: Sequence[float]) -> None:
        """The end of the cup is at `place` (3,) m in the frame of the arm at time t (s)."""
        self._cups.append((t, self._workspace.arm.to_cell(np.array(place))))

    def on_conveyor(self, state: ConveyorState) -> None:
        """Take the belt's state."""
        self._conveyor = state

    def on_task(self, task: TaskState) -> ContainerArray | None:
        """Begin anew when a task begins; return the containers when there is news of them.

        Raises ValueError for a scenario without containers; the present one stays then.
        """
        if task.task_id == self._task_id or task.status not in RUNNING:
            return None
        self._task_id = task.task_id
        if self._scales is not None:
            self._scales.reset()
        if task.scenario not in self._workspace.scenarios:
            raise ValueError(f"scenario {task.scenario!r} has no containers in cell.yaml")
        self._scenario, self.tracking = task.scenario, self._trackers.get(task.scenario)
        if self.tracking is None:
            return None
        self.tracking.start_task()
        return self._containers(Header(stamp=task.header.stamp, frame_id="cell"))

    def on_load_cells(self, readings: LoadCellReadings) -> ContainerArray | None:
        """Take readings; return the containers when they have changed.

        Raises ValueError for readings that make no sense.
        """
        if self._scales is None:
            return None
        changes = self._scales.read(
            readings.header.stamp.to_sec(),
            readings.period,
            list(readings.containers),
            readings.counts,
        )
        if self.tracking is None:
            return None
        for change in changes:
            self.tracking.on_load_step(change.tray, change.t, change.cubes)
        return self._containers(Header(stamp=readings.header.stamp, frame_id="cell"))

    def on_pictures(self, header: Header, bgr: np.ndarray, depth: np.ndarray) -> Answer:
        """Take a pair of pictures; header: its stamp, frame `cell`.

        bgr: (H, W, 3) uint8. depth: (H, W) float32 m. Raises ValueError without a camera and for
        pictures that are of no use; then nothing has changed.
        """
        if self.tracking is None:
            raise ValueError("there are pictures, but no camera is known")
        t = header.stamp.to_sec()
        seen = self.tracking.step(t, bgr, depth, self._signals(t))
        cubes = CubeArray(header, [_cube(cube) for cube in seen.cubes])
        return Answer(seen, cubes, _hand(header, seen.hand), self._containers(header))

    # -- inside ---------------------------------------------------------------------------------

    def _signals(self, t: float) -> Signals:
        """What arm and belt say at the time of a picture, s."""
        cup = None
        if self._cups:
            times = [moment for moment, _ in self._cups]
            places = np.array([place for _, place in self._cups])
            cup = np.array([np.interp(t, times, places[:, axis]) for axis in range(3)])
        if self._conveyor is None:
            return Signals(cup)
        return Signals(cup, self._conveyor.speed, self._conveyor.cube_at_pick_point)

    def _containers(self, header: Header) -> ContainerArray | None:
        """The containers, when they have changed since they were told last."""
        tracking = self.tracking
        if tracking is None or self._told == (tracking, tracking.containers.sequence):
            return None
        self._told = (tracking, tracking.containers.sequence)
        self._sequence += 1
        rows = _rows(tracking.workspace, tracking.containers)
        return ContainerArray(header, self._sequence, rows)


def _cube(cube: SeenCube) -> Cube:
    pose = Pose(Point(*map(float, cube.position)), UPRIGHT)
    return Cube(cube.id, cube.colour, cube.where, pose, cube.confidence)


def _hand(header: Header, hand: HandTrack | None) -> HandState:
    if hand is None:
        return HandState(header=header, age=math.inf)
    position, velocity = Point(*map(float, hand.position)), Vector3(*map(float, hand.velocity))
    return HandState(header, hand.visible, position, velocity, hand.age)


def _rows(workspace: Workspace, containers: Containers) -> list[Container]:
    rows = []
    for tray in workspace.trays:
        ids = containers.contents[tray.id]
        colours = bytes(containers.colours[number] for number in ids)
        rows.append(Container(tray.id, tray.owner, tray.label, list(ids), colours))
    return rows
