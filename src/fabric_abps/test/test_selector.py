# SPDX-License-Identifier: BSD-3-Clause
"""Algorithm 1 with synthetic people: types are recognised, the choice settles on the best."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from conftest import POLICIES, TYPES, UTILITY, run_job, run_task

from fabric_abps import (
    ModelsError,
    Selector,
    SelectorParameters,
    TrainedModels,
    child_seed,
    code_name,
    train,
)
from fabric_abps.signals import SignalEncoder
from fabric_msgs.msg import Observation, TaskEvent

TASKS = 12


@pytest.fixture
def models(library) -> TrainedModels:
    return train(library, TYPES, run_job, tasks=40, seed=11)


@pytest.fixture
def selector(library, models) -> Selector:
    return Selector(library, models)


def observation(task_id: int, code: int, **fields) -> Observation:
    """An Observation that encodes to `code` when the count of failures is left alone."""
    message = Observation(task_id=task_id, **fields)
    names = ("detected", "looking_around", "subtask_success", "subtask_failure", "warning", "idle")
    for bit, name in enumerate(names):
        setattr(message, name, bool(code >> bit & 1))
    return message


def live(selector: Selector, task_id: int, codes) -> None:
    """A whole task: its observations and its end."""
    for code in codes:
        selector.observe(observation(task_id, int(code)))
    selector.end_task()


def live_with(selector: Selector, tau: str, tasks: int, first: int = 1) -> list[str]:
    """Names of the policies chosen in a row of tasks with a person of type tau."""
    chosen = []
    for task_id in range(first, first + tasks):
        choice = selector.select(task_id, seed=5)
        chosen.append(choice.policy)
        live(selector, task_id, run_task(choice.policy, tau, child_seed(99, tau, task_id))[1])
    return chosen


@pytest.mark.parametrize("tau", TYPES)
def test_each_type_is_recognised_and_the_choice_settles_on_its_best_policy(selector, tau) -> None:
    chosen = live_with(selector, tau, TASKS)
    assert selector.belief.most_likely == tau
    assert selector.belief.probability.max() > 0.9
    best = POLICIES[int(np.argmax(UTILITY[tau]))]
    assert chosen[-6:] == [best] * 6


def test_a_shift_change_is_noticed_within_a_few_tasks(selector) -> None:
    live_with(selector, "calm", 30)
    chosen = live_with(selector, "touchy", 6, first=31)
    assert selector.belief.most_likely == "touchy"
    assert chosen[-2:] == ["asks", "asks"]


def test_a_new_person_starts_with_the_base_policy_and_so_after_a_reset(selector) -> None:
    assert selector.select(1, 0).policy == "waits"
    assert "new person" in selector.choice.reason
    live_with(selector, "touchy", 6)
    assert selector.select(7, 0).policy == "asks"
    selector.reset()
    assert selector.belief.probability == pytest.approx([1 / 3] * 3)
    assert selector.select(8, 0).policy == "waits"


def test_the_choice_holds_score_and_expected_reward_of_every_candidate(selector, models) -> None:
    published = SelectorParameters(criterion="expected_improvement")
    selector = Selector(selector.library, models, published)
    live_with(selector, "hasty", 3)
    choice = selector.select(4, 0)
    beta = selector.belief.probability
    assert choice.candidates == list(POLICIES)
    assert choice.expected_reward == pytest.approx(beta @ models.performance.mean)
    best = choice.expected_reward.max()
    assert choice.score == pytest.approx(beta @ (1 - models.performance.cdf(best)))
    assert choice.policy == POLICIES[int(np.argmax(choice.score))]
    assert choice.path.name == f"{choice.policy}.pomdpx"
    assert "hasty" in choice.reason


def test_same_observations_and_seeds_give_the_same_choices(library, models) -> None:
    parameters = SelectorParameters(criterion="thompson")
    runs = [live_with(Selector(library, models, parameters), "calm", 8) for _ in range(2)]
    assert runs[0] == runs[1]


def test_observations_of_other_tasks_and_before_any_choice_are_ignored(selector) -> None:
    assert not selector.observe(observation(1, 33))
    selector.select(1, 0)
    selector.observe(observation(2, 33))
    assert not selector.end_task()
    assert selector.tasks_seen == 0


@pytest.mark.parametrize("event_first", [True, False])
def test_a_task_ends_with_the_later_of_final_event_and_final_observation(
    selector, event_first
) -> None:
    selector.select(1, 0)
    selector.observe(observation(1, 33))
    steps = [
        lambda: selector.on_task_event(TaskEvent(task_id=1, kind=TaskEvent.TASK_SUCCEEDED)),
        lambda: selector.observe(observation(1, 5, task_success=True)),
    ]
    ended = [step() for step in (steps if event_first else steps[::-1])]
    assert ended == [False, True]
    assert selector.tasks_seen == 1
    assert not selector.end_task()


def test_an_aborted_task_teaches_nothing(selector) -> None:
    selector.select(1, 0)
    selector.observe(observation(1, 17))
    before = selector.belief.probability
    assert not selector.on_task_event(TaskEvent(task_id=1, kind=TaskEvent.TASK_ABORTED))
    selector.select(2, 0)
    assert (selector.belief.probability == before).all()
    assert selector.tasks_seen == 0


def test_a_stranger_is_flagged_and_a_known_person_is_not_above_the_alarm_rate(
    library, models
) -> None:
    selector = Selector(library, models, SelectorParameters(alarm_rate=0.05))
    alarms = 0
    for number in range(300):
        selector.reset()
        tau = TYPES[number % 3]
        for task_id in (1, 2, 3):
            policy = selector.select(task_id, 0).policy
            live(selector, task_id, run_task(policy, tau, child_seed(7, number, task_id))[1])
        alarms += selector.unlike_anyone_known
    assert alarms <= 300 * 0.05 + 3 * np.sqrt(300 * 0.05 * 0.95)
    selector.reset()
    for task_id in (1, 2, 3):
        selector.select(task_id, 0)
        live(selector, task_id, [0, 2, 3, 35] * 3)
    choice = selector.select(4, 0)
    assert choice.unlike_anyone_known
    assert "unlike anyone known" in choice.reason


def test_fixed_and_random_selectors_do_not_start_from_the_base(library, models) -> None:
    fixed = Selector(library, models, SelectorParameters(criterion="fixed", fixed_policy="asks"))
    assert fixed.select(1, 0).policy == "asks"
    drawn = Selector(library, models, SelectorParameters(criterion="random"))
    assert {drawn.select(task_id, 0).policy for task_id in range(40)} == set(POLICIES)


def test_models_of_another_library_are_refused(library, models, index) -> None:
    (index.parent / "waits.pomdpx").write_text("changed")
    with pytest.raises(ModelsError, match="train again"):
        Selector(library, models)


def test_the_parameters_are_the_shipped_ones_unless_told() -> None:
    shipped = Path(__file__).parents[1] / "config" / "selector.yaml"
    values = yaml.safe_load(shipped.read_text(encoding="utf-8"))
    assert SelectorParameters.load(values) == SelectorParameters()


@pytest.mark.parametrize("values", [None, ["criterion"], "greedy"])
def test_parameters_without_names_are_refused(values) -> None:
    with pytest.raises(ValueError, match="must be a mapping"):
        SelectorParameters.load(values)


def test_parameters_are_refused_by_name(library, models) -> None:
    for parameters in ({"criterion": "magic"}, {"forgetting": 2.0}, {"floor": 0.5}):
        with pytest.raises(ValueError, match=next(iter(parameters.values())).__str__()):
            Selector(library, models, SelectorParameters(**parameters))
    for name, value in (("alarm_rate", 0.0), ("alarm_window", 0), ("effective_observations", 0)):
        with pytest.raises(ValueError, match=name):
            SelectorParameters(**{name: value})
    with pytest.raises(ValueError, match="'criterion' is missing"):
        SelectorParameters.load({})


@pytest.mark.parametrize(
    ("name", "value", "kind"),
    [
        ("criterion", ["greedy"], "text"),
        ("forgetting", "little", "a number"),
        ("alarm_rate", None, "a number"),
        ("switch_margin", True, "a number"),
        ("alarm_window", 2.5, "a whole number"),
        ("switch_inside", 1, "true or false"),
    ],
)
def test_a_parameter_of_another_kind_is_refused_by_name_and_value(name, value, kind) -> None:
    with pytest.raises(ValueError) as caught:
        SelectorParameters.load(vars(SelectorParameters()) | {name: value})
    assert str(caught.value) == f"parameter '{name}' must be {kind}, got {value!r}"
    assert SelectorParameters.load(vars(SelectorParameters()) | {"forgetting": 0})


def test_a_failed_attempt_is_seen_in_the_rising_count_only_once() -> None:
    encoder = SignalEncoder()
    counts = (0, 1, 1, 2, 0)
    codes = [encoder.encode(Observation(detected=True, failed_attempts=n)) for n in counts]
    assert codes == [1, 9, 1, 9, 1]
    assert code_name(9) == "detected, grasp failed"
    assert encoder.encode(Observation()) == 0
    with pytest.raises(ValueError, match="64"):
        code_name(64)
