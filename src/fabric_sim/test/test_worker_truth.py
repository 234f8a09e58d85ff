# SPDX-License-Identifier: BSD-3-Clause
"""The rule that names a moment in the robot's words, row by row."""

import pytest

from fabric_sim.truth import ANTICIPATED, Counters, anticipated_state
from fabric_sim.worker_parameters import STATES, TruthParameters

P = TruthParameters(patience=2, stage_two_after=2, wants_help=0.5)
WILLING, UNWILLING = 0.9, 0.1


def word(state, action="idle", accepts=WILLING, weakest="expertise", sorting=False, **counters):
    return anticipated_state(state, action, Counters(**counters), accepts, weakest, sorting, P)


@pytest.mark.parametrize(
    ("state", "expected"),
    [
        ("success", "global_success"),
        ("failure", "global_fail"),
        ("task_assigned_to_robot", "task_assigned_to_robot"),
        ("warns_the_robot", "warning_received"),
        ("robot_receives_the_warning", "does_not_need_help"),
        ("robot_interfered", "needs_help"),
        ("recovery", "needs_help"),
    ],
)
@pytest.mark.parametrize("accepts", [WILLING, UNWILLING])
def test_some_states_say_it_all(state, expected, accepts):
    assert word(state, accepts=accepts, failed=5, tired=5, distracted=5) == expected


def test_somebody_who_walks_away_needs_help():
    assert word("tired", "walk_away", accepts=UNWILLING) == "needs_help"


@pytest.mark.parametrize(
    ("state", "counter", "first"),
    [("tired", "tired", "may_be_tired"), ("failed_to_grasp", "failed", "may_not_be_capable")],
)
def test_trouble_is_stage_one_first_and_then_a_matter_of_wanting_help(state, counter, first):
    assert word(state, **{counter: 1}) == first
    assert word(state, **{counter: 2}) == "needs_help"
    assert word(state, accepts=UNWILLING, **{counter: 2}) == "does_not_need_help"
    assert word(state, accepts=0.5, **{counter: 2}) == "needs_help"


def test_distraction_is_stage_one_first_and_then_wants_a_reminder():
    assert word("no_attention", "look_around", distracted=1) == "may_be_distracted"
    assert word("no_attention", "look_around", distracted=2) == "needs_to_be_reminded"
    assert word("no_attention", accepts=UNWILLING, distracted=2) == "needs_to_be_reminded"


def test_trying_again_counts_like_having_failed():
    assert word("evaluating", "grasp", failed=1) == "may_not_be_capable"
    assert word("evaluating", "grasp", accepts=UNWILLING, failed=2) == "does_not_need_help"
    assert word("failed_to_grasp", "grasp", accepts=WILLING, failed=3) == "needs_help"


@pytest.mark.parametrize("state", ["task_assigned", "evaluating"])
def test_at_first_the_person_has_the_task(state):
    assert word(state) == "task_assigned_to_human"
    assert word(state, evaluated=2) == "task_assigned_to_human"
    assert word(state, "grasp", evaluated=9) == "task_assigned_to_human"


@pytest.mark.parametrize(
    ("counters", "expected"),
    [
        ({"failed": 1}, "may_not_be_capable"),
        ({"failed": 1, "tired": 1, "distracted": 1}, "may_not_be_capable"),
        ({"tired": 1, "evaluated": 3}, "may_be_tired"),
        ({"tired": 1, "distracted": 1, "evaluated": 3}, "may_be_tired"),
        ({"distracted": 1, "evaluated": 3}, "may_be_distracted"),
        ({"distracted": 1, "evaluated": 2}, "task_assigned_to_human"),
    ],
)
def test_evaluating_after_trouble_tells_the_trouble(counters, expected):
    assert word("evaluating", **counters) == expected


@pytest.mark.parametrize(
    ("weakest", "expected"),
    [
        ("expertise", "may_not_be_capable"),
        ("stamina", "may_be_tired"),
        ("attention", "may_be_distracted"),
    ],
)
def test_stalling_without_a_visible_reason_is_blamed_on_the_weakest_dial(weakest, expected):
    assert word("evaluating", weakest=weakest, evaluated=3) == expected


def test_sorting_knows_people_who_are_doing_ok():
    assert word("evaluating", sorting=True) == "task_assigned_to_human"
    assert word("evaluating", sorting=True, last_was_right=True) == "human_doing_ok"
    assert word("task_assigned", sorting=True, last_was_right=True) == "human_doing_ok"
    assert word("evaluating", "grasp", sorting=True, last_was_right=True) == "human_doing_ok"
    assert word("evaluating", sorting=False, last_was_right=True) == "task_assigned_to_human"


def test_sorting_doubts_people_after_two_wrong_trays_in_a_row():
    assert word("evaluating", sorting=True, wrong_in_a_row=1) == "task_assigned_to_human"
    assert word("evaluating", sorting=True, wrong_in_a_row=2) == "may_not_be_capable"


def test_counters_of_a_subtask_are_reset_and_the_streak_is_kept():
    counters = Counters()
    counters.step("evaluating", "idle")
    counters.step("evaluating", "grasp")
    counters.step("no_attention", "look_around")
    counters.step("tired", "idle")
    counters.placed(False)
    assert (counters.evaluated, counters.distracted, counters.tired) == (1, 1, 1)
    assert (counters.failed, counters.wrong_in_a_row) == (1, 1)
    counters.next_subtask()
    assert counters == Counters(wrong_in_a_row=1)
    counters.placed(True)
    assert counters == Counters(last_was_right=True)


def test_the_rule_is_total_and_speaks_the_words_of_the_models():
    words = {
        word(state, action, accepts, weakest, sorting, evaluated=n, failed=f, tired=k, distracted=d)
        for state in STATES
        for action in ("idle", "grasp", "look_around", "walk_away", "warn")
        for accepts in (WILLING, UNWILLING)
        for weakest in ("expertise", "stamina", "attention")
        for sorting in (False, True)
        for n in (0, 3)
        for f in (0, 1, 2)
        for k in (0, 2)
        for d in (0, 2)
    }
    words.add(word("evaluating", sorting=True, last_was_right=True))
    assert words == set(ANTICIPATED)
