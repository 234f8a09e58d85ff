# SPDX-License-Identifier: BSD-3-Clause
"""The fit of dials on likelihoods that are known, and the baselines it is compared with."""

import numpy as np
import pytest

from fabric_sim.character import CORNERS, Character
from fabric_sim.experiments.dial_fit import Exploration
from fabric_sim.experiments.explain import Explainer, persistence_scores, uniform_scores
from fabric_sim.experiments.people_fit import PREDICTORS, PeopleResult, PersonResult, _compare
from fabric_sim.experiments.trials import GRASP, IDLE, PERSON_SUCCEEDED, UNSEEN, WARN, Trial
from fabric_sim.experiments.watching import Watching
from fabric_sim.sensing import DirectParameters

TRUE = np.array([0.3, 0.62, 0.5, 0.71])
SPREAD = np.array([0.05, 0.08, 0.12, 0.1])


def bell(centres, spread):
    """Scores of trials that each say their own centre, (n_trials, 4)."""

    def scores(characters):
        points = np.array([character.dials for character in characters])
        z = (points[None, :, :] - centres[:, None, :]) / spread
        return -0.5 * (z**2).sum(axis=2)

    return scores


def one_trial_of(symbols, events=None):
    n = len(symbols)
    events = np.zeros(n, dtype=int) if events is None else np.array(events)
    return Trial("p", 1, "r", "sorting", np.array(symbols), np.zeros(n, dtype=int), events, n)


def test_the_best_dials_and_their_intervals_are_found():
    centres = np.tile(TRUE, (4, 1))
    fit = Exploration(bell(centres, SPREAD * 2.0), 101).fit()  # four trials halve the spread
    assert fit.best == pytest.approx(TRUE, abs=0.01)
    assert fit.least == pytest.approx(TRUE - 1.96 * SPREAD, abs=0.06)
    assert fit.most == pytest.approx(TRUE + 1.96 * SPREAD, abs=0.06)
    assert fit.effective > 50.0


def test_dials_at_the_edge_stay_in_the_square_and_in_their_interval():
    centres = np.tile([1.2, -0.1, 0.5, 1.0], (3, 1))
    fit = Exploration(bell(centres, SPREAD * 2.0), 102).fit()
    assert fit.best[[0, 1, 3]] == pytest.approx([1.0, 0.0, 1.0], abs=0.005)
    assert fit.most[0] == pytest.approx(1.0, abs=0.005)
    assert (fit.least >= 0.0).all() and (fit.most <= 1.0).all()


def test_what_says_nothing_of_a_dial_leaves_it_open():
    spread = np.array([0.1, 0.1, 0.1, 1e6])
    fit = Exploration(bell(TRUE[None, :], spread), 103).fit()
    assert fit.most[3] - fit.least[3] > 0.85


def test_the_same_seed_fits_the_same():
    first, second = (Exploration(bell(TRUE[None, :], SPREAD), 104).fit() for _ in range(2))
    assert np.array_equal(first.best, second.best)
    assert np.array_equal(first.least, second.least)


def test_a_held_out_trial_is_predicted_by_the_others_only():
    centres = np.vstack((np.tile(TRUE, (3, 1)), [[0.9, 0.1, 0.1, 0.1]]))
    explored = Exploration(bell(centres, SPREAD), 105)
    best, corner, mixed = explored.predict(3)
    expected = bell(centres, SPREAD)([Character(*TRUE)])[3, 0]
    assert best == pytest.approx(expected, rel=0.05)
    table = bell(centres, SPREAD)(list(CORNERS.values()))
    assert corner == pytest.approx(table[3, table[:3].sum(axis=0).argmax()])
    assert mixed > best  # the average over dials is less sure


def test_uniform_counts_every_symbol_that_was_seen():
    trials = [one_trial_of([UNSEEN, IDLE, IDLE, WARN])]
    assert uniform_scores(trials) == pytest.approx([-3 * np.log(6)])


def test_persistence_is_the_hand_worked_value():
    held_in = [one_trial_of([IDLE, IDLE, GRASP, GRASP, GRASP], [0, 0, 0, 0, PERSON_SUCCEEDED])]
    # stays 3 + 1, changes 1 + 1; ticks without a report 4 + 1, right 1 + 1, wrong 0 + 1
    expected = -np.log(6) + np.log(4 / 6) + np.log(2 / 6 / 5) + 3 * np.log(5 / 8)
    assert persistence_scores([one_trial_of([IDLE, IDLE, WARN])], held_in) == pytest.approx(
        expected
    )


def test_the_past_grows_with_what_was_seen_unless_it_is_forgotten():
    sensing = DirectParameters(0.05, 0.5, (0.2, 0.4), (0.8, 0.9), 0.03, (0.8, 0.9), {0: (0.5, 1.5)})
    done = [0, PERSON_SUCCEEDED, 0, PERSON_SUCCEEDED]
    trials = [one_trial_of([IDLE] * 4, done), one_trial_of([IDLE] * 4, done)]
    first, second = Explainer(Watching.of(sensing)).pasts(trials)
    assert first.work > 0.0
    assert first.practised > 0.0
    assert second.work == pytest.approx(3.0 * first.work)
    assert second.practised == pytest.approx(3.0 * first.practised)
    again = Explainer(Watching(sensing, carried=0.0, remembered=1.0)).pasts(trials)[1]
    assert again.work == pytest.approx(first.work)
    assert again.practised == pytest.approx(second.practised)
    forgets = Explainer(Watching(sensing, carried=0.0, remembered=0.0)).pasts(trials)[1]
    assert forgets == first


def test_the_goal_is_met_only_if_both_baselines_are_beaten():
    def result(gain_on_corner):
        row = [-10.0, -10.0 - gain_on_corner, -50.0, -12.0, -10.0]
        person = PersonResult("p", None, None, np.array([row, row]), None)
        return PeopleResult("folder", (person,))

    assert result(1.0).passed
    assert not result(-1.0).passed
    assert not PeopleResult("folder", (PersonResult("p", None, None, None, None),)).passed
    assert [c.baseline for c in result(1.0).comparisons()] == list(PREDICTORS[1:])


def test_the_interval_of_a_gain_is_students():
    comparison = _compare("x", np.array([1.0, 2.0, 3.0]))
    assert comparison.mean == pytest.approx(2.0)
    assert comparison.half == pytest.approx(4.302653 / np.sqrt(3.0), rel=1e-5)
