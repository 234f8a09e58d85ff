# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of the robot's gestures, one row each: `python3 -m fabric_sim.gesture_pictures OUT.jpg`.

The motion agent plays every gesture of a motion file in an empty cell with one cube; the arm is
drawn where it stands at the way-points, with the time it takes there.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
import rospkg

import fabric_planner as fp
from fabric_dobot_driver import ToolPose, inverse, load_limits
from fabric_msgs.msg import Cube, CubeArray, MoveArmResult, SortingRule, TaskState
from fabric_sim.arm import ArmParameters, Trapezoid, load_arm
from fabric_sim.camera.drawing import CannotDraw, open_renderer
from fabric_sim.camera.parameters import CameraParameters, Lens
from fabric_sim.camera.scene import Scene, SceneCube
from fabric_sim.geometry import CellGeometry, Point, load_geometry

ORDER = "idle planning point grasp cancel".split()  # rows by the action a gesture stands for
TILE = (240, 200)  # pixels
MARGIN = 120  # pixels, for the gesture's name
COLUMNS = 6
SEED = 101
EYE, AIM = np.array([0.60, 0.36, 0.52]), np.array([0.18, -0.075, 0.19])  # m, of the camera in cell
FOCAL = 350.0  # pixels
AWAY = (5.0, 5.0, 0.0)  # m, where nobody sees the person
QUALITY = 82  # of the JPEG


class Shot(NamedTuple):
    """Where things are at a way-point.

    t: s since the gesture began. cube: middle, m in cell. holds: whether it hangs at the cup.
    """

    t: float
    tool: ToolPose
    cube: Point
    holds: bool


@dataclass(frozen=True)
class Stage:
    """The arm and the place it plays in."""

    motion: Path
    arm: ArmParameters
    geometry: CellGeometry


class Play:
    """A gesture played by the motion agent, move for move.

    Each begins where there is something to see: idle beside the belt, a grasp when it is planned, a
    cancel with a cube at the cup on its way to the tray.
    """

    def __init__(self, stage: Stage) -> None:
        self._stage, self._edge = stage, stage.geometry.edge
        self._agent = fp.MotionAgent(str(stage.motion))
        self._t = 0.0
        self._tool = stage.arm.home
        self._cube = stage.geometry.conveyor.to_cell(Point(0.0, 0.0, self._edge / 2))
        self._sucks = False

    def shots(self, name: str, action: str) -> list[Shot]:
        """What is to be seen of it, from where it begins."""
        agent = self._agent
        rules = [SortingRule(colour=Cube.COLOUR_RED, label="red")]
        task = TaskState(task_id=1, status=TaskState.RUNNING, scenario="sorting", rules=rules)
        list(self._moves(agent.on_task(task)))
        agent.on_conveyor(True)
        agent.on_cubes(CubeArray(cubes=[_red(Cube.WHERE_PICK_POINT)]))
        if action in ("idle", "grasp"):
            list(self._moves(agent.on_decision("planning", 1)))
        elif action == "cancel":
            self._carry(agent.on_decision("grasp", 1))
        self._t = 0.0
        return [self._shot(), *self._moves(agent.on_gesture(name))]

    def _carry(self, commands: list) -> None:
        """Take the cube and go with it until the arm is out of the belt's way."""
        lifted = 0
        for _ in self._moves(commands):
            lifted += self._sucks
            if lifted == 3:
                return

    def _moves(self, commands: list) -> Iterator[Shot]:
        """Carry out moves until none comes any more; a picture after each."""
        while True:
            goal = None
            for command in commands:
                if command.kind == fp.CommandKind.MOVE:
                    goal = command
                elif command.kind in (fp.CommandKind.SUCTION_ON, fp.CommandKind.SUCTION_OFF):
                    self._sucks = command.kind == fp.CommandKind.SUCTION_ON
            if goal is not None:
                self._go(goal)
                yield self._shot()
                commands = self._tell(goal.number)
            elif self._agent.outstanding is not None:  # a move that was broken off before
                number = self._agent.outstanding
                commands = self._agent.on_arm_result(number, MoveArmResult.PRE_EMPTED)
            else:
                return

    def _go(self, goal: fp.MotionCommand) -> None:
        target = ToolPose(goal.x, goal.y, goal.z, goal.yaw)
        length = math.dist(self._tool[:3], target[:3])
        self._t += Trapezoid(length, goal.speed, self._stage.arm.acceleration).duration
        self._t += goal.settle
        self._tool = target
        if self._sucks:
            cup = self._stage.geometry.arm.to_cell(Point(*target[:3]))
            self._cube = Point(cup.x, cup.y, cup.z - self._edge / 2)

    def _tell(self, number: int) -> list:
        agent = self._agent
        lifted = self._sucks and agent.state().holding
        said = agent.on_conveyor(False) if lifted else []
        said += agent.on_cubes(CubeArray(cubes=[_red(Cube.WHERE_ROBOT)])) if lifted else []
        return said + agent.on_arm_result(number, MoveArmResult.REACHED)

    def _shot(self) -> Shot:
        return Shot(self._t, self._tool, self._cube, self._sucks)


def _red(where: int) -> Cube:
    return Cube(colour=Cube.COLOUR_RED, where=where, confidence=1.0)


def lens() -> Lens:
    """A camera beside the person, at the arm's left."""
    ahead = (AIM - EYE) / np.linalg.norm(AIM - EYE)
    right = np.cross(ahead, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = right, np.cross(ahead, right), ahead, EYE
    return Lens("gestures", *TILE, FOCAL, pose)


def thinned(shots: list[Shot]) -> list[Shot]:
    """At most COLUMNS of them: the first, the last, where the cube is taken or let go, and of the
    others those furthest from their neighbours."""
    shots = [s for i, s in enumerate(shots) if i == 0 or s[1:] != shots[i - 1][1:]]
    while len(shots) > COLUMNS:
        worth = [_worth(*shots[i - 1 : i + 2]) for i in range(1, len(shots) - 1)]
        del shots[1 + int(np.argmin(worth))]
    return shots


def _worth(before: Shot, shot: Shot, after: Shot) -> float:
    if shot.holds != before.holds:
        return math.inf
    return math.dist(before.tool[:3], shot.tool[:3]) + math.dist(shot.tool[:3], after.tool[:3])


def sheet(motion: Path) -> np.ndarray:
    """All gestures of the file, blue first. Raises ModelError, ValueError, CannotDraw."""
    share = rospkg.RosPack().get_path
    driver, sim = Path(share("fabric_dobot_driver")), Path(share("fabric_sim"))
    limits, cell = (
        driver / "config/magician.yaml",
        Path(share("fabric_bringup")) / "config/cell.yaml",
    )
    stage = Stage(motion, load_arm(sim / "config/arm.yaml"), load_geometry(cell))
    links = load_limits(limits).links
    helmet = Path(share("fabric_perception")) / "config/helmet.yaml"
    parameters = CameraParameters.load(
        sim / "config/camera.yaml", sim / "config/cameras.yaml", helmet
    )
    renderer = open_renderer(cell, limits, replace(parameters, cell=lens()), SEED)
    rows = []
    for name, action in _in_order(fp.MotionConfig.load(str(motion)).gestures):
        row = np.full((TILE[1], MARGIN + COLUMNS * TILE[0], 3), 255, np.uint8)
        _write(row, name, (8, TILE[1] // 2), 0.55)
        for column, shot in enumerate(thinned(Play(stage).shots(name, action))):
            joints = inverse(shot.tool, links)
            if joints is None:
                raise ValueError(f"{motion}: gesture {name!r} leads out of reach at {shot.tool}")
            cube = SceneCube(Cube.COLOUR_RED, tuple(shot.cube), 0.0)
            scene = Scene(hand=AWAY, shoulder=AWAY, head=AWAY, cubes=(cube,), joints=tuple(joints))
            tile = renderer.render_clean(scene).rgb.copy()
            _write(tile, f"{shot.t:.1f} s", (6, 18), 0.5, (255, 255, 255))
            left = MARGIN + column * TILE[0]
            row[:, left : left + TILE[0]] = tile
        rows.append(row)
    renderer.close()
    return np.vstack(rows)


def _in_order(gestures: dict[str, str]) -> list[tuple[str, str]]:
    return sorted(gestures.items(), key=lambda item: (ORDER.index(item[1]), item[0]))


def _write(
    picture: np.ndarray,
    text: str,
    at: tuple[int, int],
    size: float,
    colour: tuple[int, int, int] = (0, 0, 0),
) -> None:
    cv2.putText(picture, text, at, cv2.FONT_HERSHEY_SIMPLEX, size, colour, 1, cv2.LINE_AA)


def main() -> int:
    """Write the sheet; 2 for a motion file that is refused, 1 where nothing can be drawn."""
    words = argparse.ArgumentParser(description="Draw every gesture of a motion file.")
    words.add_argument("out", type=Path, help="a .jpg or .png file")
    words.add_argument("--motion", type=Path, help="a motion file; otherwise the shipped one")
    chosen = words.parse_args()
    shipped = Path(rospkg.RosPack().get_path("fabric_planner")) / "config/motion.yaml"
    try:
        picture = sheet(chosen.motion or shipped)
    except (ValueError, fp.ModelError) as error:
        print(error, file=sys.stderr)
        return 2
    except CannotDraw as error:
        print(error, file=sys.stderr)
        return 1
    if not cv2.imwrite(str(chosen.out), picture, (cv2.IMWRITE_JPEG_QUALITY, QUALITY)):
        print(f"{chosen.out}: cannot be written", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
