# SPDX-License-Identifier: BSD-3-Clause
"""What the summary of a replay counts, on a trial small enough to count by hand."""

import json

import numpy as np
import pytest

from fabric_msgs.msg import Decision, Observation
from fabric_planner.replay import Recording, from_messages
from fabric_planner.replay_report import (
    Outcome,
    describe,
    header,
    summarise,
    summary_text,
    write_plot,
)

STATES = ["doing_ok", "needs_help", "warning_received"]


def step(action: str = "idle", **fields) -> tuple:
    """An observation and the recorded robot's answer ('' for none)."""
    return Observation(detected=True, **fields), action


# subtask 1: the robot grasps at 2, is warned at 3, the person places at 4
# subtask 2: the robot grasps at 5, nobody objects, it places at 6; subtask 3 only of ours at 7
ROWS = [
    step("idle"),
    step("grasp", idle=True),
    step("cancel", warning=True),
    step("idle", subtask_success=True),
    step("grasp"),
    step("", robot_success=True),
    step("idle"),
    step("idle", warning=True),
    step("idle", subtask_failure=True, task_success=True),
]
OURS = ["idle", "planning", "cancel", "idle", "grasp", "grasp", "grasp", "cancel", "grasp"]


@pytest.fixture
def recording() -> Recording:
    observations, decisions = [], []
    constants = {"idle": 0, "planning": 1, "point": 2, "grasp": 3, "cancel": 4}
    for number, (observation, action) in enumerate(ROWS, start=1):
        observation.sequence = number
        observation.header.stamp.secs = 10 + number
        observations.append(observation)
        if action:
            answer = Decision(observation_sequence=number, action=constants[action])
            decisions.append(answer)
    return from_messages("made", observations, decisions)


@pytest.fixture
def outcomes() -> list[Outcome]:
    belief = np.array([0.2, 0.7, 0.1])
    return [
        Outcome(action, "idle", belief, 1.5, 1.25, 2.0, 0.010, 0.012, False, False, False)
        for action in OURS
    ]


def test_our_take_overs_are_the_first_grasp_of_each_subtask_and_none_after_the_end(
    recording, outcomes
) -> None:
    found = summarise(recording, outcomes)["take_overs"]
    assert [(t["subtask"], t["observation"]) for t in found] == [(2, 5), (3, 6)]
    assert found[0]["recorded_took_over_at"] == pytest.approx(4.0)
    assert found[0]["warned_recorded"] is False
    assert found[0]["subtask_ended_by"] == "robot right"
    assert found[1]["recorded_took_over_at"] is None
    assert found[1]["subtask_ended_by"] == "person wrong"


def test_recorded_take_overs_are_warned_only_before_the_next_placement(recording, outcomes) -> None:
    found = summarise(recording, outcomes)["recorded_take_overs"]
    assert [(t["subtask"], t["warned"], t["ours_took_over"]) for t in found] == [
        (1, True, False),
        (2, False, True),
    ]


def test_agreement_counts_only_what_the_recorded_robot_decided(recording, outcomes) -> None:
    agreement = summarise(recording, outcomes)["agreement"]
    assert (agreement["compared"], agreement["same"]) == (8, 4)
    assert agreement["ours_by_recorded"]["grasp"]["planning"] == 1
    assert agreement["ours_by_recorded"]["cancel"]["cancel"] == 1


def test_summary_is_json_and_says_its_figures_in_words(recording, outcomes) -> None:
    summary = summarise(recording, outcomes)
    assert json.loads(json.dumps(summary)) == summary
    assert summary["warnings"] == 2
    assert summary["latency"]["planning_ms_p50"] == pytest.approx(10.0)
    text = summary_text(summary)
    assert "4/8 (50 %)" in text
    assert "after 1 of its 2 take-overs" in text
    assert "in 0 of these 1 and in 1 of the 1 accepted ones" in text


def test_a_recording_without_decisions_has_nothing_to_agree_with(outcomes) -> None:
    recording = from_messages("lone", [Observation(sequence=1)], [])
    summary = summarise(recording, outcomes[:1])
    assert summary["recorded_take_overs"] == []
    assert "decided nothing" in summary_text(summary)


def test_a_line_names_time_symbol_belief_decision_bounds_and_the_recorded_action(
    recording, outcomes
) -> None:
    line = describe(recording.steps[1], outcomes[1], STATES)
    for part in ("1.0", "needs_help 0.70  doing_ok 0.20", "planning", "1.50", "1.25..2.00"):
        assert part in line
    assert line.endswith("grasp")
    assert describe(recording.steps[5], outcomes[5], STATES).endswith("(grasp)")
    assert "recorded robot" in header()


def test_an_outcome_is_read_from_a_decision_and_refuses_unknown_indices() -> None:
    decision = Decision(sequence=3, action=Decision.POINT, observation_index=1, belief=[1.0])
    outcome = Outcome.of(decision, ["a", "b"], 0.1)
    assert (outcome.action, outcome.symbol) == ("point", "b")
    decision.observation_index = 2
    with pytest.raises(ValueError, match="decision 3 names action 2 and observation 2"):
        Outcome.of(decision, ["a", "b"], 0.1)


def test_decisions_must_match_the_observations(recording, outcomes) -> None:
    with pytest.raises(ValueError, match="1 decisions on 9 observations"):
        summarise(recording, outcomes[:1])


def test_plot_is_a_picture(recording, outcomes, tmp_path) -> None:
    write_plot(tmp_path / "p.png", recording, outcomes, STATES)
    assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")
