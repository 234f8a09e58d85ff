# SPDX-License-Identifier: BSD-3-Clause
"""The simulated arm: profile, results, pre-emption, refusals."""

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabric_dobot_driver import Goal, ToolPose, load_limits
from fabric_msgs.msg import MoveArmResult
from fabric_sim.arm import Arm, Trapezoid, load_arm
from fabric_sim.entries import ConfigError

ROOT = Path(__file__).resolve().parents[2]
PARAMETERS = load_arm(ROOT / "fabric_sim" / "config" / "arm.yaml")
LIMITS = load_limits(ROOT / "fabric_dobot_driver" / "config" / "magician.yaml")
PICK = ToolPose(0.281, 0.035, 0.012, 0.0)
RED = ToolPose(0.160, -0.285, -0.039, 0.0)
DT = 0.05


@pytest.fixture
def arm() -> Arm:
    return Arm(PARAMETERS, LIMITS)


def finish(arm: Arm, seconds: float = 30.0):
    """(result, time) of the running goal."""
    for tick in range(1, round(seconds / DT) + 1):
        results = arm.step(DT)
        if results:
            return results[0], tick * DT
    return None, seconds


@given(st.floats(0.0, 1.0), st.floats(0.01, 1.0), st.floats(0.1, 5.0))
def test_the_profile_starts_at_0_ends_at_1_and_never_exceeds_speed(length, speed, acceleration):
    profile = Trapezoid(length, speed, acceleration)
    steps = 200
    marks = [profile.fraction(profile.duration * i / steps) for i in range(steps + 1)]
    assert marks[-1] == 1.0
    if length > 1e-6:
        assert marks[0] == 0.0
        dt = profile.duration / steps
        rates = [length * (b - a) / dt for a, b in zip(marks, marks[1:], strict=False)]
        assert min(rates) >= -1e-9
        assert max(rates) <= speed * (1 + 1e-6)


def test_a_hand_worked_profile():
    profile = Trapezoid(1.0, 0.5, 1.0)  # 0.5 s up over 0.125 m, 1.5 s at 0.5 m/s, 0.5 s down
    assert profile.duration == pytest.approx(2.5)
    assert profile.fraction(0.5) == pytest.approx(0.125)
    assert profile.fraction(1.25) == pytest.approx(0.5)
    assert profile.fraction(2.0) == pytest.approx(0.875)


def test_a_goal_is_reached_after_moving_and_settling(arm):
    assert arm.start(7, Goal(PICK, 0.1, settle=0.5)) == []
    result, t = finish(arm)
    assert result == (7, MoveArmResult.REACHED, "")
    assert arm.pose == PICK
    length = math.dist(PARAMETERS.home[:3], PICK[:3])
    assert t == pytest.approx(length / 0.1 + 0.1 / PARAMETERS.acceleration + 0.5, abs=DT)


def test_the_tool_stays_on_the_straight_line(arm):
    arm.start(1, Goal(RED, 0.2))
    start = PARAMETERS.home
    way = [b - a for a, b in zip(start[:3], RED[:3], strict=True)]
    while arm.number is not None:
        arm.step(DT)
        gone = [b - a for a, b in zip(start[:3], arm.pose[:3], strict=True)]
        cross = math.hypot(
            way[1] * gone[2] - way[2] * gone[1],
            way[2] * gone[0] - way[0] * gone[2],
            way[0] * gone[1] - way[1] * gone[0],
        )
        assert cross < 1e-12
        assert all(math.isfinite(angle) for angle in arm.joints)


def test_a_goal_where_the_tool_stands_is_reached_in_the_next_step(arm):
    arm.start(1, Goal(PARAMETERS.home, 0.1))
    assert arm.step(DT) == [(1, MoveArmResult.REACHED, "")]


def test_turning_the_tool_takes_its_time(arm):
    arm.start(1, Goal(PARAMETERS.home._replace(yaw=1.5), 0.1))
    result, t = finish(arm)
    assert result.outcome == MoveArmResult.REACHED
    assert t == pytest.approx(0.5)


def test_stop_halts_at_once_with_pre_empted(arm):
    arm.start(3, Goal(RED, 0.2))
    arm.step(DT)
    assert arm.stop() == [(3, MoveArmResult.PRE_EMPTED, "cancelled")]
    pose = arm.pose
    assert arm.step(DT) == [] and arm.pose == pose and arm.remaining == 0.0
    assert arm.stop() == []


def test_a_new_goal_displaces_the_old_one(arm):
    arm.start(1, Goal(RED, 0.2))
    arm.step(DT)
    assert arm.start(2, Goal(PICK, 0.2)) == [(1, MoveArmResult.PRE_EMPTED, "goal 2 came")]
    assert arm.number == 2


def test_a_refused_goal_leaves_the_old_one_running(arm):
    arm.start(1, Goal(RED, 0.2))
    (result,) = arm.start(2, Goal(PICK._replace(x=0.34, y=0.2), 0.2))
    assert result.number == 2 and result.outcome == MoveArmResult.UNREACHABLE
    assert "out of the arm's reach" in result.reason
    (result,) = arm.start(3, Goal(PICK, math.nan))
    assert result.outcome == MoveArmResult.INVALID and "speed is nan" in result.reason
    assert arm.number == 1


def test_home_has_no_result_of_its_own(arm):
    arm.start(1, Goal(PICK, 0.2))
    finish(arm)
    assert arm.home() == []
    assert finish(arm, 5.0) == (None, 5.0)
    assert arm.pose == PARAMETERS.home


def test_bad_parameters_are_named(tmp_path):
    path = tmp_path / "arm.yaml"
    path.write_text("home: {x: 0.2, y: .nan, z: 0.0, yaw: 0.0}\nsuction: {}\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"arm.yaml: home.y is nan, want a finite number"):
        load_arm(path)
