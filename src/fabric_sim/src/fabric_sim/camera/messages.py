# SPDX-License-Identifier: BSD-3-Clause
"""Scenes, readings and pictures as messages."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from geometry_msgs.msg import Point as PointMsg
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header

from fabric_msgs.msg import InfraredReadings, LoadCellReadings, SimScene
from fabric_sim import reports
from fabric_sim.camera.parameters import Lens
from fabric_sim.camera.place import quaternion_of
from fabric_sim.camera.scene import Scene, SceneCube
from fabric_sim.geometry import Point

ENCODINGS = {"uint8": "bgr8", "float32": "32FC1"}


def scene_message(scene: Scene, task_id: int) -> SimScene:
    """Return the scene as a message."""
    return SimScene(
        header=reports.header(scene.t),
        task_id=task_id,
        scenario=scene.scenario,
        hand=PointMsg(*scene.hand),
        stop=scene.stop,
        holding=scene.holding,
        shoulder=PointMsg(*scene.shoulder),
        head=PointMsg(*scene.head),
        yaw=scene.yaw,
        pitch=scene.pitch,
        joints=list(scene.joints),
        cube_colours=[cube.colour for cube in scene.cubes],
        cubes=[reports.pose(Point(*cube.position), cube.yaw) for cube in scene.cubes],
    )


def scene_of_message(message: Any) -> Scene:
    """Return the scene of a SimScene. Raises ValueError when its lists do not belong together."""
    if len(message.cube_colours) != len(message.cubes):
        raise ValueError(
            f"{len(message.cube_colours)} colours of {len(message.cubes)} cubes in a scene"
        )
    places = zip(message.cube_colours, message.cubes, strict=True)
    return Scene(
        scenario=message.scenario,
        hand=_triple(message.hand),
        stop=message.stop,
        shoulder=_triple(message.shoulder),
        head=_triple(message.head),
        yaw=message.yaw,
        pitch=message.pitch,
        cubes=tuple(
            SceneCube(colour, _triple(pose.position), _yaw(pose.orientation))
            for colour, pose in places
        ),
        joints=tuple(message.joints),
        holding=message.holding,
        t=message.header.stamp.to_sec(),
    )


def load_cell_readings(
    t: float, rate: float, trays: tuple[int, ...], counts: np.ndarray
) -> LoadCellReadings:
    """Readings (n, trays) of which the last was made at time t (s)."""
    return LoadCellReadings(
        reports.header(t), reports.single(1.0 / rate), bytes(trays), counts.ravel().tolist()
    )


def infrared_readings(t: float, rate: float, levels: np.ndarray) -> InfraredReadings:
    """Levels (n,) bool of which the last was read at time t (s)."""
    return InfraredReadings(reports.header(t), reports.single(1.0 / rate), levels.tolist())


def image(stamp: Any, lens: Lens, picture: np.ndarray) -> Image:
    """A colour (H, W, 3) or depth (H, W) picture, taken at `stamp` by this camera."""
    height, width = picture.shape[:2]
    return Image(
        header=Header(stamp=stamp, frame_id=lens.frame),
        height=height,
        width=width,
        encoding=ENCODINGS[picture.dtype.name],
        is_bigendian=0,
        step=picture[0].nbytes,
        data=picture.tobytes(),
    )


def camera_info(stamp: Any, lens: Lens) -> CameraInfo:
    """The calibration of a camera that bends no lines."""
    K = lens.K
    return CameraInfo(
        header=Header(stamp=stamp, frame_id=lens.frame),
        height=lens.height,
        width=lens.width,
        distortion_model="plumb_bob",
        D=[0.0] * 5,
        K=K.ravel().tolist(),
        R=np.eye(3).ravel().tolist(),
        P=np.column_stack([K, np.zeros(3)]).ravel().tolist(),
    )


def place_of(lens: Lens) -> TransformStamped:
    """Where a camera is in the cell."""
    message = TransformStamped(header=reports.header(0.0), child_frame_id=lens.frame)
    at, q = message.transform.translation, message.transform.rotation
    at.x, at.y, at.z = map(float, lens.pose[:3, 3])
    q.w, q.x, q.y, q.z = map(float, quaternion_of(lens.pose[:3, :3]))
    return message


def _triple(point: Any) -> tuple[float, float, float]:
    return (point.x, point.y, point.z)


def _yaw(q: Any) -> float:
    return 2.0 * math.atan2(q.z, q.w)
