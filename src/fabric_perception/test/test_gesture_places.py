# SPDX-License-Identifier: BSD-3-Clause
"""The places of features come from the cell's own file."""

import pytest
import yaml

from fabric_perception.gestures.features import FeatureSettings
from fabric_perception.gestures.places import in_cell

CELL = {
    "frames": {
        "conveyor": {"x": 0.3, "y": 0.1, "z": 0.12, "yaw": 1.0},
        "person": {"x": 0.8, "y": 0.0, "z": 0.0, "yaw": 1.5707963267948966},
    },
    "cube": {"edge": 0.03},
    "person": {"rest": {"x": 0.2, "y": -0.1, "z": 0.05}},
}


def written(tmp_path, cell):
    path = tmp_path / "cell.yaml"
    path.write_text(yaml.safe_dump(cell))
    return path


def test_pick_point_and_resting_place_are_those_of_the_cell(tmp_path):
    before = FeatureSettings(slope=0.3)
    features = in_cell(before, written(tmp_path, CELL))
    assert features.pick_point == pytest.approx((0.3, 0.1, 0.135))
    assert features.rest == pytest.approx((0.9, 0.2, 0.05))
    assert (features.slope, features.camera) == (0.3, before.camera)


@pytest.mark.parametrize(
    ("branch", "value", "words"),
    [
        ("person", {"rest": {"x": 0.2, "y": float("nan"), "z": 0.0}}, "person.rest.y"),
        ("person", {}, "person.rest"),
        ("cube", {"edge": -1.0}, "cube.edge"),
        ("frames", [], "frames"),
    ],
)
def test_a_cell_that_is_wrong_is_refused_by_its_entry(tmp_path, branch, value, words):
    with pytest.raises(ValueError, match=words):
        in_cell(FeatureSettings(), written(tmp_path, {**CELL, branch: value}))
