# SPDX-License-Identifier: BSD-3-Clause
"""EXP4: its update by hand, and that it learns whom to trust from rewards alone."""

import numpy as np
import pytest

from fabric_abps import PerformanceModel, make_criterion
from fabric_abps.bandit import EXPLORATION, RATE, SHARE

POLICIES = ["a", "b", "c", "d"]
MEAN = np.array([[5.0, 1.0, 1.0, 2.0], [1.0, 5.0, 1.0, 2.0], [1.0, 1.0, 5.0, 2.0]])
MODEL = PerformanceModel(np.full((3, 4), 50), MEAN, np.ones((3, 4)), predictive="normal")
IGNORANT = np.full(3, 1 / 3)


def test_the_first_draw_weighs_all_advisers_alike() -> None:
    # advisers: the types say a, b, c; the belief says a (first of equals); one says all evenly
    p = make_criterion("exp4", POLICIES).score(IGNORANT, MODEL, np.random.default_rng(0))
    advised = np.array([1 + 1 + 0.25, 1 + 0.25, 1 + 0.25, 0.25]) / 5
    assert p == pytest.approx((1 - EXPLORATION) * advised + EXPLORATION / 4)


def test_trust_follows_the_importance_weighted_loss_worked_by_hand() -> None:
    criterion = make_criterion("exp4", POLICIES)
    p = criterion.score(IGNORANT, MODEL, np.random.default_rng(0))
    criterion.learn(1, 1.0)  # policy b; rewards range from 1 - 2 to 5 + 2: loss 1 - 2/8
    weight = np.exp(-RATE * np.array([0.0, 1.0, 0.0, 0.0, 0.25]) * 0.75 / p[1])
    trust = (1 - SHARE) * weight / weight.sum() + SHARE / 5
    assert criterion.memory == pytest.approx(trust.tolist())


def share_of_best(criterion, person: int, tasks: int, rng: np.random.Generator) -> float:
    """How often in these tasks the policy is taken that suits the person best; teaches it."""
    right = 0
    for _ in range(tasks):
        score = criterion.score(IGNORANT, MODEL, rng)
        policy = criterion.pick(score, MODEL.expected(IGNORANT), rng)
        right += policy == MEAN[person].argmax()
        criterion.learn(policy, rng.normal(MEAN[person, policy], 1.0))
    return right / tasks


def test_it_learns_from_rewards_whose_advice_is_good_and_learns_anew_after_a_change() -> None:
    first, settled, changed = [], [], []
    for seed in range(10):
        criterion, rng = make_criterion("exp4", POLICIES), np.random.default_rng(seed)
        first.append(share_of_best(criterion, 2, 30, rng))
        share_of_best(criterion, 2, 120, rng)
        settled.append(share_of_best(criterion, 2, 100, rng))
        share_of_best(criterion, 1, 250, rng)
        changed.append(share_of_best(criterion, 1, 100, rng))
    assert np.mean(first) < 0.45
    assert np.mean(settled) > 0.65
    assert np.mean(changed) > 0.65


def test_it_forgets_and_remembers_on_request_and_refuses_nonsense() -> None:
    criterion, rng = make_criterion("exp4", POLICIES), np.random.default_rng(1)
    share_of_best(criterion, 0, 20, rng)
    kept = criterion.memory
    criterion.reset()
    assert criterion.memory == []
    criterion.memory = kept
    assert criterion.memory == kept
    with pytest.raises(ValueError, match="sum to 1"):
        criterion.memory = [0.5, 0.1]
    with pytest.raises(ValueError, match="must be a list"):
        criterion.memory = [[0.5, 0.5]]
    with pytest.raises(ValueError, match="utility nan"):
        criterion.learn(0, float("nan"))
    criterion.memory = [0.5, 0.5]
    with pytest.raises(ValueError, match="2 advisers, there are 5"):
        criterion.score(IGNORANT, MODEL, rng)
