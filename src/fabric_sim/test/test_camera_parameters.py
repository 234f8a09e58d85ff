# SPDX-License-Identifier: BSD-3-Clause
"""The cameras' files: read whole, or refused by file, entry and value."""

import numpy as np
import pytest
import yaml
from camera_helpers import CONFIGS, HELMET, PARAMETERS

from fabric_sim.camera.node_parameters import CameraNodeParameters
from fabric_sim.camera.parameters import CameraParameters
from fabric_sim.camera.place import elbow, pointing, quaternion_of, rotation_of, turn
from fabric_sim.cell_parameters import ParameterError
from fabric_sim.entries import ConfigError

NODE = {
    "camera": "head",
    "seed": 1,
    "cell_file": "cell.yaml",
    "limits_file": "magician.yaml",
    "camera_file": "camera.yaml",
    "poses_file": "cameras.yaml",
    "helmet_file": "helmet.yaml",
}


def load(tmp_path, name, change):
    """The parameters after a change to one of the files."""
    files = {"camera.yaml": CONFIGS, "cameras.yaml": CONFIGS, "helmet.yaml": HELMET.parent}
    paths = {}
    for file, folder in files.items():
        tree = yaml.safe_load((folder / file).read_text())
        if file == name:
            change(tree)
        paths[file] = tmp_path / file
        paths[file].write_text(yaml.safe_dump(tree))
    return CameraParameters.load(*paths.values())


def test_the_shipped_cameras_are_read():
    assert (PARAMETERS.cell.width, PARAMETERS.cell.height) == (640, 480)
    assert PARAMETERS.rate >= 10.0
    assert PARAMETERS.every == 20 / PARAMETERS.rate
    np.testing.assert_allclose(PARAMETERS.cell.K[:2, 2], (319.5, 239.5))
    assert {plate.id for plate in PARAMETERS.plates} == {0, 1, 2, 3}


@pytest.mark.parametrize(
    ("file", "change", "words"),
    [
        ("camera.yaml", lambda t: t.pop("rate"), "rate is missing"),
        ("camera.yaml", lambda t: t.update(rate=7.0), "rate is 7.0, want a divisor of 20"),
        ("camera.yaml", lambda t: t["cell"].update(focal=0.0), "cell.focal is 0.0, want a pos"),
        ("camera.yaml", lambda t: t["head"].update(width=1.5), "head.width is 1.5, want a whole"),
        ("camera.yaml", lambda t: t["noise"].update(grain=[5.0, 2.0]), "noise.grain is [5.0, 2"),
        ("camera.yaml", lambda t: t["depth"].update(most=float("nan")), "depth.most is nan"),
        ("camera.yaml", lambda t: t.update(clutter=[0.5, 1]), "clutter is [0.5, 1], want whole"),
        ("cameras.yaml", lambda t: t["cameras"].pop(0), "holds no camera 'cell_camera_color"),
        ("cameras.yaml", lambda t: t["cameras"][0].update(parent="x"), "cameras[0].parent is 'x'"),
        (
            "cameras.yaml",
            lambda t: t["cameras"][1].update(rotation=[0.0, 0.0, 0.0, 0.5]),
            "cameras[1].rotation is [0.0, 0.0, 0.0, 0.5], want a quaternion of length 1",
        ),
        ("helmet.yaml", lambda t: t["markers"][1].update(id=0), "want ids that differ"),
        ("helmet.yaml", lambda t: t["markers"][0].update(size=-1.0), "markers[0].size is -1.0"),
    ],
)
def test_damaged_files_are_refused_by_name(tmp_path, file, change, words):
    with pytest.raises(ConfigError) as caught:
        load(tmp_path, file, change)
    assert file in str(caught.value)
    assert words in str(caught.value)


def test_the_node_takes_its_files():
    parameters = CameraNodeParameters.load(NODE, "/camera")
    assert parameters.helmet_file == "helmet.yaml"
    assert not parameters.shadows


@pytest.mark.parametrize("key", sorted(NODE))
def test_the_node_wants_every_file(key):
    with pytest.raises(ParameterError, match=f"^parameter /camera/{key} is missing$"):
        CameraNodeParameters.load({k: v for k, v in NODE.items() if k != key}, "/camera")


def test_the_node_refuses_what_it_does_not_know():
    with pytest.raises(ParameterError, match="/camera/camera is 'tail', want one of cell, head"):
        CameraNodeParameters.load(NODE | {"camera": "tail"}, "/camera")
    with pytest.raises(ParameterError, match="/camera/colour is not known"):
        CameraNodeParameters.load(NODE | {"colour": 1}, "/camera")


def test_turns_and_quaternions_agree():
    rng = np.random.default_rng(5)
    for q in rng.normal(size=(200, 4)):
        w, x, y, z = quaternion_of(rotation_of(q))
        np.testing.assert_allclose(rotation_of((x, y, z, w)), rotation_of(q), atol=1e-12)
    np.testing.assert_allclose(turn("z", np.pi / 2) @ (1, 0, 0), (0, 1, 0), atol=1e-15)
    np.testing.assert_allclose(turn("y", np.pi / 2) @ (0, 0, 1), (1, 0, 0), atol=1e-15)


def test_pointing_keeps_its_direction_and_is_a_turn():
    R = pointing((1.0, 2.0, -0.5), (0.0, 0.0, 1.0))
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1.0)
    np.testing.assert_allclose(R[:, 2], np.array((1.0, 2.0, -0.5)) / np.sqrt(5.25))
    assert np.linalg.det(pointing((0.0, 0.0, 2.0), (0.0, 0.0, 1.0))) == pytest.approx(1.0)


def test_an_elbow_keeps_both_lengths_and_hangs():
    shoulder, wrist = np.array((0.8, 0.2, 0.4)), np.array((0.5, 0.1, 0.2))
    bend = elbow(shoulder, wrist, 0.29, 0.25)
    assert np.linalg.norm(bend - shoulder) == pytest.approx(0.29)
    assert np.linalg.norm(bend - wrist) == pytest.approx(0.25)
    assert bend[2] < (shoulder[2] + wrist[2]) / 2
    far = elbow(shoulder, shoulder + (2.0, 0.0, 0.0), 0.3, 0.3)
    np.testing.assert_allclose(far, shoulder + (1.0, 0.0, 0.0))
