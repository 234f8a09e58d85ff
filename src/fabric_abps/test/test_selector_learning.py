# SPDX-License-Identifier: BSD-3-Clause
"""What the selector learns from a task, number by number, and what it forgets with a person."""

import numpy as np
import pytest
from conftest import TYPES, run_job
from test_selector import live, live_with, observation

from fabric_abps import (
    ChangeDetector,
    Selector,
    SelectorParameters,
    SignalEncoder,
    TrainedModels,
    TypeBelief,
    train,
)
from fabric_abps.familiarity import Familiarity
from fabric_msgs.msg import Observation

CODES = [33, 33, 5, 17, 1, 33, 17, 17, 17, 33, 1, 1]


@pytest.fixture
def models(library) -> TrainedModels:
    return train(library, TYPES, run_job, tasks=40, seed=11)


def test_a_task_moves_the_belief_by_its_weighted_likelihood(library, models) -> None:
    parameters = SelectorParameters(effective_observations=4.0, forgetting=0.1, floor=1e-3)
    selector = Selector(library, models, parameters)
    reference = TypeBelief(TYPES, 0.1, 1e-3)
    for task_id in (1, 2):
        policy = library.names.index(selector.select(task_id, 0).policy)
        live(selector, task_id, CODES)
        parts = models.observation.contributions(CODES, policy)
        reference.update(4.0 / len(CODES) * parts.sum(axis=0))
        assert selector.belief.probability == pytest.approx(reference.probability)


def test_a_switch_is_weighed_by_what_the_belief_will_be_after_the_task(library, models) -> None:
    parameters = SelectorParameters(switch_inside=True, switch_margin=0.0)
    selector = Selector(library, models, parameters)
    selector.select(1, 0)
    choice, shown = None, [1] * 6
    for code in shown:
        selector.observe(observation(1, code))
    while choice is None and len(shown) < 30:
        shown.append(17)
        selector.observe(observation(1, 17, trigger=Observation.TRIGGER_ACTION_CHANGE))
        choice = selector.reconsider()
    likelihood = models.observation.log_likelihood(shown, 0, parameters.effective_observations)
    beta = selector.belief.foresee(likelihood)
    assert choice.expected_reward == pytest.approx(models.performance.expected(beta))


def test_after_a_change_only_the_tasks_since_then_count(library, models) -> None:
    parameters = SelectorParameters(change_rate=0.02, effective_observations=3.0)
    selector, detector = Selector(library, models, parameters), ChangeDetector(len(TYPES), 0.02)
    changed, task_id, seen = False, 0, []
    while not changed:
        task_id += 1
        policy = library.names.index(selector.select(task_id, 5).policy)
        codes = [33, 5, 33, 1] * 3 if task_id <= 10 else [17, 17, 33, 5] * 3
        live(selector, task_id, codes)
        seen.append(models.observation.log_likelihood(codes, policy))
        changed = detector.update(seen[-1], 3.0 / len(codes))
        assert selector.explain().changed == changed
    reference = TypeBelief(TYPES, parameters.forgetting, parameters.floor)
    reference.update(3.0 / 12.0 * sum(seen[-detector.tasks :]))
    assert selector.belief.probability == pytest.approx(reference.probability)
    assert selector.tasks_seen == detector.tasks < task_id
    assert len(selector.state()["p_values"]) == 1


def test_a_reward_is_learnt_from_once_and_forgotten_with_the_person(library, models) -> None:
    selector = Selector(library, models, SelectorParameters(criterion="exp4"))
    selector.select(1, 0)
    selector.end_task(utility=-4.0)
    trust = selector.state()["criterion_memory"]
    selector.end_task(utility=-4.0)
    assert selector.state()["criterion_memory"] == trust
    selector.reset()
    assert selector.state()["criterion_memory"] == []


def test_typicality_follows_fishers_method_worked_by_hand() -> None:
    # two tasks: P(chi-square with 4 degrees >= -2 ln x) = x (1 - ln x), x the product of both p
    flag = Familiarity(rate=0.1, window=2)
    for p_values in ([0.5, 0.9], [0.1, 0.01], [0.2, 0.3]):  # the first is out of the window
        flag.take(p_values)
    x = np.array([0.1 * 0.2, 0.01 * 0.3])
    assert flag.typicality == pytest.approx((x * (1.0 - np.log(x))).max())
    assert flag.alarm == (flag.typicality < 0.1)


def test_a_cube_misplaced_is_a_failed_grasp_without_a_rising_count() -> None:
    assert SignalEncoder().encode(Observation(detected=True, subtask_failure=True)) == 9


def test_a_person_known_before_is_no_new_person(library, models) -> None:
    selector = Selector(library, models)
    live_with(selector, "touchy", 6)
    again = Selector(library, models)
    again.restore(selector.state())
    assert again.select(7, 0).policy == selector.select(7, 0).policy == "asks"
