# SPDX-License-Identifier: BSD-3-Clause
"""The rule that names a moment in the robot's words, row by row."""

import pytest

from fabric_sim.truth import ANTICIPATED, Counters, anticipated_state
from fabric_sim.worker_parameters import STATES, TruthParameters

P = TruthParameters(stage_one=1, reminders=5, failures=2, wants_help=0.5)
WILLING, UNWILLING = 0.9, 0.1


def word(state, action="idle", accepts=WILLING, sorting=False, **counters):
    return anticipated_state(state, action, Counters(**counters), lambda: accepts, sorting, P)


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
    assert word("no_attention", accepts=WILLING, distracted=2) == "needs_to_be_reminded"


def test_a_long_distraction_is_a_matter_of_wanting_help():
    assert word("no_attention", accepts=UNWILLING, distracted=6) == "does_not_need_help"
    assert word("no_attention", accepts=WILLING, distracted=6) == "needs_help"


def test_whoever_does_not_try_again_after_a_failure_wants_help_or_not():
    assert word("failed_to_grasp", failed=1, gave_up=1) == "may_not_be_capable"
    assert word("failed_to_grasp", failed=1, gave_up=2) == "needs_help"
    assert word("evaluating", accepts=UNWILLING, failed=1, gave_up=2) == "does_not_need_help"


def test_trying_again_is_a_matter_of_wanting_help():
    assert word("evaluating", "grasp", accepts=UNWILLING, failed=1) == "does_not_need_help"
    assert word("evaluating", "grasp", accepts=UNWILLING, failed=2) == "does_not_need_help"
    assert word("failed_to_grasp", "grasp", accepts=WILLING, failed=3) == "needs_help"


@pytest.mark.parametrize("state", ["task_assigned", "evaluating"])
def test_at_first_the_person_has_the_task(state):
    assert word(state) == "task_assigned_to_human"
    assert word(state, "grasp") == "task_assigned_to_human"


@pytest.mark.parametrize("state", ["task_assigned", "evaluating"])
def test_eyes_off_the_work_are_a_distraction_in_every_state(state):
    assert word(state, "look_around", distracted=1) == "may_be_distracted"
    assert word(state, "look_around", distracted=2) == "needs_to_be_reminded"


def test_failure_tells_more_than_tiredness_and_both_more_than_a_look():
    assert word("tired", failed=1, tired=3) == "may_not_be_capable"
    assert word("tired", "look_around", tired=1, distracted=3) == "may_be_tired"


def test_a_tired_or_distracted_person_who_reaches_is_at_work():
    assert word("tired", "grasp", tired=3) == "task_assigned_to_human"
    assert word("no_attention", "grasp", distracted=3) == "task_assigned_to_human"


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
    counters.step("evaluating", "look_around")
    counters.step("no_attention", "idle")
    counters.step("tired", "idle")
    counters.placed(False)
    assert (counters.distracted, counters.tired) == (2, 1)
    assert (counters.failed, counters.wrong_in_a_row) == (1, 1)
    counters.begin_again()
    assert counters == Counters(wrong_in_a_row=1)
    counters.placed(True)
    assert counters == Counters(last_was_right=True)


def test_reaching_ends_distraction_and_tiredness_but_not_failure():
    counters = Counters(failed=1, gave_up=2, distracted=2, tired=2)
    counters.step("tired", "grasp")
    assert counters == Counters(failed=1)


def test_the_rule_is_total_and_speaks_the_words_of_the_models():
    words = {
        word(state, action, accepts, sorting, failed=f, tired=k, distracted=d)
        for state in STATES
        for action in ("idle", "grasp", "look_around", "walk_away", "warn")
        for accepts in (WILLING, UNWILLING)
        for sorting in (False, True)
        for f in (0, 1, 2)
        for k in (1, 2)
        for d in (0, 2, 6)
    }
    words.add(word("evaluating", sorting=True, last_was_right=True))
    assert words == set(ANTICIPATED)


def test_the_acceptance_is_asked_for_only_where_it_decides():
    def accepts():
        raise AssertionError("a person at work is at work, whatever help would be welcome")

    word = anticipated_state("evaluating", "idle", Counters(), accepts, False, P)
    assert word == "task_assigned_to_human"
