# SPDX-License-Identifier: BSD-3-Clause
"""Paired comparisons against scipy, hand-worked cases and simulation."""

import math

import numpy as np
import pytest
from scipy import stats

from fabric_sim.experiments.paired import (
    compare,
    effect_size,
    holm,
    mean_of,
    noncentral_t_cdf,
    share_of_way,
)

# Student's sleep data: extra hours of sleep under two drugs, ten patients
DRUG_1 = [0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0]
DRUG_2 = [1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4]


def test_a_comparison_gives_the_known_values_of_students_sleep_data():
    c = compare(DRUG_2, DRUG_1)
    assert c.t == pytest.approx(4.0621, abs=1e-4)
    assert c.p_t == pytest.approx(0.002833, abs=1e-6)
    assert c.difference.value == pytest.approx(1.58)
    assert (c.difference.low, c.difference.high) == pytest.approx((0.7001, 2.4599), abs=1e-4)
    assert c.gain == pytest.approx(1.58 / 0.75)
    assert c.effect.value == pytest.approx(4.0621 / math.sqrt(10), abs=1e-4)


def test_a_comparison_agrees_with_scipy():
    rng = np.random.default_rng(101)
    a, b = rng.normal(0.4, 1.0, 25), rng.normal(0.0, 1.0, 25)
    c = compare(a, b)
    assert c.p_t == pytest.approx(stats.ttest_rel(a, b).pvalue)
    assert c.p_wilcoxon == pytest.approx(stats.wilcoxon(a, b).pvalue)
    assert c.p_holm == max(c.p_t, c.p_wilcoxon)


def test_the_interval_of_an_effect_covers_the_true_one_in_95_of_100_studies():
    rng = np.random.default_rng(102)
    true, n, runs = 0.8, 20, 300
    covered = 0
    for _ in range(runs):
        differences = rng.normal(true, 1.0, n)
        effect = effect_size(float(stats.ttest_1samp(differences, 0.0).statistic), n)
        covered += effect.low <= true <= effect.high
    assert covered / runs == pytest.approx(0.95, abs=0.04)


@pytest.mark.parametrize("degrees", [2, 9, 29])
@pytest.mark.parametrize("noncentrality", [-1.0, 0.0, 2.5])
def test_the_noncentral_t_agrees_with_scipy(degrees, noncentrality):
    for t in (-2.0, 0.3, 1.0, 4.0):
        expected = stats.nct.cdf(t, degrees, noncentrality)
        assert noncentral_t_cdf(t, degrees, noncentrality) == pytest.approx(expected, abs=1e-4)


def test_a_huge_effect_has_an_interval():
    effect = effect_size(400.0, 20)
    assert effect.low < 400.0 / math.sqrt(20) < effect.high


def test_equal_results_differ_by_nothing():
    c = compare([1.0, 2.0, 3.0], [1.0, 2.0, 3.0])
    assert (c.t, c.p_t, c.p_wilcoxon) == (0.0, 1.0, 1.0)
    assert math.isnan(c.effect.value)


def test_holm_corrects_as_worked_by_hand():
    c = compare(DRUG_2, DRUG_1)
    family = {name: _with_p(c, p) for name, p in (("a", 0.01), ("b", 0.04), ("c", 0.03))}
    corrected = {name: c.p_holm for name, c in holm(family).items()}
    assert list(corrected) == ["a", "b", "c"]
    assert corrected == pytest.approx({"a": 0.03, "b": 0.06, "c": 0.06})


def _with_p(comparison, p):
    return type(comparison)(**{**vars(comparison), "p_holm": p})


def test_halfway_is_half_and_its_interval_contains_it():
    rng = np.random.default_rng(103)
    start, end = rng.normal(0.0, 0.1, 20), rng.normal(1.0, 0.1, 20)
    way = share_of_way((start + end) / 2.0, start, end, seed=1)
    assert way.value == pytest.approx(0.5)
    assert way.low <= 0.5 <= way.high
    assert way == share_of_way((start + end) / 2.0, start, end, seed=1)


def test_there_is_no_way_between_two_that_cannot_be_told_apart():
    rng = np.random.default_rng(104)
    a, b = rng.normal(0.0, 1.0, 20), rng.normal(0.0, 1.0, 20)
    assert math.isnan(share_of_way(a, a, b, seed=1).value)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_what_is_not_finite_is_refused(bad):
    with pytest.raises(ValueError, match="finite"):
        mean_of([1.0, bad])
    with pytest.raises(ValueError, match="finite"):
        compare([1.0, bad, 2.0], [0.0, 1.0, 2.0])


def test_unequal_lengths_are_refused():
    with pytest.raises(ValueError, match="equal lengths"):
        compare([1.0, 2.0], [1.0, 2.0, 3.0])
