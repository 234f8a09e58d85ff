# SPDX-License-Identifier: BSD-3-Clause
"""The shipped gestures can be carried out by the arm, and are drawn."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

import fabric_planner as fp
from fabric_dobot_driver import Goal, check_goal, load_limits
from fabric_dobot_driver.kinematics import MAGICIAN
from fabric_dobot_driver.limits import check_path
from fabric_sim.arm import load_arm
from fabric_sim.geometry import load_geometry
from fabric_sim.gesture_pictures import COLUMNS, Play, Stage, thinned

SOURCES = Path(__file__).resolve().parents[2]
MOTION = SOURCES / "fabric_planner/config/motion.yaml"
SAFETY = SOURCES / "fabric_planner/config/safety.yaml"
MAGICIAN_YAML = SOURCES / "fabric_dobot_driver/config/magician.yaml"
LIMITS = load_limits(MAGICIAN_YAML)
GESTURES = fp.MotionConfig.load(str(MOTION)).gestures


@pytest.fixture(scope="module")
def stage():
    cell = load_geometry(SOURCES.parent / "launch/config/cell.yaml")
    return Stage(MOTION, load_arm(SOURCES / "fabric_sim/config/arm.yaml"), cell)


@pytest.mark.parametrize(("name", "action"), GESTURES.items())
def test_every_way_of_a_gesture_is_within_the_limits_of_the_arm(stage, name, action):
    shots = Play(stage).shots(name, action)
    assert len(shots) > 1
    for start, end in zip(shots, shots[1:], strict=False):
        assert check_goal(Goal(end.tool, 0.1), LIMITS) is None, end
        assert check_path(start.tool, end.tool, LIMITS) is None, (start, end)


def test_a_grasp_leaves_the_cube_in_the_tray_and_a_cancel_on_the_belt(stage):
    trays = {(t.owner, t.label): t for t in stage.geometry.trays("sorting")}
    placed = Play(stage).shots("grasp", "grasp")[-1]
    assert any(t.holds(placed.cube) for (_, label), t in trays.items() if label == "red")
    back = Play(stage).shots("cancel", "cancel")
    assert back[0].cube.z > back[-1].cube.z
    assert abs(stage.geometry.conveyor.from_cell(back[-1].cube).y) < stage.geometry.belt.width / 2


def test_few_pictures_are_kept_the_first_and_the_last_among_them(stage):
    shots = Play(stage).shots("grasp", "grasp")
    kept = thinned(shots)
    assert len(kept) == COLUMNS < len(shots)
    assert (kept[0], kept[-1].tool) == (shots[0], shots[-1].tool)
    assert [shot.t for shot in kept] == sorted(shot.t for shot in kept)


def test_the_links_that_safety_watches_are_those_of_the_arm():
    monitor = fp.SafetyMonitor(str(SAFETY), str(MAGICIAN_YAML))
    base, elbow, wrist, tool = monitor.links(0.205, 0.045, 0.055)
    assert math.dist(base, elbow) == pytest.approx(MAGICIAN.rear_arm)
    assert math.dist(elbow, wrist) == pytest.approx(MAGICIAN.forearm)
    assert math.dist(wrist, tool) == pytest.approx(MAGICIAN.tool_x)
