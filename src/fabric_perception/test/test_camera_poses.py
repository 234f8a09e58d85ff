# SPDX-License-Identifier: BSD-3-Clause
"""Poses of cameras, in files and as quaternions."""

import math

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from fabric_perception import camera_poses
from fabric_perception.camera import CameraError

ENTRY = {
    "frame": "head_camera_optical_frame",
    "parent": "cell",
    "translation": [0.1, -0.2, 0.75],
    "rotation": [0.5, -0.5, 0.5, -0.5],
}


def written(tmp_path, held) -> str:
    path = tmp_path / "camera.yaml"
    path.write_text(yaml.safe_dump(held))
    return str(path)


def test_quaternions_agree_with_scipy_both_ways():
    for R in Rotation.random(200, random_state=1):
        q = camera_poses.quaternion_of(R.as_matrix())
        assert abs(np.dot(q, R.as_quat())) == pytest.approx(1.0)
        assert q[3] >= 0.0
        pose = camera_poses.pose_of((1, 2, 3), R.as_quat())
        assert np.allclose(pose[:3, :3], R.as_matrix())
        assert np.allclose(pose[:3, 3], (1, 2, 3))


@pytest.mark.parametrize("axis", [[math.pi, 0, 0], [0, math.pi, 0], [0, 0, math.pi], [0, 0, 0]])
def test_half_turns_have_quaternions_too(axis):
    R = Rotation.from_rotvec(axis).as_matrix()
    found = camera_poses.pose_of((0, 0, 0), camera_poses.quaternion_of(R))
    assert np.allclose(found[:3, :3], R)


def test_what_is_saved_is_loaded(tmp_path):
    pose = camera_poses.pose_of((0.5, 0.25, -1.0), Rotation.random(random_state=2).as_quat())
    path = tmp_path / "new" / "camera.yaml"
    camera_poses.save_entry(path, {**camera_poses.entry_of("a_frame", pose), "views": 3})
    assert np.allclose(camera_poses.load_pose(path, "a_frame"), pose, atol=1e-5)


def test_several_cameras_may_share_a_file(tmp_path):
    other = {**ENTRY, "frame": "cell_camera_color_optical_frame"}
    poses = camera_poses.load_poses(written(tmp_path, {"cameras": [ENTRY, other]}))
    assert list(poses) == [ENTRY["frame"], other["frame"]]


def test_an_existing_file_is_overwritten_only_when_asked(tmp_path):
    path = tmp_path / "camera.yaml"
    path.write_text("precious")
    with pytest.raises(FileExistsError, match="left as it is"):
        camera_poses.save_entry(path, ENTRY)
    assert path.read_text() == "precious"
    camera_poses.save_entry(path, ENTRY, overwrite=True)
    assert camera_poses.load_pose(path, ENTRY["frame"])[0, 3] == 0.1


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"rotation": [0, 0, 0, 0]}, "length 0.0000, not 1"),
        ({"rotation": [0, 0, 1]}, "rotation is .* must be 4 numbers"),
        ({"translation": [0, math.nan, 0]}, r"translation\[1\] is nan"),
        ({"translation": [0, "1", 0]}, r"translation\[1\] is '1'"),
        ({"parent": "world"}, "parent is 'world'"),
        ({"frame": "/camera"}, "leading slash"),
    ],
)
def test_a_broken_pose_is_refused_by_file_and_element(tmp_path, changes, words):
    path = written(tmp_path, {**ENTRY, **changes})
    with pytest.raises(CameraError, match=words) as error:
        camera_poses.load_poses(path)
    assert f"{path}: camera 1: " in str(error.value)


@pytest.mark.parametrize("held", [None, [], "text", {"cameras": []}, [3]])
def test_a_file_without_cameras_is_refused(tmp_path, held):
    with pytest.raises(CameraError, match="holds no camera|is no mapping"):
        camera_poses.load_poses(written(tmp_path, held))


def test_a_missing_key_twin_or_file_is_named(tmp_path):
    short = {key: value for key, value in ENTRY.items() if key != "rotation"}
    with pytest.raises(CameraError, match="rotation is missing"):
        camera_poses.load_poses(written(tmp_path, short))
    with pytest.raises(CameraError, match="camera 2: .* there already"):
        camera_poses.load_poses(written(tmp_path, [ENTRY, ENTRY]))
    with pytest.raises(CameraError, match="holds no camera 'x', only head_camera"):
        camera_poses.load_pose(written(tmp_path, ENTRY), "x")
    with pytest.raises(CameraError, match="cannot be read"):
        camera_poses.load_poses(tmp_path / "none.yaml")
    (tmp_path / "bad.yaml").write_text("{: ")
    with pytest.raises(CameraError, match="is no YAML"):
        camera_poses.load_poses(tmp_path / "bad.yaml")
