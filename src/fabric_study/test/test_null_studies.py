# SPDX-License-Identifier: BSD-3-Clause
"""Where conditions make no difference, the default tests say so in 19 studies of 20."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from fabric_study.statistics.null_studies import (
    DESIGNS,
    STUDIES,
    default_ordinal_p,
    default_p,
    positive_rate,
    rows_p,
    simulate,
)
from fabric_study.statistics.pairs import paired_t

PEOPLE_DIFFER = list(DESIGNS.values())[1:]


def rate(test, design, tasks, likert=False):
    return positive_rate(test(simulate(replace(design, tasks=tasks), STUDIES, 101, likert)))


@pytest.mark.parametrize("tasks", [(3, 3), (1, 3, 3)])
@pytest.mark.parametrize("design", PEOPLE_DIFFER)
def test_default_finds_nothing_in_four_to_six_studies_of_a_hundred_less(design, tasks):
    assert 0.04 <= rate(default_p, design, tasks) <= 0.06


@pytest.mark.parametrize("tasks", [(3, 3), (1, 3, 3)])
@pytest.mark.parametrize("design", PEOPLE_DIFFER)
def test_default_for_likert_items_keeps_the_rate_too(design, tasks):
    assert 0.035 <= rate(default_ordinal_p, design, tasks, likert=True) <= 0.06


def test_rows_as_independent_are_wrong_in_both_directions():
    level_only, reactions_too = PEOPLE_DIFFER
    assert rate(rows_p, level_only, (3, 3)) < 0.01
    assert rate(rows_p, reactions_too, (3, 3)) > 0.08


def test_many_studies_at_once_are_tested_as_one_is():
    outcomes = simulate(PEOPLE_DIFFER[0], 5, 101)
    p_values = default_p(outcomes)
    for study in range(5):
        first, second = (condition[study].mean(axis=-1) for condition in outcomes)
        assert p_values[study] == pytest.approx(paired_t(first - second).p)
        rows = [condition[study].ravel() for condition in outcomes]
        assert rows_p(outcomes)[study] == pytest.approx(stats.f_oneway(*rows).pvalue)


def test_a_study_without_a_p_value_finds_nothing():
    assert positive_rate(np.array([np.nan, 0.01])) == 0.5
