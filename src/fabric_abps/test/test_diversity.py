# SPDX-License-Identifier: BSD-3-Clause
"""Choosing a library: the weak go, twins are kept once, each kind of person keeps its best."""

import numpy as np
import pytest

from fabric_abps.diversity import choose, clusters, shortlist, smoothed

DIALS = np.random.default_rng(101).random((40, 4))


def world(noise: float = 0.0):
    """Specialists for each end of two dials, a twin of each, an all-rounder, a weak one."""
    ends = [DIALS[:, 0], 1.0 - DIALS[:, 0], DIALS[:, 3], 1.0 - DIALS[:, 3]]
    rows = [np.full(40, 3.6), *(2.0 + 3.0 * end for end in ends)]
    rows += [row - 0.02 for row in rows[1:]]
    rows.append(np.full(40, -5.0))
    rng = np.random.default_rng(102)
    return np.array(rows) + noise * rng.standard_normal((len(rows), 40))


def ends_kept(utility: np.ndarray, size: int) -> list[int]:
    """For which ends a library, the all-rounder always in it, keeps specialists."""
    short = shortlist(utility, DIALS, 9, [0])
    chosen = [short[i] for i in choose(utility[short], DIALS, size, [0])]
    assert chosen[0] == 0
    assert 9 not in chosen
    return sorted((i - 1) % 4 for i in chosen[1:])


def test_of_twins_one_is_kept_and_the_weak_never() -> None:
    assert ends_kept(world(), 5) == [0, 1, 2, 3]


def test_noise_of_thirty_tasks_does_not_hide_who_is_good_for_whom() -> None:
    assert set(ends_kept(world(noise=0.37), 6)) == {0, 1, 2, 3}


def test_a_level_is_no_shape() -> None:
    """Three who differ in how good they are for everybody, two who differ in for whom."""
    ramp = DIALS[:, 2] - 0.5
    utility = np.array([np.full(40, 4.0), 3.9 + ramp, 3.85 + ramp, 3.8 + ramp, 3.9 - ramp])
    assert sorted(choose(utility, DIALS, 3, [0])) == [0, 1, 4]


def test_what_is_always_kept_comes_first_however_weak() -> None:
    assert choose(world(), DIALS, 4, [9, 0])[:2] == [9, 0]


def test_a_library_is_filled_even_when_few_are_near_the_best() -> None:
    chosen = choose(world(), DIALS, 10, [0])
    assert sorted(chosen) == list(range(10))


def test_the_same_figures_choose_the_same() -> None:
    assert choose(world(0.5), DIALS, 6, [0]) == choose(world(0.5), DIALS, 6, [0])


def test_smoothing_keeps_a_quadratic_and_removes_noise() -> None:
    truth = world()
    noisy = truth + np.random.default_rng(103).standard_normal(truth.shape)
    assert np.abs(smoothed(truth, DIALS) - truth).mean() < 0.1
    assert np.abs(smoothed(noisy, DIALS) - truth).mean() < np.abs(noisy - truth).mean() / 1.5


def test_who_is_best_for_one_kind_of_person_is_on_the_short_list() -> None:
    utility = world()
    assert shortlist(utility, DIALS, 5, [0]) == [0, 1, 2, 3, 4]
    assert shortlist(utility, DIALS, 2, [9, 0]) == [0, 9]


def test_clusters_put_like_performance_together() -> None:
    label = clusters(np.array([[0.0, 0.0], [0.1, 0.0], [5.0, 5.0], [5.0, 5.1], [0.0, 9.0]]), 3)
    assert label[0] == label[1]
    assert label[2] == label[3]
    assert len(set(label)) == 3
    assert clusters(np.zeros((2, 2)), 3).tolist() == [0, 1]


def test_senseless_input_is_refused_by_place() -> None:
    utility = world()
    utility[3, 7] = np.nan
    with pytest.raises(ValueError, match="candidate 3 with person 7 is not finite"):
        choose(utility, DIALS, 5, [0])
    with pytest.raises(ValueError, match="candidate 3 with person 7 is not finite"):
        shortlist(utility, DIALS, 5, [0])
    with pytest.raises(ValueError, match="11 to keep of 10 candidates"):
        choose(world(), DIALS, 11, [0])
    with pytest.raises(ValueError, match="1 to keep of 10 candidates, 2 of them set"):
        choose(world(), DIALS, 1, [0, 1])
