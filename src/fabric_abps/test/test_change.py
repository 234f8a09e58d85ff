# SPDX-License-Identifier: BSD-3-Clause
"""A shift change is noticed within a couple of tasks; the same person seldom raises an alarm."""

import numpy as np
import pytest

from fabric_abps import ChangeDetector

N_TYPES = 5
SPREAD = 2.5  # a task of type i looks like N(SPREAD i, 1)


def log_likelihood(look: float) -> np.ndarray:
    """What a task that looked like this says of every type, nats up to a constant."""
    return -0.5 * (look - SPREAD * np.arange(N_TYPES)) ** 2


def tasks_of(person: np.ndarray, tasks: int, rng: np.random.Generator) -> list[np.ndarray]:
    """Tasks of a person who is a mixture of the types, person (N_TYPES,)."""
    types = rng.choice(N_TYPES, size=tasks, p=person)
    return [log_likelihood(look) for look in rng.normal(SPREAD * types, 1.0)]


def test_the_odds_follow_a_table_worked_by_hand() -> None:
    # two types, likelihood (1, 0) twice, then (0, 1); every person begins with counts (1, 1)
    detector = ChangeDetector(2, rate=0.01)
    same, other = np.array([0.0, -1e9]), np.array([-1e9, 0.0])
    detector.update(same)  # the present person's counts: (2, 1)
    assert detector.log_odds == -np.inf
    detector.update(same)  # foretold 2/3 by the present, 1/2 by a new one: odds 3/4
    assert np.exp(detector.log_odds) == pytest.approx(3 / 4)
    # counts: present (3, 1), new since task 2 (2, 1), new since task 3 (1, 1)
    # the other type is foretold 1/4, 1/3 and 1/2: odds 3/4 * 4/3 + 4/2 = 1 + 2
    detector.update(other)
    assert np.exp(detector.log_odds) == pytest.approx(3.0)


@pytest.mark.parametrize("kind", ["a known type", "somebody between the types"])
def test_false_alarms_stay_below_the_stated_rate(kind) -> None:
    rng = np.random.default_rng(3)
    rate, alarms, tasks = 0.05, 0, 0
    for number in range(60):
        pure = np.eye(N_TYPES)[number % N_TYPES]
        person = pure if kind == "a known type" else rng.dirichlet(np.ones(N_TYPES))
        detector = ChangeDetector(N_TYPES, rate)
        for evidence in tasks_of(person, 50, rng):
            alarms += detector.update(evidence)
            tasks += 1
    assert alarms <= tasks * rate + 3 * np.sqrt(tasks * rate)


def test_a_relief_is_noticed_within_a_couple_of_tasks() -> None:
    rng = np.random.default_rng(4)
    delays = []
    for number in range(100):
        before, after = np.eye(N_TYPES)[[number % N_TYPES, (number + 2) % N_TYPES]]
        detector = ChangeDetector(N_TYPES, 0.02)
        for evidence in tasks_of(before, 15, rng):
            detector.update(evidence)
        alarms = [detector.update(evidence) for evidence in tasks_of(after, 6, rng)]
        delays.append(alarms.index(True) + 1 if any(alarms) else 99)
    assert np.median(delays) <= 2
    assert np.mean(np.array(delays) <= 3) > 0.9


def test_after_an_alarm_the_person_begins_with_the_change() -> None:
    detector = ChangeDetector(N_TYPES, 0.02)
    for _ in range(10):
        assert not detector.update(log_likelihood(0.0))
    new = log_likelihood(4 * SPREAD)
    count = 1
    while not detector.update(new):
        count += 1
    assert detector.tasks == count
    assert detector.evidence == pytest.approx(count * new)
    assert detector.log_odds == -np.inf


def test_the_order_of_the_types_does_not_matter() -> None:
    rng = np.random.default_rng(5)
    order = rng.permutation(N_TYPES)
    one, other = ChangeDetector(N_TYPES), ChangeDetector(N_TYPES)
    for evidence in tasks_of(np.full(N_TYPES, 1 / N_TYPES), 30, rng):
        assert one.update(evidence) == other.update(evidence[order])
        assert one.log_odds == pytest.approx(other.log_odds)


def test_rate_0_never_sounds_and_the_window_bounds_the_work() -> None:
    detector = ChangeDetector(N_TYPES, 0.0, window=3)
    for look in (0.0, 10.0) * 20:
        assert not detector.update(log_likelihood(look))
    assert len(detector.state()["log_odds"]) == 3
    assert len(detector.state()["evidence"]) == 3


def test_it_goes_on_where_a_state_stops() -> None:
    rng = np.random.default_rng(6)
    one, other = ChangeDetector(N_TYPES), ChangeDetector(N_TYPES)
    for evidence in tasks_of(np.eye(N_TYPES)[1], 15, rng):
        one.update(evidence)
    other.restore(one.state())
    for evidence in tasks_of(np.eye(N_TYPES)[3], 5, rng):
        assert one.update(evidence) == other.update(evidence)
    assert one.state() == other.state()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"rate": 1.0}, "change_rate"),
        ({"rate": float("nan")}, "change_rate"),
        ({"window": 0}, "change_window"),
        ({"window": 2.5}, "change_window"),
    ],
)
def test_impossible_settings_are_refused(arguments, message) -> None:
    with pytest.raises(ValueError, match=message):
        ChangeDetector(N_TYPES, **arguments)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"people": [[1.0] * N_TYPES] * 9}, "odds"),
        ({"evidence": [[float("nan")] * N_TYPES]}, "not finite"),
        ({"people": [[0.0] * N_TYPES] * 3}, "positive"),
        ({"people": [[1.0, 2.0]]}, f"change: people must be rows of {N_TYPES} numbers"),
        ({"people": [1.0] * N_TYPES}, "change: people must be rows"),
        ({"evidence": [[1.0], [1.0, 2.0]]}, "change: evidence must be rows"),
        ({"evidence": "much"}, "change: evidence must be rows"),
        ({"tasks": -3}, "change: tasks must be a whole number >= 0, got -3"),
    ],
)
def test_a_damaged_state_is_refused(change, message) -> None:
    detector = ChangeDetector(N_TYPES)
    for _ in range(3):
        detector.update(log_likelihood(0.0))
    with pytest.raises(ValueError, match=message):
        detector.restore(detector.state() | change)
