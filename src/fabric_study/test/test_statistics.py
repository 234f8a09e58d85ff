# SPDX-License-Identifier: BSD-3-Clause
"""The statistics on small cases worked out by hand, and on data that have no answer."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fabric_study.statistics.as_published import one_way_anova, published_pairs, tukey_hsd
from fabric_study.statistics.compare import compare
from fabric_study.statistics.descriptive import describe, moving_average
from fabric_study.statistics.holm import holm
from fabric_study.statistics.layout import person_means, rows_of, split_complete
from fabric_study.statistics.mixed import learning, mixed_conditions
from fabric_study.statistics.outcome import (
    Effect,
    NoResult,
    Result,
    effect_text,
    number_text,
    p_text,
    statistic_text,
)
from fabric_study.statistics.pairs import (
    noncentral_interval,
    paired_t,
    rank_biserial,
    signed_rank,
    wilcoxon,
)
from fabric_study.statistics.power import PowerCurve, power_curve
from fabric_study.statistics.reliability import cronbach_alpha
from fabric_study.statistics.repeated import friedman, mauchly, repeated_anova


def frame(*rows) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=["person", "condition", "number", "value"])


def categorical(table: pd.DataFrame) -> pd.DataFrame:
    return table.assign(condition=table["condition"].astype("category"))


def test_description_of_five_values():
    told = describe([1.0, 2.0, 3.0, 4.0, 10.0, math.nan])
    assert (told.n, told.mean, told.median, told.minimum, told.maximum) == (5, 4.0, 3.0, 1.0, 10.0)
    assert (told.quartile_1, told.quartile_3) == (2.0, 4.0)
    assert told.sd == pytest.approx(math.sqrt(12.5))
    assert told.half_width == pytest.approx(2.776445 * math.sqrt(12.5 / 5), rel=1e-6)


def test_one_value_has_a_mean_and_no_spread():
    told = describe([7.0])
    assert (told.n, told.mean, told.sd, told.half_width) == (1, 7.0, None, None)


def test_nothing_has_no_mean():
    told = describe([math.nan])
    assert (told.n, told.mean, told.median) == (0, None, None)


def test_a_window_of_nothing_is_refused():
    with pytest.raises(ValueError, match="window is 0"):
        moving_average([1.0], 0)


def test_paired_t_of_four_differences():
    """Mean 2, sd sqrt(2/3): t = 2 / (sqrt(2/3) / 2) = 4.899, dz = 2.449."""
    told = paired_t([1.0, 2.0, 2.0, 3.0])
    assert told.value == pytest.approx(4.898979)
    assert told.df == (3,)
    difference, dz = told.effects
    assert (difference.value, dz.value) == (2.0, pytest.approx(2.449490))
    assert difference.low == pytest.approx(2.0 - 3.182446 * math.sqrt(2.0 / 3.0) / 2.0, rel=1e-6)


def test_interval_of_dz_inverts_the_noncentral_t():
    """Each end makes what was seen as unlikely as the tail allows."""
    from scipy import stats

    low, high = noncentral_interval(2.7, 9)
    assert stats.nct.sf(2.7, 9, low) == pytest.approx(0.025)
    assert stats.nct.cdf(2.7, 9, high) == pytest.approx(0.025)
    assert noncentral_interval(-2.7, 9) == (pytest.approx(-high), pytest.approx(-low))


def test_wilcoxon_of_five_in_one_direction():
    told = wilcoxon([1.0, 2.0, 3.0, 4.0, 5.0])
    assert (told.value, told.p) == (15.0, 2.0 / 32.0)
    assert told.effects[1].value == 1.0


def test_zeros_take_ranks_but_no_side():
    """|d| = 0, 1, 1, 2: ranks 1, 2.5, 2.5, 4; up 6.5 of 9; 2 of 8 sign patterns reach it, twice."""
    told = wilcoxon([0.0, 1.0, -1.0, 2.0])
    assert told.value == 6.5
    signs = itertools.product((0, 1), repeat=3)
    sums = [sum(np.array(sign) * (2.5, 2.5, 4.0)) for sign in signs]
    assert told.p == 2.0 * sum(value >= 6.5 for value in sums) / 8.0
    assert told.effects[1].value == pytest.approx(4.0 / 10.0)


@given(st.lists(st.integers(-4, 4), min_size=2, max_size=9).filter(any))
@settings(deadline=None, max_examples=50)
def test_exact_wilcoxon_is_the_count_of_all_signs(differences):
    ranks = pd.Series(np.abs(differences)).rank().to_numpy()[np.array(differences) != 0]
    up = sum(pd.Series(np.abs(differences)).rank()[np.array(differences) > 0])
    sums = [sum(np.array(s) * ranks) for s in itertools.product((0, 1), repeat=len(ranks))]
    tails = np.mean(np.array(sums) >= up), np.mean(np.array(sums) <= up)
    assert signed_rank(np.array(differences, float))[1] == pytest.approx(min(1.0, 2.0 * min(tails)))


def test_means_that_are_equal_on_paper_tie():
    thirds = np.array([0.1 + 0.2 - 0.3, 1.0, -1.0, 2.0])
    assert wilcoxon(thirds).value == wilcoxon([0.0, 1.0, -1.0, 2.0]).value


def test_rank_biserial_turns_with_the_sign():
    assert rank_biserial(np.array([1.0, -2.0, 3.0])) == -rank_biserial(np.array([-1.0, 2.0, -3.0]))


def test_repeated_measures_by_hand():
    """Sums of squares of three people in three conditions, one by one."""
    table = np.array([[1.0, 2.0, 4.0], [2.0, 3.0, 4.0], [1.0, 3.0, 5.0]])
    grand, people, conditions = table.mean(), table.mean(axis=1), table.mean(axis=0)
    ss_condition = 3.0 * sum((conditions - grand) ** 2)
    ss_person = 3.0 * sum((people - grand) ** 2)
    ss_rest = ((table - grand) ** 2).sum() - ss_condition - ss_person
    told = repeated_anova(table)
    assert told.value == pytest.approx((ss_condition / 2.0) / (ss_rest / 4.0))
    effects = {effect.name: effect.value for effect in told.effects}
    assert effects["ges"] == pytest.approx(ss_condition / (ss_condition + ss_person + ss_rest))
    assert 0.5 <= effects["epsilon"] <= 1.0
    assert told.df == (
        pytest.approx(2.0 * effects["epsilon"]),
        pytest.approx(4.0 * effects["epsilon"]),
    )


def test_epsilon_is_half_when_two_of_three_conditions_never_differ():
    random = np.random.default_rng(104)
    level, other = random.normal(size=(2, 10))
    told = repeated_anova(np.stack([level, level, other], axis=1))
    assert told.effects[1].value == pytest.approx(0.5)


def test_friedman_of_full_agreement():
    told = friedman([[1.0, 2.0, 3.0]] * 4)
    assert (told.value, told.effects[0].value) == (pytest.approx(8.0), pytest.approx(1.0))


def test_holm_by_hand():
    assert holm([0.01, 0.04, 0.03]) == [pytest.approx(0.03), pytest.approx(0.06), 0.06]
    assert holm([0.5, 0.9]) == [1.0, 1.0]
    assert holm([]) == []


@pytest.mark.parametrize("bad", [math.nan, -0.1, 1.5])
def test_holm_refuses_what_is_no_chance(bad):
    with pytest.raises(ValueError, match="p-value 1 is"):
        holm([0.1, bad])


def test_one_way_anova_by_hand():
    """Means 2 and 5, SS between 13.5, within 4: F = 13.5 / (4 / 4)."""
    told = one_way_anova([np.array([1.0, 2.0, 3.0]), np.array([4.0, 5.0, 6.0])])
    assert (told.value, told.df) == (13.5, (1, 4))
    assert told.effects[0].value == pytest.approx(13.5 / 17.5)
    assert told.unit == "rows"


def test_tukey_of_two_samples_is_the_one_way_anova():
    samples = [np.array([1.0, 2.0, 3.0]), np.array([4.0, 5.0, 7.0])]
    assert tukey_hsd(samples, "ab")[0].outcome.p == pytest.approx(one_way_anova(samples).p)


def test_published_tests_take_rows_of_equal_counts_and_means_of_others():
    rows = [
        (f"P{person}", condition, 1, float(person * 3 + task + (condition == "c") * person % 2))
        for person in range(14)
        for condition, tasks in (("a", 1), ("b", 3), ("c", 3))
        for task in range(tasks)
    ]
    table = rows_of(frame(*rows), "value", "abc")
    df = {(pair.first, pair.second): pair.outcome.df for pair in published_pairs(table, "abc")}
    assert df == {("a", "b"): (1, 26), ("a", "c"): (1, 26), ("b", "c"): (1, 82)}


def test_cronbach_by_hand():
    """Items with variances 1 and 1, sum with variance 4: alpha = 2 (1 - 2/4) = 1."""
    assert cronbach_alpha([[1, 1], [2, 2], [3, 3]]) == pytest.approx(1.0)
    assert isinstance(cronbach_alpha([[1, 2]]), NoResult)
    assert "equal" in cronbach_alpha([[1, 2], [2, 1]]).reason


@pytest.mark.parametrize(
    ("outcome", "reason"),
    [
        (paired_t([]), "there is none"),
        (paired_t([1.0]), "there is one"),
        (paired_t([2.0, 2.0, 2.0]), "all 3 differences are 2, without any spread"),
        (paired_t([0.1 + 0.2, 0.3]), "without any spread"),
        (wilcoxon([1.0]), "there is one"),
        (wilcoxon([0.0, 0.0]), "all 2 differences are zero"),
        (repeated_anova([[1.0, 2.0, 3.0]]), "there is one"),
        (repeated_anova([[1.0, 2.0, 3.0], [2.0, 3.0, 4.0]]), "same amount"),
        (repeated_anova(np.ones((4, 3))), "same amount"),
        (mauchly([[1.0, 2.0, 4.0]] * 3), "more people than"),
        (mauchly([[1.0, 2.0, 4.0]] * 5), "same amount"),
        (friedman(np.ones((4, 3))), "same in all conditions"),
        (one_way_anova([np.ones(3), np.ones(3)]), "do not vary"),
        (one_way_anova([np.ones(1), np.array([])]), "needs values"),
    ],
)
def test_data_without_an_answer_give_a_sentence(outcome, reason):
    assert isinstance(outcome, NoResult)
    assert reason in statistic_text(outcome)


def test_models_without_an_answer_give_a_sentence():
    one = categorical(frame(("A", "a", 1, 1.0), ("A", "b", 2, 2.0)))
    assert "two people" in mixed_conditions(one).reason
    equal = categorical(frame(*((p, c, 1, 3.0) for p in "ABC" for c in "ab")))
    assert "all 6 values are 3" in mixed_conditions(equal).reason
    assert "three tasks" in learning(equal).reason
    order = [(p, c, n, n + ord(p) % 3) for p in "ABCD" for n, c in enumerate("abc")]
    assert "one order" in learning(categorical(frame(*order))).reason


@pytest.mark.parametrize("bad", [[math.nan, 1.0], [math.inf, 1.0], [[1.0], [2.0]]])
def test_differences_that_are_none_are_refused(bad):
    with pytest.raises(ValueError, match="must be finite"):
        paired_t(bad)


def test_results_with_nan_cannot_be_made():
    with pytest.raises(ValueError, match="not finite"):
        Result("t", 3, "t", math.nan, (2,), 0.5)


def test_people_who_miss_a_condition_are_named_and_left_to_the_mixed_model():
    random = np.random.default_rng(105)
    rows = [
        (f"P{p}", c, n, p + (c == "b") + random.normal())
        for p in range(8)
        for n, c in enumerate("abab")
        if (p, c) != (3, "b")
    ]
    told = compare(frame(*rows), "value", ["a", "b"])
    assert told.incomplete == ("P3",)
    assert told.pairs[0].outcome.n == 7
    assert told.mixed.n == 8
    assert told.descriptions["a"].n == 8


def test_one_person_gives_sentences_only():
    told = compare(frame(("A", "a", 1, 1.0), ("A", "b", 2, 2.0)), "value", ["a", "b"])
    assert isinstance(told.pairs[0].outcome, NoResult)
    assert told.pairs[0].p_holm is None
    assert isinstance(told.mixed, NoResult)


def test_a_condition_that_nobody_met_gives_sentences_only():
    rows = [("A", "a", 1, 1.0), ("B", "a", 1, 2.0), ("A", "b", 2, 2.0), ("B", "b", 2, 4.0)]
    told = compare(frame(*rows), "value", ["a", "b", "c"])
    assert told.incomplete == ("A", "B")
    assert isinstance(told.omnibus, NoResult)
    assert told.descriptions["c"].n == 0


def test_tables_are_refused_with_the_place_of_the_fault():
    table = frame(("A", "a", 1, math.inf))
    with pytest.raises(ValueError, match="value is infinite in row 0"):
        rows_of(table, "value", ["a"])
    with pytest.raises(ValueError, match="no column score"):
        rows_of(table, "score", ["a"])
    with pytest.raises(ValueError, match="not a number"):
        rows_of(frame(("A", "a", 1, "many")), "value", ["a"])


def test_means_of_people_come_in_the_order_of_the_conditions():
    rows = rows_of(frame(("B", "y", 1, 1.0), ("A", "x", 1, 2.0), ("A", "x", 2, 4.0)), "value", "xy")
    means = person_means(rows, ["x", "y"])
    assert list(means.columns) == ["x", "y"]
    assert means.loc["A", "x"] == 3.0
    assert split_complete(means)[1] == ("A", "B")


def test_words_for_numbers():
    assert (p_text(0.0004), p_text(0.038), p_text(1.0)) == ("p < .001", "p = .038", "p = 1.000")
    assert (number_text(-0.001), number_text(-1.005, 1)) == ("0.00", "-1.0")
    assert effect_text(Effect("dz", 0.5, 0.1, 0.9)) == "dz = 0.50 [0.10, 0.90]"
    told = Result("t", 14, "F", 3.2, (1.48, 19.2), 0.05)
    assert statistic_text(told) == "F(1.48, 19.2) = 3.20, p = .050"


def test_power_rises_with_people_and_finds_what_is_needed():
    told = power_curve(np.random.default_rng(106).normal(1.0, 1.0, 14), seed=1)
    assert isinstance(told, PowerCurve)
    assert told.power[0] < told.power[3] < told.power[-1] <= 1.0
    assert all(low <= high for low, high in zip(told.low, told.high, strict=True))
    reached = dict(zip(told.sizes, told.power, strict=True))
    assert reached[told.needed] >= 0.8


def test_power_agrees_with_the_noncentral_t():
    """200 people drawn from a normal distribution with d = 0.8; 16 people have power .85."""
    from scipy import stats

    sample = np.random.default_rng(107).normal(0.0, 1.0, 2000)
    sample = 0.8 + (sample - sample.mean()) / sample.std(ddof=1)
    critical = stats.t.ppf(0.975, 15)
    expected = stats.nct.sf(critical, 15, 0.8 * 4.0)
    assert power_curve(sample, seed=2, sizes=(16,)).power[0] == pytest.approx(expected, abs=0.03)


def test_power_of_equal_differences_is_a_sentence():
    assert isinstance(power_curve([1.0, 1.0, 1.0], seed=1), NoResult)
