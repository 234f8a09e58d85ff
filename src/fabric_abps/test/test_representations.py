# SPDX-License-Identifier: BSD-3-Clause
"""The comparison of representations, against hand-worked numbers and a world that is known."""

import numpy as np
import pytest

from fabric_abps import ObservationModel
from fabric_abps.representations import (
    REPRESENTATIONS,
    Representation,
    bits,
    held_out,
    log_probability,
    ordered,
    ordered_length,
    posterior,
    unordered,
)


def test_counts_worked_by_hand() -> None:
    codes = np.array([33, 33, 1])
    assert unordered(codes)[0, [1, 33]].tolist() == [1, 2]
    assert [tuple(pair) for pair in np.argwhere(ordered(codes))] == [(33, 1), (33, 33), (64, 33)]
    assert ordered_length(codes)[1, 64] == 1
    assert bits(codes).tolist() == [[3, 0], [0, 3], [0, 3], [0, 3], [0, 3], [2, 1]]


def test_rows_are_urns_of_their_own() -> None:
    # urn (2, 1) draws a, b, a: 2/3 * 1/4 * 3/5; urn (1, 1) draws b: 1/2
    alpha, counts = np.array([[2.0, 1.0], [1.0, 1.0]]), np.array([[2, 1], [0, 1]])
    assert log_probability(alpha, counts) == pytest.approx(np.log(2 / 3 / 4 * 3 / 5 / 2))


def test_parameters_add_to_what_was_counted_and_the_concentration() -> None:
    rng = np.random.default_rng(3)
    counts = rng.integers(0, 9, (3, 2, 5, 4))
    for own in (False, True):
        alpha = posterior(counts, 16.0, own)
        assert (alpha > counts).all()
        assert alpha.sum(axis=-1) == pytest.approx(counts.sum(axis=-1) + 16.0)


def test_the_chosen_one_predicts_as_the_observation_model() -> None:
    rng = np.random.default_rng(4)
    tasks = [[[rng.choice([1, 5, 33], 9) for _ in range(6)] for _ in range(2)] for _ in range(3)]
    model = ObservationModel.fit(tasks)
    counts = np.array([[sum(ordered(task) for task in pair) for pair in row] for row in tasks])
    alpha = posterior(counts, model.concentration, own=False)
    predictive = alpha / alpha.sum(axis=-1, keepdims=True)
    assert model.probability(1) == pytest.approx(predictive[:, 1])


def world(seed: int, moods: list[float]) -> list:
    """codes[type][policy][person][task]: a type repeats its last code with its own probability."""
    rng = np.random.default_rng(seed)

    def task(stay: float) -> np.ndarray:
        codes = [rng.choice([1, 33])]
        for _ in range(14):
            codes.append(codes[-1] if rng.random() < stay else rng.choice([1, 33]))
        return np.array(codes)

    return [[[[task(stay) for _ in range(10)] for _ in range(3)]] for stay in moods]


def test_order_is_chosen_when_types_differ_in_nothing_else() -> None:
    codes = world(7, [0.1, 0.9])
    found = {r.name: held_out(codes, r) for r in REPRESENTATIONS}
    order = found["codes in order, else everybody's"]
    assert order.likelihood > found["codes in any order"].likelihood + 1.0
    assert order.log_posterior[-1] > -0.05
    assert found["codes in any order"].log_posterior[-1] < -0.2


def test_order_gains_nothing_when_there_is_none() -> None:
    codes = world(8, [0.0, 0.0])
    found = {r.name: held_out(codes, r).likelihood for r in REPRESENTATIONS}
    assert found["codes in order, else everybody's"] == pytest.approx(
        found["codes in any order"], abs=0.2
    )


def test_a_person_held_out_is_not_in_the_training() -> None:
    """Two people who do different things: each is a surprise to a model of the other."""
    pair = [[[np.array([1] * 5)] * 2, [np.array([33] * 5)] * 2]]
    surprise = held_out([pair, pair], Representation("any", unordered)).likelihood
    assert surprise < 5 * np.log(0.5)
