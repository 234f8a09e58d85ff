# SPDX-License-Identifier: BSD-3-Clause
"""Numbers of the long-term study against tables worked by hand."""

import math

import numpy as np
import pytest

from fabric_sim.experiments.long_term_run import (
    ABPS,
    BEST,
    ORACLE,
    Adaptation,
    Convergence,
    Hindsight,
)
from fabric_sim.experiments.long_term_shifts import shifts_of
from fabric_sim.experiments.long_term_stats import (
    adaptation_goals,
    approach,
    closed_share,
    constant_apart,
    convergence_goals,
    gap,
    moving_mean,
    ranking,
    regret,
    reward_tests,
    settled,
)

SEED = 101
TASKS = 4


def test_regret_is_what_the_best_policy_earns_more():
    best = [[4.0, 5.0, 3.0], [6.0, 6.0, 6.0]]
    own = [[4.0, 2.0, 5.0], [0.0, 6.0, 5.0]]
    assert regret(best, own).tolist() == [[0.0, 3.0, -2.0], [6.0, 0.0, 1.0]]


@pytest.mark.parametrize("own", [[1.0], [1.0, math.nan], [1.0, math.inf]])
def test_regret_of_tables_that_do_not_fit_is_refused(own):
    with pytest.raises(ValueError, match="regret needs"):
        regret([1.0, 2.0], own)


def test_a_moving_mean_takes_what_there_is_at_the_start():
    assert moving_mean([[3.0, 1.0, 2.0, 6.0]], 3).tolist() == [[3.0, 2.0, 2.0, 3.0]]
    with pytest.raises(ValueError, match="window is 0"):
        moving_mean([1.0], 0)


def test_a_share_has_settled_when_it_does_not_leave_again():
    assert settled([0.5, 0.04, 0.2, 0.05, 0.01]) == 4
    assert settled([0.0, 0.01]) == 1
    assert settled([0.0, 0.2]) is None


def convergence(missed: list[float], workers: int = 5) -> Convergence:
    """The best policy earns 4 in every task; ABPS misses this much of it in each."""
    best = np.full((workers, 3, len(missed)), 4.0)
    own = best - np.array(missed)
    shifts = [shifts_of(seed, "convergence", 1, 3, len(missed))[0] for seed in range(workers)]
    hindsight = Hindsight(["a"] * workers, 10, np.zeros((workers, 1)))
    return Convergence(shifts, hindsight, {ABPS: own, BEST: best}, own == best)


def test_convergence_is_told_by_the_moving_regret_as_a_share():
    found = approach(convergence([2.0, 1.0, 0.6, 0.2, 0.1, 0.0, 0.0, 0.0]))
    expected = np.array([2.0, 1.5, 1.2, 0.6, 0.3, 0.1, 0.1 / 3.0, 0.0]) / 4.0
    assert found.share == pytest.approx(expected)
    assert found.low == pytest.approx(expected)  # all workers alike
    assert found.settled == 6
    assert found.rest.value == pytest.approx(0.0)


def test_the_goals_of_convergence_are_judged_at_their_tasks():
    late = convergence_goals(convergence([2.0, 1.0, 0.6, 0.2, 0.1, 0.0]))
    assert [goal.met for goal in late] == [True, False]
    never = convergence_goals(convergence([1.0] * 6))
    assert [goal.met for goal in never] == [False, False]


def test_the_interval_of_regret_is_over_people():
    study = convergence([0.5] * 6, workers=40)
    rng = np.random.default_rng(SEED)
    study.rewards[ABPS] += rng.normal(0.0, 1.0, (40, 1, 1))
    found = approach(study)
    half = 1.96 / math.sqrt(40) / 4.0
    assert (found.high - found.low)[3] / 2.0 == pytest.approx(half, rel=0.35)


def test_a_share_of_a_loss_means_nothing():
    study = convergence([0.0] * 6)
    study.rewards[BEST] -= 5.0
    with pytest.raises(ValueError, match="mean nothing"):
        approach(study)


def adaptation(extra: dict[str, float], spread: float = 0.1, orders: int = 20) -> Adaptation:
    """Strategies that earn so much more than 3 on average, each with noise of its own."""
    rng = np.random.default_rng(SEED)
    level = rng.normal(3.0, 0.5, (orders, 1))  # of the people of an order, equal for all
    figures = {}
    for name, more in extra.items():
        table = np.zeros((orders, 2 * TASKS, 4))
        table[:, :, 0] = level + more + rng.normal(0.0, spread, (orders, 1))
        table[:, :, 1] = 0.9
        table[:, :, 2] = 0.5 if name == ABPS else 1.0
        figures[name] = table
    shifts = [[own[0] for own in shifts_of(s, "adaptation", 2, 1, TASKS)] for s in range(orders)]
    library = [name for name in extra if name not in (ABPS, ORACLE)]
    hindsight = Hindsight([library[0]] * 2 * orders, 10, np.zeros((2 * orders, len(library))))
    return Adaptation(list(range(orders)), shifts, library, [], hindsight, figures, {})


def test_the_gap_is_closed_by_the_share_of_the_way_to_the_oracle():
    study = adaptation({ABPS: 0.8, "a": 0.0, "b": -1.0, ORACLE: 1.0}, spread=0.0)
    assert study.best_constant() == "a"
    assert gap(study).value == pytest.approx(1.0)
    assert closed_share(study).value == pytest.approx(0.8)
    assert closed_share(study, "b").value == pytest.approx(-1.0)


def test_the_constant_chosen_apart_is_not_the_one_that_was_lucky_here():
    study = adaptation({ABPS: 0.8, "a": 0.0, "b": 0.1, ORACLE: 1.0}, spread=0.0)
    study.hindsight.rewards[:] = [0.2, 0.1]
    assert constant_apart(study) == "a"
    assert study.best_constant() == "b"
    assert gap(study, "a").value == pytest.approx(1.0)
    assert gap(study).value == pytest.approx(0.9)
    assert closed_share(study, ABPS, "a").value == pytest.approx(0.8)


def test_no_share_is_told_where_there_is_no_gap():
    study = adaptation({ABPS: 0.1, "a": 0.0, ORACLE: 0.0}, spread=0.3)
    assert math.isnan(closed_share(study).value)
    assert adaptation_goals(study)[3].met is None


def test_the_best_constant_is_found_afterwards_and_warnings_are_summed():
    study = adaptation({ABPS: 1.0, "a": -0.5, "b": 0.5, ORACLE: 1.0})
    assert study.best_constant() == "b"
    assert study.per_order("a", "warnings").tolist() == [2.0 * TASKS] * 20
    assert ranking(study)[0] == ABPS
    assert ranking(study)[-1] == "a"


def test_the_goals_of_adaptation_are_met_by_clear_differences_only():
    clear = adaptation_goals(adaptation({ABPS: 0.8, "a": 0.0, ORACLE: 1.0}))
    assert [goal.met for goal in clear] == [True, True, True, True]
    same = adaptation_goals(adaptation({ABPS: 0.0, "a": 0.0, ORACLE: 1.0}))
    assert [goal.met for goal in same] == [False, True, True, False]
    worse = adaptation_goals(adaptation({ABPS: -0.8, "a": 0.0, ORACLE: 1.0}))
    assert worse[0].met is False


def test_comparisons_with_all_strategies_are_corrected_for_their_number():
    study = adaptation({ABPS: 0.05, "a": 0.0, "b": 0.0, "c": 0.0, ORACLE: 0.0})
    for found in reward_tests(study).values():
        assert found.n == 20
        assert found.p_holm >= max(found.p_t, found.p_wilcoxon)
