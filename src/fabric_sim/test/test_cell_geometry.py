# SPDX-License-Identifier: BSD-3-Clause
"""Geometry: the shipped file makes sense, bad files are refused by name."""

import math
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from fabric_msgs.msg import Container
from fabric_sim.geometry import ConfigError, Frame, Point, load_geometry

PATH = Path(__file__).resolve().parents[3] / "launch" / "config" / "cell.yaml"
GEOMETRY = load_geometry(PATH)
METRES = st.floats(-2.0, 2.0)


@given(METRES, METRES, METRES, st.floats(-math.pi, math.pi), METRES, METRES, METRES)
def test_frames_go_there_and_back(fx, fy, fz, yaw, x, y, z):
    frame = Frame(fx, fy, fz, yaw)
    assert frame.from_cell(frame.to_cell(Point(x, y, z))) == pytest.approx((x, y, z), abs=1e-9)


def test_the_cup_reaches_a_cube_at_the_pick_point():
    top = GEOMETRY.conveyor.to_cell(Point(0.0, 0.0, GEOMETRY.edge))
    assert GEOMETRY.arm.from_cell(top) == pytest.approx((0.281, 0.035, 0.012))


def test_the_belt_runs_towards_its_box():
    end = GEOMETRY.conveyor.to_cell(Point(GEOMETRY.belt.end + 0.06, 0.0, 0.0))
    for scenario in ("inspection", "sorting"):
        (box,) = [t for t in GEOMETRY.trays(scenario) if t.owner == Container.OWNER_BELT]
        assert box.label == "uninspected"
        assert box.holds(end)


def test_containers_of_a_scenario_do_not_overlap_each_other():
    for trays in GEOMETRY.scenarios.values():
        for a in trays:
            for b in trays:
                apart = [
                    abs(a.floor[i] - b.floor[i]) >= (a.size[i] + b.size[i]) / 2 - 1e-9
                    for i in (0, 1)
                ]
                assert a is b or any(apart)


def test_slots_lie_in_their_container_and_differ():
    for trays in GEOMETRY.scenarios.values():
        for tray in trays:
            slots = [tray.slot(i, GEOMETRY.edge) for i in range(12)]
            assert all(tray.holds(slot) for slot in slots)
            assert len(set(slots)) == len(slots)


def test_an_unknown_scenario_is_refused_with_the_allowed_ones():
    with pytest.raises(ValueError, match="scenario is 'packing'; allowed: inspection, sorting"):
        GEOMETRY.trays("packing")


@pytest.mark.parametrize(
    ("keys", "value", "words"),
    [
        (("cube", "edge"), 0.0, "cube.edge is 0.0, want a positive number"),
        (("belt", "feeder"), 0.1, "belt.feeder is 0.1, want a negative number"),
        (("belt", "spacing"), 0.1, "belt.spacing is 0.1, want more than belt.end"),
        (("frames", "person", "yaw"), math.inf, "frames.person.yaw is inf, want a finite number"),
        (("table", "size"), [1.0, 2.0], "table.size is [1.0, 2.0], want 3 numbers"),
        (("scenarios", "sorting", "containers"), [], "want a list with one entry or more"),
        (("person", "head"), 3, "person.head is 3, want named entries"),
    ],
)
def test_bad_files_are_refused_by_entry_and_value(tmp_path, keys, value, words):
    with pytest.raises(ConfigError) as caught:
        load_geometry(changed(tmp_path, keys, value))
    assert words in str(caught.value) and "bad.yaml" in str(caught.value)


@pytest.mark.parametrize(
    ("entry", "value", "words"),
    [
        ("owner", "dog", "containers[0].owner is 'dog', want one of person, robot, belt"),
        ("id", 2, "want ids that differ"),
        ("id", 0, "containers[0].id is 0, want a whole number, 1 or more"),
        ("owner", "belt", "want exactly one box of the belt"),
    ],
)
def test_bad_containers_are_refused(tmp_path, entry, value, words):
    tree = yaml.safe_load(PATH.read_text(encoding="utf-8"))
    containers = tree["scenarios"]["inspection"]["containers"]
    containers[0][entry] = value
    with pytest.raises(ConfigError) as caught:
        load_geometry(changed(tmp_path, ("scenarios", "inspection", "containers"), containers))
    assert words in str(caught.value)


def test_missing_and_broken_files_are_named(tmp_path):
    with pytest.raises(ConfigError, match="nowhere.yaml: cannot be read"):
        load_geometry(tmp_path / "nowhere.yaml")
    broken = tmp_path / "broken.yaml"
    broken.write_text("frames: [", encoding="utf-8")
    with pytest.raises(ConfigError, match="broken.yaml: is not YAML"):
        load_geometry(broken)
    broken.write_text("cube: {}", encoding="utf-8")
    with pytest.raises(ConfigError, match="broken.yaml: frames is missing"):
        load_geometry(broken)


def changed(tmp_path: Path, keys: tuple[str, ...], value: object) -> Path:
    tree = yaml.safe_load(PATH.read_text(encoding="utf-8"))
    branch = tree
    for key in keys[:-1]:
        branch = branch[key]
    branch[keys[-1]] = value
    path = tmp_path / "bad.yaml"
    path.write_text(yaml.safe_dump(tree), encoding="utf-8")
    return path
