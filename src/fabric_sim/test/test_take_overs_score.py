# SPDX-License-Identifier: BSD-3-Clause
"""Scores of take-overs against tables worked by hand, brute force and a second formula."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import expit

from fabric_sim.character import CORNERS
from fabric_sim.experiments.take_overs_belief import (
    GRID,
    Habits,
    HabitsError,
    History,
    TypeStateModel,
)
from fabric_sim.experiments.take_overs_compare import (
    BASE_RATE,
    Table,
    base_rate,
    compare,
    kept,
    left_out,
    weighed,
)
from fabric_sim.experiments.take_overs_score import (
    Groups,
    auc,
    resampled_auc,
    resamples,
    roc,
    within_people,
)
from fabric_sim.experiments.take_overs_watch import TakeOver

TYPES = list(CORNERS)
STATES = ["well", "stuck"]
HABITS = Habits(0.4, 0.8, -3.0, 0.5, {"well": -1.0, "stuck": 1.5}, 0.2, (0.5, -0.3, 0.2, 1.0))


def take_over(person="a", task=1, accepted=True, **values):
    given = {
        "person": person, "task": task, "robot": "reactive", "time": 1.0, "subtask": 1,
        "first": True, "begun": True, "state": np.array([0.5, 0.5]),
        "types": np.full(len(TYPES), 1.0 / len(TYPES)), "answered": (), "warned": 0, "quiet": 0,
        "warnings_task": 0, "warnings_person": 0, "idle": 0.0, "accepted": accepted,
        "ended_by": "robot right",
    }  # fmt: skip
    return TakeOver(**{**given, **values})


def test_auc_of_a_table_worked_by_hand_ties_count_half():
    # accepted .9 .5 .4, warned .5 .1: pairs won 1+1, .5+1, 0+1 of 6
    assert auc([0.9, 0.5, 0.4, 0.5, 0.1], [1, 1, 1, 0, 0]) == pytest.approx(4.5 / 6)
    assert auc([0.3, 0.3], [1, 0]) == 0.5
    assert auc([1.0, 2.0], [1, 0]) == 0.0


def test_auc_without_one_of_the_outcomes_is_nan_and_scores_must_be_finite():
    assert math.isnan(auc([0.1, 0.2], [1, 1]))
    for bad in (math.nan, math.inf):
        with pytest.raises(ValueError, match=r"score \[1\]"):
            auc([0.1, bad], [1, 0])


def test_the_roc_curve_has_the_area_of_the_auc():
    rng = np.random.default_rng(101)
    scores, positive = rng.integers(6, size=60), rng.random(60) < 0.4
    alarms, hits = roc(scores, positive)
    assert (alarms[0], hits[0], alarms[-1], hits[-1]) == (0.0, 0.0, 1.0, 1.0)
    assert np.trapz(hits, alarms) == pytest.approx(auc(scores, positive))


def test_within_people_compares_nobody_with_somebody_else():
    scores, positive = [0.9, 0.8, 0.2, 0.1], [1, 0, 1, 0]
    assert within_people(scores, positive, ["a", "a", "b", "b"]) == 1.0
    assert within_people(scores, positive, ["a", "b", "b", "a"]) == 0.5
    assert math.isnan(within_people(scores, positive, ["a", "b", "a", "b"]))


def test_resamples_draw_people_then_tasks_as_wholes():
    groups = Groups(("a", "a", "a", "b"), (1, 1, 2, 1))
    counts = resamples(groups, seed=102, draws=500)
    assert (counts[:, 0] == counts[:, 1]).all()  # one task
    tasks = counts[:, 0] + counts[:, 2] + counts[:, 3]
    people = (counts[:, 0] + counts[:, 2]) / 2.0 + counts[:, 3]
    assert set(people) == {2.0} and tasks.min() >= 2.0
    assert counts[:, 3].max() == 2.0
    assert np.array_equal(counts, resamples(groups, seed=102, draws=500))


def test_the_auc_of_a_resample_is_that_of_the_repeated_take_overs():
    rng = np.random.default_rng(103)
    scores, positive = rng.integers(4, size=12) / 3.0, rng.random(12) < 0.5
    counts = rng.integers(3, size=(20, 12)).astype(float)
    areas = resampled_auc(scores, positive, counts)
    for row, area in zip(counts.astype(int), areas, strict=True):
        repeated = auc(np.repeat(scores, row), np.repeat(positive, row))
        assert area == pytest.approx(repeated, nan_ok=True)


def brute_force(habits, history, row):
    """Eq. of the head of take_overs_belief, term by term."""
    total = weight = 0.0
    for u in habits.spread * GRID:

        def accepts(i, u=u):
            x = [habits.states[s] for s in STATES]
            return sum(history.state[i, s] * expit(habits.mean + u + x[s]) for s in (0, 1))

        w = math.exp(-0.5 * (u / habits.spread) ** 2)
        for i in np.flatnonzero(history.answered[row]):
            w *= accepts(i) if history.accepted[i] else 1.0 - accepts(i)
        q = expit(habits.warning - habits.reluctance * u)
        w *= q ** history.warned[row] * (1.0 - q) ** history.quiet[row]
        weight += w
        total += w * accepts(row)
    return total / weight


@pytest.fixture
def history():
    rng = np.random.default_rng(104)
    state = rng.dirichlet([1.0, 1.0], size=4)
    types = rng.dirichlet(np.ones(len(TYPES)), size=4)
    answered = np.tril(np.ones((4, 4)), -1)
    answered[3, 2] = 0.0  # still open
    return History(
        state, types, np.array([1.0, 0.0, 0.0, 1.0]), np.arange(4.0), 2.0 + np.arange(4.0), answered
    )


def test_the_chance_is_the_sum_over_types_and_states(history):
    together = TypeStateModel(HABITS, STATES, TYPES).predict(history).together
    for row in range(4):
        assert together[row] == pytest.approx(brute_force(HABITS, history, row), rel=1e-9)


def test_the_order_of_types_and_states_does_not_matter(history):
    order = np.random.default_rng(105).permutation(len(TYPES))
    turned = replace(history, types=history.types[:, order], state=history.state[:, ::-1])
    one = TypeStateModel(HABITS, STATES, TYPES).predict(history)
    other = TypeStateModel(HABITS, STATES[::-1], [TYPES[k] for k in order]).predict(turned)
    np.testing.assert_allclose(one.together, other.together)
    np.testing.assert_allclose(one.known_types, other.known_types)


def test_the_known_types_speak_by_their_dials(history):
    certain = replace(history, types=np.eye(len(TYPES))[:4])
    found = TypeStateModel(HABITS, STATES, TYPES).predict(certain).known_types
    for k in range(4):
        e, s, a, c = CORNERS[TYPES[k]].dials
        odds = 0.2 + 0.5 * (e - 0.5) - 0.3 * (s - 0.5) + 0.2 * (a - 0.5) + 1.0 * (c - 0.5)
        assert found[k] == pytest.approx(expit(odds))


def test_an_answer_that_is_not_known_yet_changes_nothing(history):
    model = TypeStateModel(HABITS, STATES, TYPES)
    changed = replace(history, accepted=np.array([1.0, 0.0, 1.0, 0.0]))  # the last two
    np.testing.assert_array_equal(
        model.predict(history).together[:4], model.predict(changed).together[:4]
    )


def test_acceptance_raises_and_warnings_lower_what_is_expected():
    model = TypeStateModel(HABITS, STATES, TYPES)
    no, yes = (
        History.of([take_over(accepted=answer), take_over(answered=(0,))])
        for answer in (False, True)
    )
    alone = History.of([take_over(), take_over(warned=3)])
    assert model.predict(no).together[1] < model.predict(alone).together[0]
    assert model.predict(yes).together[1] > model.predict(alone).together[0]
    assert model.predict(alone).together[1] < model.predict(alone).together[0]


def test_the_state_alone_knows_no_person_and_the_type_alone_no_state(history):
    model = TypeStateModel(HABITS, STATES, TYPES)
    nobody = replace(history, answered=np.zeros((4, 4)), warned=np.zeros(4), quiet=np.zeros(4))
    np.testing.assert_allclose(model.predict(history).state, model.predict(nobody).state)
    first = model.predict(nobody).type
    np.testing.assert_allclose(first, model.predict(replace(nobody, state=nobody.state[::-1])).type)


def test_the_likelihood_is_that_of_the_answers_one_after_another(history):
    model = TypeStateModel(HABITS, STATES, TYPES)
    quiet = replace(history, warned=np.zeros(4), quiet=np.zeros(4))
    chance = model.predict(quiet).together
    expected = np.log([chance[0], 1 - chance[1], 1 - chance[2], chance[3]]).sum()
    assert model.log_likelihood(quiet) == pytest.approx(expected)


def test_habits_come_back_from_a_file_and_bad_ones_are_refused_by_name(tmp_path):
    path = tmp_path / "habits.yaml"
    HABITS.save(path, "# head\n")
    assert Habits.load(path) == HABITS
    good = path.read_text()
    for old, new, complaint in (
        ("mean: 0.4", "mean: .nan", "mean: nan is not finite"),
        ("mean: 0.4", "mean: much", "mean: 'much' is not a number"),
        ("spread: 0.8", "spread: 0.0", "spread: must be positive"),
        ("well: -1.0", "well: .inf", "states/well: inf is not finite"),
        ("mean: 0.4\n", "", "'mean' is missing"),
        ("mean: 0.4", "mean: 0.4\ntrust: 1.0", "'trust' is unknown"),
        ("- 0.5\n", "", "dials: must be 4 numbers"),
    ):
        path.write_text(good.replace(old, new))
        with pytest.raises(HabitsError, match=complaint) as told:
            Habits.load(path)
        assert str(path) in str(told.value)


def test_leave_one_person_out_leaves_the_person_out():
    def of(answers_of_a):
        a = [take_over("a", accepted=bool(x)) for x in answers_of_a]
        b = [take_over("b", accepted=x) for x in (True, True, False, True)]
        return [*a, *b]

    state = np.array([0.2, 0.8, 0.3, 0.7, 0.6, 0.4, 0.9, 0.2])
    kind = np.array([0.6, 0.7, 0.2, 0.3, 0.8, 0.7, 0.4, 0.6])
    one, other = of([1, 1, 0, 1]), of([0, 0, 1, 0])
    for scores in (base_rate, lambda t: weighed(t, state, kind, 0.1)):
        np.testing.assert_array_equal(scores(one)[:4], scores(other)[:4])  # own answers
        assert not np.array_equal(scores(one)[4:], scores(other)[4:])  # those of the others
    np.testing.assert_allclose(base_rate(one)[:4], 0.75)


def test_without_others_the_weights_are_those_of_bayes_and_the_base_rate_a_half():
    alone = [take_over("a", accepted=True), take_over("a", accepted=False)]
    assert base_rate(alone).tolist() == [0.5, 0.5]
    both = weighed(alone, np.array([0.7, 0.4]), np.array([0.6, 0.3]), 0.0)
    expected = expit(np.log([0.7 / 0.3, 0.4 / 0.6]) + np.log([0.6 / 0.4, 0.3 / 0.7]))
    np.testing.assert_allclose(both, expected, rtol=1e-4)


def test_the_areas_without_a_person_do_not_hold_their_take_overs():
    scores, accepted = np.array([0.9, 0.1, 0.2, 0.8]), np.array([True, False, True, False])
    assert left_out(scores, accepted, ["a", "a", "b", "b"]) == {"a": 0.0, "b": 1.0}


@pytest.fixture
def small_table():
    people = [
        take_over(person, task, accepted, robot=robot, first=first)
        for person, task, accepted, robot, first in (
            ("a", 1, True, "reactive", True),
            ("a", 1, False, "reactive", False),
            ("a", 2, True, "proactive", True),
            ("b", 1, False, "reactive", True),
            ("b", 2, False, "proactive", True),
        )
    ]
    score = np.array([0.9, 0.6, 0.7, 0.2, 0.4])
    names = ("state and type belief together", "belief in needs_help", "warnings so far, task")
    return Table(tuple(people), {n: score for n in (*names, BASE_RATE)}, ("grasp",) * 5)


def test_each_robot_and_way_of_counting_is_compared_by_itself(small_table):
    parts = compare(small_table, seed=106)
    assert [(p.counted[:5], p.robot, p.n, p.accepted) for p in parts] == [
        ("first", "proactive", 2, 1),
        ("first", "reactive", 2, 1),
        ("first", "all", 4, 2),
        ("every", "proactive", 2, 1),
        ("every", "reactive", 3, 1),
        ("every", "all", 5, 2),
    ]
    last = parts[-1].lines[0]
    assert last.area.value == 1.0
    assert last.area.low <= 1.0 <= last.area.high
    assert last.gains["belief in needs_help"].value == 0.0


def test_warned_take_overs_are_avoided_and_accepted_ones_kept(small_table):
    takes = [True, True, False, False, False]
    found = kept(small_table, range(5), takes)
    assert (found.warned, found.avoided, found.accepted, found.kept) == (3, 2, 2, 1)
