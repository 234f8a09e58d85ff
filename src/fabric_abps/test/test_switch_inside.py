# SPDX-License-Identifier: BSD-3-Clause
"""Switching inside a task: when, to what, and which policy each observation is credited to."""

from dataclasses import replace

import pytest
from conftest import TYPES, run_job
from test_selector import observation

from fabric_abps import Selector, SelectorParameters, TrainedModels, train
from fabric_abps.evidence import TaskEvidence
from fabric_msgs.msg import Observation, TaskEvent

SWITCHING = SelectorParameters(switch_inside=True, switch_margin=0.5, effective_observations=20.0)
WARNING, IDLE = 17, 33


@pytest.fixture
def models(library) -> TrainedModels:
    return train(library, TYPES, run_job, tasks=40, seed=11)


def seen(task_id: int, code: int, **fields) -> Observation:
    """An observation made from percepts."""
    trigger = fields.pop("trigger", Observation.TRIGGER_ACTION_CHANGE)
    return observation(task_id, code, trigger=trigger, **fields)


def warn_until_switched(selector: Selector, task_id: int = 1) -> int:
    """Show warnings of task_id until the selector switches; returns how many it took."""
    for count in range(1, 20):
        selector.observe(seen(task_id, WARNING))
        if selector.reconsider() is not None:
            return count
    raise AssertionError("it never switched")


def test_it_switches_to_what_suits_the_person_as_seen_so_far(library, models) -> None:
    selector = Selector(library, models, SWITCHING)
    assert selector.select(1, 0).policy == "waits"
    assert selector.reconsider() is None
    warn_until_switched(selector)
    choice = selector.choice
    assert choice.policy == "asks"
    assert choice.task_id == 1
    assert choice.path == library["asks"].path
    assert "Switching inside the task" in choice.reason
    best, present = (choice.expected_reward[library.names.index(n)] for n in ("asks", "waits"))
    assert best - present >= SWITCHING.switch_margin


def test_it_stays_without_the_option_or_below_the_margin_or_with_a_criterion_that_draws(
    library, models
) -> None:
    for parameters in (
        replace(SWITCHING, switch_inside=False),
        replace(SWITCHING, switch_margin=50.0),
        replace(SWITCHING, criterion="thompson"),
        replace(SWITCHING, criterion="random"),
        replace(SWITCHING, criterion="fixed", fixed_policy="waits"),
    ):
        selector = Selector(library, models, parameters)
        selector.select(1, 0)
        for _ in range(10):
            selector.observe(seen(1, WARNING))
            assert selector.reconsider() is None


def test_it_stays_after_observations_of_containers_and_when_the_task_is_over(
    library, models
) -> None:
    selector = Selector(library, models, replace(SWITCHING, switch_margin=0.0))
    selector.select(1, 0)
    for _ in range(10):
        selector.observe(seen(1, WARNING, trigger=Observation.TRIGGER_SUBTASK))
        assert selector.reconsider() is None
    selector.observe(seen(1, WARNING))
    selector.on_task_event(TaskEvent(task_id=1, kind=TaskEvent.TASK_FAILED))
    assert selector.reconsider() is None


def test_reconsidering_moves_no_belief(library, models) -> None:
    selector = Selector(library, models, SWITCHING)
    selector.select(1, 0)
    before = selector.belief.log_probability
    warn_until_switched(selector)
    assert (selector.belief.log_probability == before).all()
    assert selector.tasks_seen == 0


def test_each_observation_is_credited_to_the_policy_it_answers(library, models) -> None:
    evidence = TaskEvidence(0)
    for _ in range(3):
        evidence.observe(seen(1, IDLE))
    evidence.switch(2)  # after the decision on the third: it acts by its decision on the fourth
    for _ in range(3):
        evidence.observe(seen(1, WARNING))
    assert [tuple(stretch) for stretch in evidence.stretches] == [
        (0, [IDLE, IDLE, IDLE, WARNING]),
        (2, [WARNING, WARNING]),
    ]
    model = models.observation
    whole = model.log_likelihood([IDLE, IDLE, IDLE, WARNING], 0)
    whole = whole + model.log_likelihood([WARNING, WARNING], 2, previous=WARNING)
    assert evidence.log_likelihood(model) == pytest.approx(whole)
    assert evidence.weight(3.0) == 3.0 / 6.0
    assert evidence.weight(9.0) == 1.0
    assert evidence.p_values(model) is None


def test_a_task_with_one_policy_is_judged_as_without_the_option(library, models) -> None:
    evidence = TaskEvidence(1)
    codes = [IDLE, IDLE, 1, 9, 5]
    for code in codes:
        evidence.observe(seen(1, code & ~8, failed_attempts=int(code == 9)))
    model = models.observation
    assert evidence.codes == codes
    own = evidence.weight(2.5) * evidence.log_likelihood(model)
    assert own == pytest.approx(model.log_likelihood(codes, 1, 2.5))
    assert (evidence.p_values(model) == model.p_values(codes, 1)).all()


def test_a_switch_that_the_planner_refuses_is_taken_back(library, models) -> None:
    selector = Selector(library, models, SWITCHING)
    before = selector.select(1, 0)
    warn_until_switched(selector)
    selector.take_back(before)
    selector.observe(seen(1, IDLE))
    selector.observe(seen(1, IDLE))
    assert selector.choice is before
    selector.end_task()
    assert selector.tasks_seen == 1
    assert selector.explain().moves
