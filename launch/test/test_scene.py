# SPDX-License-Identifier: BSD-3-Clause
"""The markers: stable ids, taken away when they are gone, and nothing but what is perceived."""

from __future__ import annotations

from pathlib import Path

import pytest
from visualization_msgs.msg import Marker

from fabric_bringup import layout, panels, scene
from fabric_msgs.msg import (
    Cube,
    CubeArray,
    Decision,
    HeadState,
    HumanActivity,
    ModelInfo,
    PolicyChoice,
    RobotActionState,
    SortingRule,
    TaskState,
    TypeBelief,
)
from fabric_study.task_manager import TaskManager
from fabric_study.tasks import load_definition

CELL = Path(__file__).resolve().parents[1] / "config/cell.yaml"
STATES = ["task_assigned_to_human", "needs_help", "global_success"]
ACTIONS = ["idle", "planning", "point", "grasp", "cancel"]


def activity(kind: int, detected: bool = True) -> HumanActivity:
    posterior = [0.1] * 4
    posterior[kind] = 0.7
    return HumanActivity(posterior=posterior, detected=detected)


def running(scenario: str = "sorting") -> TaskState:
    rules = [SortingRule(colour=Cube.COLOUR_RED, label="red")]
    return TaskState(task_id=1, scenario=scenario, status=TaskState.RUNNING, rules=rules)


@pytest.fixture
def picture() -> scene.Scene:
    full = scene.Scene(layout.load(CELL))
    full.take("task/state", running())
    full.take("human/activity", activity(HumanActivity.GRASP))
    full.take("human/head", HeadState(visible=True))
    full.take("cell/cubes", CubeArray(cubes=[Cube(id=1), Cube(id=2)]))
    full.take("model_info", ModelInfo(states=STATES, actions=ACTIONS, observations=["absent"]))
    full.take("decision", Decision(action=2, belief=[0.2, 0.7, 0.1], value=3.0, runner_up=0))
    full.take("robot/state", RobotActionState(current=3, queued=RobotActionState.NONE))
    full.take("abps/type_belief", TypeBelief(types=["expert_tired"], probability=[1.0]))
    full.take("abps/policy", PolicyChoice(policy="patient", unlike_anyone_known=True))
    return full


def keys(markers: list[Marker], action: int = Marker.ADD) -> list[tuple[str, int]]:
    return [(marker.ns, marker.id) for marker in markers if marker.action == action]


def words(markers: list[Marker]) -> str:
    return "\n".join(marker.text for marker in markers)


def test_an_empty_scene_can_be_drawn():
    assert "no task yet" in words(scene.Scene(layout.load(CELL)).markers(0.0))


def test_every_marker_has_its_own_id_and_keeps_it(picture):
    first, second = keys(picture.markers(0.0)), keys(picture.markers(0.1))
    assert len(set(first)) == len(first)
    assert first == second


def test_what_is_gone_is_deleted_once(picture):
    picture.markers(0.0)
    picture.take("cell/cubes", CubeArray(cubes=[Cube(id=2)]))
    assert keys(picture.markers(0.1), Marker.DELETE) == [("cubes", 1)]
    assert keys(picture.markers(0.2), Marker.DELETE) == []


def test_a_warning_flashes_and_goes(picture):
    picture.warn(10.0)
    assert "STOP!" in words(picture.markers(10.1))
    assert "STOP!" not in words(picture.markers(10.0 + scene.WARNING_SHOWN))


def test_every_marker_is_in_the_fixed_frame_and_has_a_size(picture):
    for marker in picture.markers(0.0):
        assert marker.header.frame_id == "world"
        assert marker.color.a > 0.0
        assert marker.scale.x > 0.0 or marker.scale.z > 0.0


def test_text_uses_the_letters_that_rviz_has(picture):
    for scenario in ("inspection", "sorting"):
        picture.take("task/state", running(scenario))
        assert words(picture.markers(0.0)).isascii()


def test_the_hand_moves_to_the_work_in_small_steps(picture):
    def hand(now: float) -> tuple[float, float, float]:
        found = {(m.ns, m.id): m for m in picture.markers(now)}[("person", 20)].pose.position
        return (found.x, found.y, found.z)

    trail = [hand(0.1 * step) for step in range(40)]
    assert trail[-1] == trail[-2]
    assert trail[0] != trail[-1]
    for before, after in zip(trail, trail[1:], strict=False):
        assert sum((a - b) ** 2 for a, b in zip(before, after, strict=True)) <= 0.0601**2


def test_an_unseen_person_is_drawn_faint(picture):
    picture.take("human/activity", activity(HumanActivity.IDLE, detected=False))
    markers = picture.markers(0.0)
    assert "not in view" in words(markers)
    assert next(m for m in markers if (m.ns, m.id) == ("person", 0)).color.a < 0.5


def test_the_decision_tells_value_bounds_and_runner_up(picture):
    told = words(picture.markers(0.0))
    for part in ("POINT TO REMIND", "worth 3.00 points", "second best: idle", "needs help"):
        assert part in told


def test_the_truth_is_not_among_the_topics():
    assert "truth" not in scene.TOPICS


def test_dials_sum_the_type_belief():
    types = ["expert_rested_attentive_collaborative", "beginner_tired_attentive_noncollaborative"]
    assert panels.dial_probabilities(types, [0.25, 0.75]) == [0.25, 0.25, 1.0, 0.25]


def test_a_type_named_by_its_dials_counts_by_its_shares():
    types = ["0.25,0.75,0.00,1.00", "expert_rested_attentive_collaborative"]
    assert panels.dial_probabilities(types, [0.5, 0.5]) == [0.625, 0.875, 0.5, 1.0]


def test_the_policy_is_shown_with_its_reason_in_lines_that_fit(picture):
    reason = "patient: likely to earn more than others; the person is most like somebody. " * 9
    choice = PolicyChoice(policy="patient", reason=reason)
    picture.take("abps/policy", choice)
    told = words(picture.markers(0.0))
    assert "POLICY: patient" in told
    lines = panels.reason_lines(choice)
    assert lines[0].startswith("likely to earn more")
    assert lines[-1].endswith("...")
    assert len(lines) == panels.REASON_LINES
    assert all(line in told and len(line) <= panels.REASON_WIDTH for line in lines)
    choice.unlike_anyone_known = True
    assert panels.reason_lines(choice)[0] == "a person unlike anyone known"
    assert len(panels.reason_lines(choice)) == panels.REASON_LINES


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("inspection", "the person inspects each package and puts it into a tray 'inspected'"),
        (
            "type_1_colours",
            "which cube into which tray: red into 'red', green into 'green', blue into 'blue'",
        ),
        (
            "type_2_sequence",
            "one cube after the other into: 'red', 'blue', 'blue', 'green', 'red'",
        ),
        (
            "type_3_mixed",
            "which cube into which tray: 1. red into 'green', 2. red into 'blue', "
            "green into 'red', 1. blue into 'blue', 2. blue into 'red'",
        ),
        (
            "type_5_stroop",
            "one cube after the other into: red IN BLUE, green IN RED, blue IN GREEN, "
            "blue IN RED, red IN GREEN, green IN BLUE, red IN BLUE",
        ),
    ],
)
def test_the_rules_of_every_type_are_told_in_words(name, words):
    state = TaskManager(load_definition(name), 1, seed=1).state
    assert panels.rules_in_words(state) == words
