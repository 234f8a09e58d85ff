# SPDX-License-Identifier: BSD-3-Clause
"""Goals: what is accepted, what is refused and in which words."""

import math
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from fabric_dobot_driver import Goal, ToolPose, check_goal, load_limits
from fabric_dobot_driver.limits import Fault, check_path

CONFIG = Path(__file__).resolve().parents[1] / "config" / "magician.yaml"
LIMITS = load_limits(CONFIG)
FRONT = {
    "home": (0.197, -0.001, 0.035),
    "above the cube": (0.282, 0.040, 0.072),
    "beside the belt": (0.205, 0.045, 0.055),
    "pick": (0.281, 0.035, 0.012),
    "put back": (0.280, -0.069, 0.016),
    "attention": (0.201, 0.0, 0.170),
    "point": (0.240, 0.025, 0.140),
    "side": (0.170, -0.190, 0.060),
}
SIDE = {
    "side": (0.170, -0.190, 0.060),
    "red tray": (0.160, -0.285, -0.039),
    "green tray": (0.070, -0.290, -0.039),
    "blue tray": (-0.030, -0.300, -0.039),
    "above the red tray": (0.160, -0.285, 0.050),
    "above the blue tray": (-0.060, -0.265, 0.050),
}
POSES = FRONT | SIDE


def goal(x=0.2, y=0.0, z=0.05, yaw=0.0, speed=0.2, settle=0.0) -> Goal:
    return Goal(ToolPose(x, y, z, yaw), speed, settle)


@pytest.mark.parametrize("name", POSES)
def test_every_pose_of_the_cell_is_allowed(name):
    assert check_goal(goal(*POSES[name]), LIMITS) is None


@given(st.sampled_from([FRONT, SIDE]), st.data(), st.floats(0.0, 1.0))
def test_from_anywhere_between_two_poses_of_a_side_every_other_can_be_reached(side, data, fraction):
    a, b, c = (side[data.draw(st.sampled_from(sorted(side)))] for _ in range(3))
    start = [p + fraction * (q - p) for p, q in zip(a, b, strict=True)]
    assert check_path(ToolPose(*start, 0.0), ToolPose(*c, 0.0), LIMITS) is None


@pytest.mark.parametrize("field", ["x", "y", "z", "yaw", "speed", "settle"])
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_numbers_that_are_none_are_refused_by_name(field, value):
    refusal = check_goal(goal(**{field: value}), LIMITS)
    assert refusal.fault is Fault.INVALID
    assert refusal.reason == f"{field} is {value}, want a finite number"


@pytest.mark.parametrize(
    ("bad", "fault", "words"),
    [
        (goal(speed=0.0), Fault.INVALID, "speed is 0 m/s, allowed 0.005 to 0.5"),
        (goal(speed=0.51), Fault.INVALID, "speed is 0.51 m/s"),
        (goal(settle=-1.0), Fault.INVALID, "settle is -1 s, allowed 0 to 10"),
        (goal(z=0.3), Fault.INVALID, "z is 0.300 m, the allowed box has -0.09 to 0.25"),
        (goal(x=0.05, z=0.0), Fault.INVALID, "lies in the arm's own base"),
        (goal(x=0.28, y=0.1, z=-0.05), Fault.INVALID, "lies in the belt's body"),
        (goal(x=0.34, y=0.2), Fault.UNREACHABLE, "(0.340, 0.200, 0.050) m is out of the arm's"),
        (goal(x=-0.15, y=0.2), Fault.UNREACHABLE, "needs j1 at 126.9 deg, limits -125.0 to 125.0"),
        (goal(y=-0.2, yaw=2.0), Fault.UNREACHABLE, "needs j4 at 159.6 deg"),
    ],
)
def test_refusals_say_why(bad, fault, words):
    refusal = check_goal(bad, LIMITS)
    assert refusal.fault is fault
    assert words in refusal.reason


def test_a_line_past_the_base_is_refused_although_both_ends_are_fine():
    left, right = ToolPose(0.0, 0.25, 0.05, 0.0), ToolPose(0.0, -0.25, 0.05, 0.0)
    assert check_goal(Goal(left, 0.1), LIMITS) is None
    assert check_goal(Goal(right, 0.1), LIMITS) is None
    refusal = check_path(left, right, LIMITS)
    assert refusal.fault is Fault.UNREACHABLE
    assert "straight line is blocked" in refusal.reason


@pytest.mark.parametrize(
    ("keys", "value", "words"),
    [
        (("joints", "j2"), [5.0, -5.0], "joints.j2 is [5.0, -5.0], want the smaller number first"),
        (("joints", "j3"), [0.0], "joints.j3 is [0.0], want two numbers"),
        (("links", "forearm"), math.nan, "links.forearm is nan, want a finite number"),
        (("links", "rear_arm"), -0.1, "links.rear_arm is -0.1, want a positive length"),
        (("links", "tool_x"), "six", "links.tool_x is 'six', want a number"),
        (("speed", "max"), True, "speed[1] is True, want a number"),
        (("allowed", "min"), [0.0, 0.0], "allowed.min is [0.0, 0.0], want three numbers"),
        (("forbidden",), [3], "forbidden[0] is 3, want a box with min and max"),
    ],
)
def test_bad_files_are_refused_by_entry_and_value(tmp_path, keys, value, words):
    tree = yaml.safe_load(CONFIG.read_text(encoding="utf-8"))
    branch = tree
    for key in keys[:-1]:
        branch = branch[key]
    branch[keys[-1]] = value
    path = tmp_path / "bad.yaml"
    path.write_text(yaml.safe_dump(tree), encoding="utf-8")
    with pytest.raises(ValueError, match="bad.yaml") as caught:
        load_limits(path)
    assert words in str(caught.value)


def test_a_missing_entry_is_named_in_full(tmp_path):
    tree = yaml.safe_load(CONFIG.read_text(encoding="utf-8"))
    del tree["joints"]["elbow"]
    path = tmp_path / "bad.yaml"
    path.write_text(yaml.safe_dump(tree), encoding="utf-8")
    with pytest.raises(ValueError, match=r"joints\.elbow is missing"):
        load_limits(path)
