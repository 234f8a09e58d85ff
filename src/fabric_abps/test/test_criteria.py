# SPDX-License-Identifier: BSD-3-Clause
"""Eq. 5.2-5.4 against numbers worked by hand and numerical integration; the other criteria."""

import numpy as np
import pytest
from scipy import stats
from scipy.integrate import quad

from fabric_abps import PerformanceModel, make_criterion
from fabric_abps.criterion import Criterion

BETA = np.array([0.75, 0.25])
# two types x two policies, unit variance
MODEL = PerformanceModel([[50, 50]] * 2, [[2.0, 1.0], [0.0, 4.0]], [[1.0, 4.0], [1.0, 1.0]],
                         predictive="normal")  # fmt: skip
RNG = np.random.default_rng(0)


def test_expected_improvement_follows_the_hand_worked_table_of_equation_5_4() -> None:
    # belief-weighted means: .75*2 + .25*0 = 1.5 and .75*1 + .25*4 = 1.75 -> U_beta = 1.75
    # policy 0: .75 (1 - Phi(-.25)) + .25 (1 - Phi(1.75)) = .75*.598706 + .25*.040059 = .459044
    # policy 1: .75 (1 - Phi(.375)) + .25 (1 - Phi(-2.25)) = .75*.353830 + .25*.987776 = .512317
    score = make_criterion("expected_improvement", ["a", "b"]).score(BETA, MODEL, RNG)
    assert score == pytest.approx([0.459044, 0.512317], abs=2e-6)


def test_expected_improvement_equals_the_integral_of_the_density_above_u_beta() -> None:
    model = PerformanceModel.fit(
        [[[1.0, 2.5, 3.0], [0.0, 4.0]], [[-1.0, 0.0, 1.0, 5.0], [2.0, 2.1, 2.2]]]
    )
    U_beta = model.expected(BETA).max()
    score = make_criterion("expected_improvement", ["a", "b"]).score(BETA, model, RNG)
    scale = model.deviation * np.sqrt(1 + 1 / model.count)
    for policy in range(2):

        def density(u: float, policy: int = policy) -> float:
            p = stats.t.pdf(u, model.count - 1, model.mean, scale)
            return float(BETA @ p[:, policy])

        assert score[policy] == pytest.approx(quad(density, U_beta, np.inf)[0], abs=1e-6)


def test_expected_improvement_of_a_certain_belief_is_half_for_the_best_policy() -> None:
    score = make_criterion("expected_improvement", ["a", "b"]).score(
        np.array([1.0, 0.0]), MODEL, RNG
    )
    assert score[0] == pytest.approx(0.5)
    assert score[1] < 0.5


def test_probability_of_improvement_follows_the_hand_worked_table_of_equation_5_2() -> None:
    # U+ = .75 * 2 + .25 * 4 = 2.5; densities of N(m, s) there:
    # policy 0: .75 phi(.5) + .25 phi(2.5) = .75*.352065 + .25*.017528 = .268431
    # policy 1: .75 phi(.75)/2 + .25 phi(-1.5) = .75*.150569 + .25*.129518 = .145306
    score = make_criterion("probability_of_improvement", ["a", "b"]).score(BETA, MODEL, RNG)
    assert score == pytest.approx([0.268431, 0.145306], abs=2e-6)


@pytest.mark.parametrize("predictive", ["normal", "student"])
def test_the_density_integrates_to_the_distribution_function(predictive) -> None:
    model = PerformanceModel([[3, 9]], [[1.0, -2.0]], [[2.0, 0.5]], predictive=predictive)
    for policy in range(2):
        area = quad(lambda u, policy=policy: model.density(u)[0, policy], -np.inf, 1.5)[0]
        assert area == pytest.approx(model.cdf(1.5)[0, policy], abs=1e-7)


@pytest.mark.parametrize("name", ["expected_improvement", "probability_of_improvement", "greedy"])
def test_scores_do_not_depend_on_the_order_of_the_types(name) -> None:
    turned = PerformanceModel(MODEL.count[::-1], MODEL.mean[::-1], MODEL.variance[::-1],
                              predictive="normal")  # fmt: skip
    score = make_criterion(name, ["a", "b"]).score(BETA, MODEL, RNG)
    assert score == pytest.approx(make_criterion(name, ["a", "b"]).score(BETA[::-1], turned, RNG))


def test_the_oracle_takes_the_best_of_what_it_was_told_and_nothing_before() -> None:
    oracle = make_criterion("oracle", ["a", "b"])
    with pytest.raises(ValueError, match="has not been told"):
        oracle.score(BETA, MODEL, RNG)
    oracle.tell([3.0, 1.0])
    score = oracle.score(BETA, MODEL, RNG)
    assert oracle.pick(score, MODEL.expected(BETA), RNG) == 0
    oracle.tell([1.0, 2.0, 3.0])
    with pytest.raises(ValueError, match="3 utilities, there are 2"):
        oracle.score(BETA, MODEL, RNG)
    with pytest.raises(ValueError, match="finite"):
        oracle.tell([np.nan, 1.0])
    with pytest.raises(ValueError, match="greedy must not know"):
        make_criterion("greedy", ["a", "b"]).tell([1.0, 2.0])


def test_of_equal_scores_the_larger_expected_reward_wins_then_the_first() -> None:
    criterion = make_criterion("greedy", ["a", "b", "c"])
    assert criterion.pick(np.array([1.0, 1.0, 0.5]), np.array([2.0, 3.0, 9.0]), RNG) == 1
    assert criterion.pick(np.array([1.0, 1.0, 0.5]), np.array([3.0, 3.0, 9.0]), RNG) == 0


def test_greedy_scores_by_the_belief_weighted_mean() -> None:
    score = make_criterion("greedy", ["a", "b"]).score(BETA, MODEL, RNG)
    assert score == pytest.approx([1.5, 1.75])


def test_thompson_chooses_each_policy_as_often_as_its_type_is_believed() -> None:
    criterion = make_criterion("thompson", ["a", "b"])
    rng = np.random.default_rng(5)
    chosen = [int(np.argmax(criterion.score(BETA, MODEL, rng))) for _ in range(2000)]
    assert np.mean(chosen) == pytest.approx(0.25, abs=0.04)


def test_random_is_fair_and_follows_its_generator() -> None:
    criterion = make_criterion("random", ["a", "b"])
    rng = np.random.default_rng(5)
    chosen = [int(np.argmax(criterion.score(BETA, MODEL, rng))) for _ in range(2000)]
    assert np.mean(chosen) == pytest.approx(0.5, abs=0.05)
    one = criterion.score(BETA, MODEL, np.random.default_rng(3))
    assert (one == criterion.score(BETA, MODEL, np.random.default_rng(3))).all()


def test_fixed_always_scores_its_policy_first() -> None:
    assert make_criterion("fixed", ["a", "b"], "b").score(BETA, MODEL, RNG).argmax() == 1


def test_unknown_criteria_and_policies_are_refused_by_name() -> None:
    with pytest.raises(ValueError, match="'magic' is none of expected_improvement"):
        make_criterion("magic", ["a"])
    with pytest.raises(ValueError, match="'c' is none of a, b"):
        make_criterion("fixed", ["a", "b"], "c")


def test_a_criterion_that_does_not_score_cannot_be_made() -> None:
    class Silent(Criterion):
        name = "silent"

    with pytest.raises(TypeError, match="abstract methods? score, words"):
        Silent()
