# SPDX-License-Identifier: BSD-3-Clause
"""Where cameras are in the cell: YAML files of their poses, and rotations as quaternions.

A file holds one camera,

    frame: cell_camera_color_optical_frame
    parent: cell
    translation: [x, y, z]      # m
    rotation: [x, y, z, w]      # takes the optical frame to the parent

or several as a list under `cameras`. Further keys say how the pose was found and are not read.
"""

import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import ArrayLike

from fabric_perception.camera import CameraError, check_pose

PARENT = "cell"
UNIT_TOLERANCE = 1e-3  # of the length of a quaternion written by hand


def pose_of(translation: ArrayLike, rotation: ArrayLike) -> np.ndarray:
    """Return the (4, 4) of a translation (3,) m and a quaternion (4,) x y z w.

    Raises CameraError for a quaternion that is not of length 1.
    """
    t = np.asarray(translation, dtype=float)
    q = np.asarray(rotation, dtype=float)
    if t.shape != (3,) or q.shape != (4,) or not np.isfinite([*t, *q]).all():
        raise CameraError(f"{t.tolist()}, {q.tolist()} is no translation and quaternion")
    length = float(np.linalg.norm(q))
    if abs(length - 1.0) > UNIT_TOLERANCE:
        raise CameraError(f"the quaternion {q.tolist()} has length {length:.4f}, not 1")
    x, y, z, w = q / length
    pose = np.eye(4)
    pose[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    pose[:3, 3] = t
    return pose


def quaternion_of(rotation: ArrayLike) -> tuple[float, float, float, float]:
    """Return x, y, z, w (w >= 0) of a rotation matrix (3, 3)."""
    R = np.asarray(rotation, dtype=float)
    squares = [  # four times the square of each component; the largest is safe to divide by
        1 + R[0, 0] - R[1, 1] - R[2, 2],
        1 - R[0, 0] + R[1, 1] - R[2, 2],
        1 - R[0, 0] - R[1, 1] + R[2, 2],
        1 + R[0, 0] + R[1, 1] + R[2, 2],
    ]
    rows = (
        (squares[0], R[0, 1] + R[1, 0], R[0, 2] + R[2, 0], R[2, 1] - R[1, 2]),
        (R[0, 1] + R[1, 0], squares[1], R[1, 2] + R[2, 1], R[0, 2] - R[2, 0]),
        (R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], squares[2], R[1, 0] - R[0, 1]),
        (R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], squares[3]),
    )
    q = np.array(rows[int(np.argmax(squares))])
    q *= math.copysign(1.0, q[3]) / np.linalg.norm(q)
    return (float(q[0]), float(q[1]), float(q[2]), float(q[3]))


def load_poses(path: str | Path) -> dict[str, np.ndarray]:
    """Return the pose (4, 4) in cell of every camera of a file, by its optical frame.

    Raises CameraError naming file, camera and element.
    """
    entries = _entries(Path(path))
    poses: dict[str, np.ndarray] = {}
    for number, entry in enumerate(entries, 1):
        try:
            frame, pose = _camera(entry)
            if frame in poses:
                raise CameraError(f"the frame '{frame}' is there already")
        except CameraError as error:
            raise CameraError(f"{path}: camera {number}: {error}") from None
        poses[frame] = pose
    return poses


def load_pose(path: str | Path, frame: str) -> np.ndarray:
    """Return the pose (4, 4) in cell of one camera of a file; raises CameraError."""
    poses = load_poses(path)
    if frame not in poses:
        raise CameraError(f"{path}: holds no camera '{frame}', only {', '.join(poses)}")
    return poses[frame]


def entry_of(frame: str, pose: ArrayLike) -> dict[str, Any]:
    """Return what a file holds of one camera; raises CameraError when the pose is none."""
    pose = check_pose(pose)
    return {
        "frame": frame,
        "parent": PARENT,
        "translation": [round(float(v), 6) for v in pose[:3, 3]],
        "rotation": [round(v, 8) for v in quaternion_of(pose[:3, :3])],
    }


def save_entry(path: str | Path, entry: Mapping[str, Any], overwrite: bool = False) -> None:
    """Write one camera as a file, all or nothing.

    Raises FileExistsError when the file is there and may not be overwritten.
    """
    path = Path(path)
    if path.exists() and not overwrite:
        raise FileExistsError(f"{path} is there already and was left as it is")
    text = "# SPDX-License-Identifier: BSD-3-Clause\n" + yaml.safe_dump(
        dict(entry), sort_keys=False, default_flow_style=None
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(path.name + ".part")
    partial.write_text(text, encoding="utf-8")
    os.replace(partial, path)


def read_yaml(path: Path) -> Any:
    """Return what a YAML file holds; raises CameraError naming the file."""
    try:
        return yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise CameraError(f"{path}: cannot be read: {error}") from None
    except yaml.YAMLError as error:
        raise CameraError(f"{path}: is no YAML: {str(error).splitlines()[0]}") from None


def _entries(path: Path) -> Sequence[Any]:
    held = read_yaml(path)
    if isinstance(held, Mapping) and "cameras" in held:
        held = held["cameras"]
    entries = [held] if isinstance(held, Mapping) else held
    if not isinstance(entries, list) or not entries:
        raise CameraError(f"{path}: holds no camera")
    return entries


def _camera(entry: Any) -> tuple[str, np.ndarray]:
    if not isinstance(entry, Mapping):
        raise CameraError(f"{entry!r} is no mapping")
    for key in ("frame", "parent", "translation", "rotation"):
        if key not in entry:
            raise CameraError(f"{key} is missing")
    frame, parent = entry["frame"], entry["parent"]
    if not isinstance(frame, str) or not frame or frame.startswith("/"):
        raise CameraError(f"frame is {frame!r}; it must be a name without a leading slash")
    if parent != PARENT:
        raise CameraError(f"parent is {parent!r}; it must be {PARENT}")
    pose = pose_of(
        _numbers("translation", entry["translation"], 3), _numbers("rotation", entry["rotation"], 4)
    )
    return frame, pose


def _numbers(name: str, values: Any, count: int) -> list[float]:
    if not isinstance(values, list) or len(values) != count:
        raise CameraError(f"{name} is {values!r}; it must be {count} numbers")
    for index, value in enumerate(values):
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise CameraError(f"{name}[{index}] is {value!r}; it must be a number")
        if not math.isfinite(value):
            raise CameraError(f"{name}[{index}] is {value}; it must be finite")
    return [float(value) for value in values]
