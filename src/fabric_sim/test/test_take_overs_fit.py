# SPDX-License-Identifier: BSD-3-Clause
"""The numbers of take_overs.yaml: what a fit finds again, and whom they were learnt from."""

import numpy as np
import pytest
from scipy.special import expit

from fabric_sim.batch_loop import Files
from fabric_sim.character import CORNERS
from fabric_sim.experiments.take_overs_belief import Habits, History
from fabric_sim.experiments.take_overs_fit import (
    FIRST_SEED,
    SEEDS,
    Fit,
    by_dials,
    dials_of,
    simulate,
)
from fabric_sim.experiments.take_overs_watch import Models

TYPES = list(CORNERS)
STATES = ["well", "stuck"]


def history(rng, accepted, state):
    n = len(accepted)
    types = np.full((n, len(TYPES)), 1.0 / len(TYPES))
    answered = np.tril(np.ones((n, n)), -1)
    return History(state, types, accepted, np.zeros(n), np.zeros(n), answered)


def people(rng, count, answers, mean, spread, x):
    """Histories of people who answer as the model says, in states that are known for sure."""
    found = []
    for _ in range(count):
        u = spread * rng.standard_normal()
        at = rng.integers(2, size=answers)
        accepted = (rng.random(answers) < expit(mean + u + np.array(x)[at])).astype(float)
        found.append(history(rng, accepted, np.eye(2)[at]))
    return found


def test_a_fit_finds_the_states_and_the_spread_of_people_again():
    rng = np.random.default_rng(107)
    everybody = people(rng, 200, 12, mean=0.0, spread=1.2, x=(-1.0, 1.5))
    fit = Fit(STATES, TYPES)
    habits = fit.habits(fit.run(everybody), np.zeros(5))
    assert habits.states["stuck"] - habits.states["well"] == pytest.approx(2.5, abs=0.35)
    assert habits.mean + habits.states["well"] == pytest.approx(-1.0, abs=0.35)
    assert habits.spread == pytest.approx(1.2, abs=0.25)


def test_people_who_are_all_alike_have_little_spread():
    rng = np.random.default_rng(108)
    fit = Fit(STATES, TYPES)
    habits = fit.habits(fit.run(people(rng, 150, 10, 0.3, 0.0, (0.0, 0.0))), np.zeros(5))
    assert habits.spread < 0.35


def test_the_dials_of_willing_people_are_found():
    rng = np.random.default_rng(109)
    dials = rng.random((300, 4))
    slopes = np.array([0.0, -1.0, 0.0, 2.0])
    chance = expit(0.5 + (dials - 0.5) @ slopes)
    everybody = [
        history(rng, (rng.random(10) < p).astype(float), np.full((10, 2), 0.5)) for p in chance
    ]
    found = by_dials(everybody, dials)
    np.testing.assert_allclose(found, [0.5, *slopes], atol=0.4)


def test_a_simulated_person_is_recorded_beside_three_robots(tmp_path):
    folder = simulate(tmp_path, 1, Files())
    (tasks,) = folder.people.values()
    robots = [task.recording.name.split("_")[-1] for task in tasks]
    assert robots == ["proactive"] * 2 + ["reactive"] * 2 + ["curious"] * 2
    assert folder.nameless == ()


def test_seeds_of_reports_are_not_used_and_people_differ():
    assert FIRST_SEED == 101 and FIRST_SEED + SEEDS - 1 == 199
    points = {tuple(dials_of(number)) for number in range(2 * SEEDS)}
    assert len(points) == 2 * SEEDS


def test_the_shipped_numbers_name_every_state_of_the_sorting_model():
    files = Files()
    habits = Habits.load(files.share("fabric_sim") / "config/take_overs.yaml")
    assert list(habits.states) == Models.shipped(files).pomdp.states
    assert habits.people >= 100
