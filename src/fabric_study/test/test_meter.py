# SPDX-License-Identifier: BSD-3-Clause
"""Rows of results.csv against tables worked out by hand (Eq. 6.1 to 6.6)."""

import itertools
import random

import pytest

from fabric_msgs.msg import (
    Decision,
    GroundTruth,
    ModelInfo,
    Observation,
    PolicyChoice,
    TaskEvent,
    TaskState,
    TypeBelief,
)
from fabric_study.meter import COLUMNS, TaskMeter
from fabric_study.stamps import to_stamp

RIGHT, WRONG = TaskEvent.SUBTASK_SUCCEEDED, TaskEvent.SUBTASK_FAILED
PERSON, ROBOT, NOBODY = TaskEvent.BY_PERSON, TaskEvent.BY_ROBOT, TaskEvent.BY_NOBODY
CHANGE, SUBTASK = Observation.TRIGGER_ACTION_CHANGE, Observation.TRIGGER_SUBTASK
WARNING = Observation.TRIGGER_WARNING
WARNS = "warns_the_robot"
STATES = ["task_assigned_to_human", "may_be_tired", "may_be_distracted", "needs_help"]


class Record:
    """The messages of one task, to be fed to a meter in any order."""

    def __init__(self, scenario="sorting", subtasks=3):
        self.state = TaskState(
            sequence=1, task_id=4, seed=99, scenario=scenario, subtasks_total=subtasks
        )
        self.messages = []
        self.counter = itertools.count(1)

    def add(self, handler, message, t, **fields):
        message.header.stamp = to_stamp(t)
        message.sequence = next(self.counter)
        message.task_id = 4
        for name, value in fields.items():
            setattr(message, name, value)
        self.messages.append((handler, message))
        return message

    def event(self, t, kind, by=NOBODY):
        self.add("on_event", TaskEvent(), t, kind=kind, by=by)

    def observe(self, t, trigger, belief=(1.0, 0.0, 0.0, 0.0), model="m", **fields):
        observation = self.add("on_observation", Observation(), t, trigger=trigger, **fields)
        decision = self.add("on_decision", Decision(), t, belief=list(belief), model_hash=model)
        decision.sequence = decision.observation_sequence = observation.sequence

    def truth(self, t, word, human="expert", state="evaluating"):
        fields = {"anticipated_state": word, "human_type": human, "state": state}
        self.add("on_truth", GroundTruth(), t, **fields)

    def states(self, *states):
        """The person's true states, 1 s apart from 0 s on."""
        for t, state in enumerate(states):
            self.truth(t, "", state=state)

    def end(self, t, kind, duration):
        self.event(t, kind)
        state = TaskState(**{name: getattr(self.state, name) for name in TaskState.__slots__})
        state.sequence, state.duration = 9, duration
        self.messages.append(("on_state", state))

    def meter(self, order=None, policy="proactive"):
        meter = TaskMeter(self.state, "somebody", policy)
        messages = list(self.messages)
        if order is not None:
            random.Random(order).shuffle(messages)
        for handler, message in messages:
            getattr(meter, handler)(message)
        return meter

    def row(self, order=None):
        return self.meter(order).row()


def inspection():
    """Observations at 0, 3, 5 (a warning, told at 5), 8, and the robot's success at 10 s."""
    record = Record("inspection", 1)
    record.event(0.0, TaskEvent.TASK_STARTED)
    record.observe(0.0, Observation.TRIGGER_START)
    record.event(1.0, TaskEvent.SUBTASK_STARTED)
    record.observe(3.0, Observation.TRIGGER_TIMEOUT)
    record.event(5.0, TaskEvent.WARNING, PERSON)
    record.observe(5.0, WARNING)
    record.observe(8.0, CHANGE)
    record.event(10.0, RIGHT, ROBOT)
    record.observe(10.0, SUBTASK, task_success=True)
    record.end(10.0, TaskEvent.TASK_SUCCEEDED, 10.0)
    return record


def sorting():
    """Three subtasks: person right, person wrong with a change in the same instant, robot right."""
    record = Record()
    record.event(0.0, TaskEvent.TASK_STARTED)
    record.observe(0.1, Observation.TRIGGER_START)  # subtask 1, step 0
    record.observe(2.0, CHANGE)  # step 1
    record.event(4.0, RIGHT, PERSON)
    record.observe(4.0, SUBTASK)  # step 2: +6
    record.event(6.0, WRONG, PERSON)
    record.observe(6.0, SUBTASK)  # subtask 2, step 0: -6
    record.observe(6.0, CHANGE)  # subtask 3, step 0
    record.event(7.0, TaskEvent.WARNING, PERSON)
    record.observe(7.0, WARNING)  # step 1: -3
    record.observe(9.0, CHANGE)  # step 2
    record.event(12.0, RIGHT, ROBOT)
    record.observe(12.0, SUBTASK, task_success=True)  # step 3: +6
    record.end(12.0, TaskEvent.TASK_SUCCEEDED, 12.0)
    return record


def test_the_reward_of_an_inspection_task_is_the_one_worked_out_by_hand():
    expected = -3 * 0.98**2 + 6 * 0.98**4
    assert expected == pytest.approx(2.65300896)
    assert inspection().row()["discounted_reward"] == pytest.approx(expected, abs=1e-12)


def test_the_reward_of_a_sorting_task_restarts_its_discount_at_each_subtask():
    expected = 6 * 0.98**2 - 6 - 3 * 0.98 + 6 * 0.98**3
    assert expected == pytest.approx(2.469552)
    assert sorting().row()["discounted_reward"] == pytest.approx(expected, abs=1e-12)


def test_a_failed_inspection_costs_three_and_a_failed_sorting_subtask_six():
    for scenario, reward in (("inspection", -3.0), ("sorting", -6.0)):
        record = Record(scenario, 1)
        record.event(1.0, WRONG)
        record.observe(1.0, SUBTASK, task_failure=True)
        record.end(1.0, TaskEvent.TASK_FAILED, 1.0)
        assert record.row()["discounted_reward"] == reward


def test_a_warning_after_the_last_subtask_counts_in_the_sum_of_the_rest():
    record = Record()
    record.observe(1.0, Observation.TRIGGER_START)
    record.event(2.0, RIGHT, PERSON)
    record.observe(2.0, SUBTASK)
    record.event(3.0, TaskEvent.WARNING, PERSON)
    assert record.row()["discounted_reward"] == pytest.approx(6 * 0.98 - 3)


def test_a_warning_that_nobody_recognised_is_counted_and_charged_when_it_was_given():
    record = Record("inspection", 1)
    record.states("evaluating", "evaluating", WARNS, WARNS, "robot_receives_the_warning")
    record.observe(0.5, Observation.TRIGGER_START)
    record.observe(1.5, CHANGE)
    record.event(5.0, RIGHT, ROBOT)
    row = record.row()
    assert (row["warnings"], row["false_warnings"]) == (1, 0)
    assert row["discounted_reward"] == pytest.approx(-3 * 0.98**2 + 6 * 0.98**2)


def test_a_warning_counts_in_the_subtask_in_which_it_was_given():
    record = Record()
    record.states("evaluating", "evaluating", WARNS, "evaluating", WARNS)
    record.observe(0.5, Observation.TRIGGER_START)
    record.event(3.0, RIGHT, PERSON)
    record.observe(3.0, SUBTASK)
    assert record.row()["discounted_reward"] == pytest.approx((6 - 3) * 0.98 - 3)


def test_a_person_who_warns_again_after_a_pause_warns_twice():
    record = Record()
    record.states(WARNS, WARNS, "evaluating", WARNS, "evaluating")
    assert record.row()["warnings"] == 2


def test_a_recognised_warning_that_nobody_gave_is_false_and_costs_nothing():
    record = Record()
    record.states(WARNS, *["evaluating"] * 12)
    record.event(5.9, TaskEvent.WARNING, PERSON)  # 5 s after the person stopped to warn
    record.event(6.0, TaskEvent.WARNING, PERSON)
    row = record.row()
    assert (row["warnings"], row["false_warnings"]) == (1, 1)
    assert row["discounted_reward"] == -3.0


def test_without_the_truth_warnings_are_the_recognised_ones_and_none_can_be_called_false():
    row = sorting().row()
    assert (row["warnings"], row["false_warnings"]) == (1, None)


def test_equations_6_3_to_6_6_by_hand():
    row = sorting().row()
    assert row["human_contribution"] == pytest.approx(1 / 3)  # Eq. 6.3
    assert row["task_success_rate"] == pytest.approx(2 / 3)  # Eq. 6.4
    assert row["efficiency"] == pytest.approx(2 / 9)  # Eq. 6.5
    assert row["human_success_rate"] == pytest.approx(1 / 2)  # Eq. 6.6


def test_the_row_holds_the_columns_in_order_and_counts_everything_once():
    row = sorting().row()
    assert tuple(row) == COLUMNS
    head = [row[name] for name in COLUMNS[:6]]
    assert head == [4, 99, "sorting", "somebody", "proactive", "proactive"]
    counts = [row[name] for name in COLUMNS[12:16]]
    assert counts == [1, 1, 1, 0]
    assert (row["success"], row["warnings"], row["decisions"]) == (1, 1, 8)
    assert row["duration_s"] == 12.0


def test_the_order_of_arrival_across_topics_does_not_matter():
    for record in (inspection(), sorting()):
        expected = record.row()
        assert all(record.row(order) == expected for order in range(20))


def test_the_belt_counts_as_a_failure_of_the_robot():
    record = Record("inspection", 1)
    record.event(60.0, WRONG, NOBODY)
    record.end(60.0, TaskEvent.TASK_FAILED, 60.0)
    row = record.row()
    assert (row["robot_failed"], row["human_failed"], row["success"]) == (1, 0, 0)


def test_what_is_undefined_is_none():
    record = Record(subtasks=0)
    record.event(1.0, TaskEvent.TASK_ABORTED)
    row = record.row()
    names = ["success", "human_success_rate", "human_contribution", "task_success_rate"]
    names += ["efficiency", "stage1_accuracy", "stage2_accuracy", "type_belief_entropy"]
    assert [row[name] for name in names] == [None] * 8
    assert row["discounted_reward"] == 0.0


def accuracies(model_states, *steps):
    """Row accuracies over steps (true state, index of the believed state) 1 s apart."""
    record = Record()
    for number, (truth, believed) in enumerate(steps):
        belief = [0.1] * 4
        belief[believed] = 0.7
        record.truth(number, truth)
        record.observe(number + 0.5, CHANGE, belief)
    meter = record.meter()
    meter.on_model(ModelInfo(hash="m", states=model_states))
    row = meter.row()
    return row["stage1_accuracy"], row["stage2_accuracy"]


def test_stage_accuracies_judge_only_moments_in_which_the_truth_is_of_the_stage():
    steps = [
        ("may_be_tired", 1),
        ("may_be_tired", 2),
        ("may_be_distracted", 2),
        ("needs_help", 3),
        ("needs_help", 1),
        ("task_assigned_to_human", 1),
        ("warning_received", 0),
    ]
    assert accuracies(STATES, *steps) == (pytest.approx(2 / 3), pytest.approx(1 / 2))


def test_a_model_without_the_stage_is_not_judged_on_it():
    reactive = ["task_assigned_to_human", "warning_received", "global_fail", "needs_help"]
    assert accuracies(reactive, ("may_be_tired", 0), ("needs_help", 3)) == (None, 1.0)


def test_without_the_truth_or_the_names_there_is_no_accuracy():
    assert accuracies([], ("may_be_tired", 1)) == (None, None)
    record = Record()
    record.observe(1.0, CHANGE)
    assert record.row()["stage1_accuracy"] is None


def test_the_truth_of_a_moment_is_the_newest_not_later_than_the_observation():
    record = Record()
    record.truth(1.0, "needs_help")
    record.observe(1.0, CHANGE, (0.0, 0.0, 0.0, 1.0))
    record.truth(1.1, "may_be_tired")
    meter = record.meter()
    meter.on_model(ModelInfo(hash="m", states=STATES))
    row = meter.row()
    assert (row["stage1_accuracy"], row["stage2_accuracy"]) == (None, 1.0)


def test_the_truth_names_the_person():
    record = Record()
    record.truth(1.0, "needs_help", human="0.1,0.2,0.3,0.4")
    assert record.row()["human"] == "0.1,0.2,0.3,0.4"


def test_the_selected_policy_and_the_type_belief_of_the_task_are_kept():
    meter = Record().meter(policy="abps")
    meter.on_policy(PolicyChoice(task_id=3, policy="old"))
    meter.on_policy(PolicyChoice(task_id=4, policy="reminding"))
    meter.on_type_belief(TypeBelief(task_id=3, entropy=0.5))
    meter.on_type_belief(TypeBelief(task_id=4, entropy=1.5))
    row = meter.row()
    assert (row["policy"], row["model"], row["type_belief_entropy"]) == ("abps", "reminding", 1.5)


@pytest.mark.parametrize(
    "policy, name",
    [
        ("abps", "abps"),
        ("models/mine.POMDPx", "mine"),
        ("b/tiger.pomdp", "tiger"),
        ("v1.2", "v1.2"),
    ],
)
def test_a_model_file_goes_by_its_name(policy, name):
    row = Record().meter(policy=policy).row()
    assert (row["policy"], row["model"]) == (name, name)


def test_messages_of_other_tasks_are_ignored():
    record = sorting()
    expected = record.row()
    stray = TaskEvent(task_id=5, sequence=77, kind=TaskEvent.WARNING)
    record.messages.append(("on_event", stray))
    assert record.row() == expected


def test_a_task_is_complete_when_every_observation_is_decided_on_and_names_are_known():
    record = inspection()
    meter = record.meter()
    assert not meter.complete()
    meter.on_model(ModelInfo(hash="m", states=STATES))
    assert meter.complete()
    selected = record.meter(policy="abps")
    selected.on_model(ModelInfo(hash="m", states=STATES))
    assert not selected.complete()
    selected.on_type_belief(TypeBelief(task_id=4, entropy=1.5))
    assert selected.complete()
    undecided = Record()
    undecided.add("on_observation", Observation(), 1.0, task_success=True)
    assert not undecided.meter().complete()
    running = Record()
    running.observe(1.0, CHANGE)
    assert not running.meter().complete()


def test_an_unknown_scenario_is_refused():
    with pytest.raises(ValueError, match="scenario 'moon'; known are inspection, sorting"):
        TaskMeter(TaskState(scenario="moon"), "", "")
