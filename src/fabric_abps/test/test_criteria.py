# SPDX-License-Identifier: BSD-3-Clause
"""Eq. 5.4 against numbers worked by hand and numerical integration; the other criteria."""

import numpy as np
import pytest
from scipy import stats
from scipy.integrate import quad

from fabric_abps import PerformanceModel, make_criterion

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
