# SPDX-License-Identifier: BSD-3-Clause
import math

import pytest
from scipy import stats

from fabric_study.comparison import comparison_lines, effect_size, paired_differences


def row(policy, task, reward):
    return {
        "policy": policy,
        "task": task,
        "discounted_reward": reward,
        "warnings": 0,
        "success": 1,
        "duration_s": 20.0,
    }


ROWS = [row("a", 1, 5.0), row("a", 2, 3.0), row("a", 1, 4.0), row("b", 1, 4.0), row("b", 2, None)]
ROWS += [row("b", 1, 1.0)]
SEEDS = [1, 1, 2, 1, 1, 2]


def test_rows_pair_by_seed_and_task_and_undefined_ones_are_left_out():
    assert paired_differences(ROWS, SEEDS, "a", "b", "discounted_reward") == [1.0, 3.0]


def test_the_effect_size_is_the_t_statistic_over_the_root_of_n():
    first, second = [5.0, 4.0, 6.5, 5.2], [4.0, 4.4, 5.0, 4.1]
    differences = [a - b for a, b in zip(first, second, strict=True)]
    t = stats.ttest_rel(first, second).statistic
    assert effect_size(differences) == pytest.approx(t / math.sqrt(len(first)))


def test_equal_differences_have_no_effect_size():
    assert effect_size([1.0, 1.0]) is None
    assert effect_size([1.0]) is None


def test_the_first_policy_is_compared_with_every_other_one():
    lines = comparison_lines(ROWS, SEEDS)
    assert lines[0] == "a minus b, pairs of equal seed and task:"
    assert lines[1].split() == ["reward", "+2.000", "±", "12.706,", "dz", "+1.41", "(n", "2)"]
