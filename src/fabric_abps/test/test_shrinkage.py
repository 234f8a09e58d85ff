# SPDX-License-Identifier: BSD-3-Clause
"""Posterior means of the performance model: by hand, and closer to the truth than sample means."""

import numpy as np
import pytest

from fabric_abps import PerformanceModel


def model_of(mean, variance: float, count: int) -> PerformanceModel:
    shape = np.shape(mean)
    return PerformanceModel(np.full(shape, count), mean, np.full(shape, variance))


def test_interactions_keep_their_share_worked_by_hand() -> None:
    # type and policy parts are 2 in sum, interactions +-1, error 1 / 4
    # variance 1 * 2 / (2 - 1) - 1 / 4 = 1.75, share 1.75 / (1.75 + .25)
    model = model_of([[3.0, 1.0], [1.0, 3.0]], variance=1.0, count=4).shrunk()
    assert model.mean == pytest.approx(2.0 + 0.875 * np.array([[1.0, -1.0], [-1.0, 1.0]]))
    assert (model.variance == 1.0).all()


def test_a_table_that_errors_explain_becomes_type_plus_policy() -> None:
    # interactions +-.1 with a standard error of .5: all of it is luck
    model = model_of([[3.1, 1.9], [1.9, 1.1]], variance=1.0, count=4).shrunk()
    assert model.mean == pytest.approx(np.array([[3.0, 2.0], [2.0, 1.0]]))


def test_with_many_tasks_nothing_changes() -> None:
    table = np.random.default_rng(1).normal(0.0, 2.0, (5, 4))
    assert model_of(table, 1.0, 10**7).shrunk().mean == pytest.approx(table, abs=1e-5)


def test_a_single_type_or_policy_has_no_interactions() -> None:
    assert model_of([[1.0, 5.0, 2.0]], 1.0, 4).shrunk().mean == pytest.approx(
        np.array([[1.0, 5.0, 2.0]])
    )


@pytest.mark.parametrize("wild", [0, 2])
def test_posterior_means_are_nearer_to_the_truth_and_their_best_policy_is_better(wild) -> None:
    """Also when some policies are wild: they must not make the others look as if they were."""
    rng = np.random.default_rng(7)
    wrong, missed = np.zeros(2), np.zeros(2)
    for _ in range(40):
        truth = rng.normal(0, 1, (16, 1)) + rng.normal(0, 0.15, 20) + rng.normal(0, 0.15, (16, 20))
        truth[:, :wild] += rng.normal(-4.0, 3.0, (16, wild))
        sample = model_of(rng.normal(truth, 2.0 / np.sqrt(60)), 4.0, 60)
        for i, model in enumerate((sample, sample.shrunk())):
            wrong[i] += ((model.mean - truth) ** 2).mean()
            chosen = truth[np.arange(16), model.mean.argmax(axis=1)]
            missed[i] += (truth.max(axis=1) - chosen).mean()
    assert wrong[1] < 0.6 * wrong[0]
    assert missed[1] < 0.9 * missed[0]
