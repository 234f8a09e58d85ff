# SPDX-License-Identifier: BSD-3-Clause
"""The trigger logic of Fig. 6.5 and the observables of Tables 6.2 and 6.3, one test a sentence."""

import math

import pytest
from scene import GRASP, IDLE, OTHER, STEP, WARN, Scene, activity, event, head

from fabric_msgs.msg import Observation, TaskEvent, TaskState
from fabric_perception.observation_agent import ObservationAgent
from fabric_perception.parameters import ObservationParameters

START, CHANGE = Observation.TRIGGER_START, Observation.TRIGGER_ACTION_CHANGE
SUBTASK, WARNING = Observation.TRIGGER_SUBTASK, Observation.TRIGGER_WARNING
TIMEOUT = Observation.TRIGGER_TIMEOUT
PERSON, ROBOT, NOBODY = TaskEvent.BY_PERSON, TaskEvent.BY_ROBOT, TaskEvent.BY_NOBODY


def triggers(observations):
    return [observation.trigger for observation in observations]


def flags(observation):
    """O1..O9 as a string of digits."""
    names = (
        "task_success task_failure detected looking_around grasp_attempt warning idle "
        "subtask_success subtask_failure"
    )
    return "".join(str(int(getattr(observation, name))) for name in names.split())


def test_the_first_percept_with_a_cube_is_observed():
    assert triggers(Scene().percepts(IDLE)) == [START]


def test_waiting_for_the_belt_is_not_observed():
    scene = Scene(cube=False)
    assert scene.percepts(IDLE, 40) + scene.percepts(GRASP, 5) == []
    scene.event(TaskEvent.SUBTASK_STARTED)
    assert triggers(scene.percepts(GRASP)) == [START]
    scene.event(TaskEvent.SUBTASK_SUCCEEDED, PERSON)
    assert scene.percepts(IDLE, 40, looking=True) == []


def test_a_warning_interrupts_between_two_cubes_too():
    scene = Scene()
    scene.percepts(IDLE)
    scene.event(TaskEvent.SUBTASK_SUCCEEDED, PERSON)
    assert triggers(scene.percepts(WARN, 2)) == [WARNING]


def test_nothing_is_observed_before_the_task_has_started():
    agent = ObservationAgent()
    agent.start_task(0.0, TaskState(task_id=1, subtasks_total=1))
    assert agent.on_percepts(0.1, activity(WARN), head()) == []


@pytest.mark.parametrize(
    "gesture, trigger", [(GRASP, CHANGE), (WARN, WARNING), (OTHER, CHANGE), (IDLE, None)]
)
def test_another_gesture_is_observed_when_two_percepts_agree(gesture, trigger):
    scene = Scene()
    scene.percepts(IDLE)
    assert scene.percepts(gesture, 1) == []
    assert triggers(scene.percepts(gesture, 1)) == ([] if trigger is None else [trigger])


def test_a_single_odd_percept_changes_nothing():
    scene = Scene()
    scene.percepts(IDLE)
    for _ in range(5):
        assert scene.percepts(GRASP, 1) + scene.percepts(IDLE, 1) == []


def test_a_gesture_below_the_threshold_is_undefined():
    scene = Scene()
    scene.percepts(IDLE)
    (observation,) = scene.percepts(GRASP, 2, probability=0.4)
    assert flags(observation) == "001000000"


def test_the_time_out_comes_three_seconds_after_the_last_observation():
    scene = Scene()
    scene.percepts(IDLE)
    assert scene.percepts(IDLE, 29) == []
    assert triggers(scene.percepts(IDLE, 1)) == [TIMEOUT]
    assert scene.percepts(IDLE, 29) == []
    assert triggers(scene.percepts(IDLE, 1)) == [TIMEOUT]


def test_a_change_restarts_the_time_out():
    scene = Scene()
    scene.percepts(IDLE, 20)
    scene.percepts(GRASP, 2)
    assert scene.percepts(GRASP, 29) == []
    assert triggers(scene.percepts(GRASP, 1)) == [TIMEOUT]


def test_looking_around_counts_when_two_percepts_agree():
    scene = Scene()
    scene.percepts(IDLE)
    assert scene.percepts(IDLE, 1, looking=True) == []
    (observation,) = scene.percepts(IDLE, 1, looking=True)
    assert observation.trigger == CHANGE
    assert flags(observation) == "001100100"


def test_a_helmet_out_of_view_says_nothing_about_the_head():
    scene = Scene()
    scene.percepts(IDLE)
    scene.percepts(IDLE, 3, looking=True)
    assert scene.percepts(IDLE, 10, looking=False, visible=False) == []


def test_a_person_who_leaves_is_not_detected():
    scene = Scene()
    scene.percepts(IDLE)
    (observation,) = scene.percepts(IDLE, 3, detected=False)
    assert flags(observation) == "000000100"


def test_old_evidence_is_not_used():
    scene = Scene()
    scene.percepts(IDLE)
    assert scene.percepts(GRASP, 10, age=1.5) == []


@pytest.mark.parametrize(
    "kind, by, expected, robot",
    [
        (TaskEvent.SUBTASK_SUCCEEDED, PERSON, "001010010", (False, False)),
        (TaskEvent.SUBTASK_FAILED, PERSON, "001010001", (False, False)),
        (TaskEvent.SUBTASK_SUCCEEDED, ROBOT, "001010000", (True, False)),
        (TaskEvent.SUBTASK_FAILED, ROBOT, "001010000", (False, True)),
        (TaskEvent.SUBTASK_FAILED, NOBODY, "001010000", (False, False)),
    ],
)
def test_a_container_event_is_observed_at_once(kind, by, expected, robot):
    scene = Scene()
    scene.percepts(GRASP)
    (observation,) = scene.event(kind, by)
    assert observation.trigger == SUBTASK
    assert flags(observation) == expected
    assert (observation.robot_success, observation.robot_failure) == robot


@pytest.mark.parametrize(
    "kind, by, end, expected",
    [
        (TaskEvent.SUBTASK_SUCCEEDED, PERSON, TaskEvent.TASK_SUCCEEDED, "101000110"),
        (TaskEvent.SUBTASK_SUCCEEDED, ROBOT, TaskEvent.TASK_SUCCEEDED, "101000100"),
        (TaskEvent.SUBTASK_FAILED, PERSON, TaskEvent.TASK_FAILED, "011000101"),
        (TaskEvent.SUBTASK_FAILED, NOBODY, TaskEvent.TASK_FAILED, "011000100"),
    ],
)
def test_the_last_subtask_and_the_end_are_one_observation(kind, by, end, expected):
    scene = Scene(subtasks=1)
    scene.percepts(IDLE)
    assert scene.event(kind, by) == []
    (observation,) = scene.event(end)
    assert flags(observation) == expected
    assert observation.trigger == SUBTASK


def test_nothing_is_observed_after_the_end():
    scene = Scene(subtasks=1)
    scene.percepts(IDLE)
    scene.event(TaskEvent.SUBTASK_SUCCEEDED, PERSON)
    scene.event(TaskEvent.TASK_SUCCEEDED)
    assert scene.percepts(GRASP, 50) + scene.event(TaskEvent.WARNING, PERSON) == []


def test_an_aborted_task_ends_without_an_observation():
    scene = Scene()
    scene.percepts(IDLE)
    assert scene.event(TaskEvent.TASK_ABORTED) + scene.percepts(GRASP, 40) == []


def test_a_warning_by_the_fast_road_is_one_interrupt():
    scene = Scene()
    scene.percepts(IDLE)
    assert scene.event(TaskEvent.WARNING, PERSON, ahead=STEP) == []
    (observation,) = scene.percepts(IDLE, 1)
    assert observation.trigger == WARNING
    assert flags(observation) == "001001000"
    assert scene.percepts(WARN, 20) == []


def test_a_warning_whose_percepts_were_here_before_it_does_not_wait_for_others():
    early, late = Scene(), Scene()
    for scene in (early, late):
        scene.percepts(IDLE)
    early.event(TaskEvent.WARNING, PERSON, ahead=STEP)
    early.percepts(IDLE)
    late.percepts(IDLE)
    (observation,) = late.event(TaskEvent.WARNING, PERSON)
    assert observation == early.seen[-1]
    assert late.percepts(WARN, 20) == early.percepts(WARN, 20) == []


def test_a_warning_seen_first_is_not_interrupted_again_by_the_fast_road():
    scene = Scene()
    scene.percepts(IDLE)
    assert triggers(scene.percepts(WARN, 2)) == [WARNING]
    assert scene.event(TaskEvent.WARNING, PERSON) + scene.percepts(WARN, 20) == []


def test_a_warning_that_the_classifier_is_slow_to_see_is_still_one():
    scene = Scene()
    scene.percepts(IDLE)
    scene.event(TaskEvent.WARNING, PERSON, ahead=STEP)
    assert triggers(scene.percepts(IDLE, 8) + scene.percepts(WARN, 15)) == [WARNING]


def test_the_end_of_a_warning_is_a_change_and_the_next_one_interrupts_again():
    scene = Scene()
    scene.percepts(IDLE)
    scene.event(TaskEvent.WARNING, PERSON, ahead=STEP)
    assert triggers(scene.percepts(WARN, 15) + scene.percepts(IDLE, 2)) == [WARNING, CHANGE]
    scene.event(TaskEvent.WARNING, PERSON, ahead=STEP)
    assert triggers(scene.percepts(WARN, 5)) == [WARNING]


def test_a_call_is_observed_as_a_raised_hand_whether_seen_or_by_the_button():
    warned, called = Scene(), Scene()
    for scene, kind in ((warned, TaskEvent.WARNING), (called, TaskEvent.CALL)):
        scene.percepts(IDLE)
        assert triggers(scene.event(kind, PERSON)) == [WARNING]
        assert scene.percepts(IDLE, 20)[0].trigger == CHANGE
    assert called.seen == warned.seen
    assert [observation.warning for observation in called.seen[-2:]] == [True, False]


def failed(observations):
    return [observation.failed_attempts for observation in observations]


def test_a_grasp_that_ends_without_a_placement_has_failed_once_the_containers_have_settled():
    scene = Scene(ObservationParameters(same_action_timeout=1.0))
    scene.percepts(GRASP, 2)
    seen = scene.percepts(IDLE, 42)
    assert triggers(seen) == [CHANGE, TIMEOUT, CHANGE, TIMEOUT, TIMEOUT]
    assert failed(seen) == [0, 0, 1, 1, 1]


def test_a_decision_is_due_as_soon_as_an_attempt_has_failed():
    scene = Scene()
    scene.percepts(GRASP, 2)
    seen = scene.percepts(IDLE, 25)
    assert triggers(seen) == [CHANGE, CHANGE]
    assert failed(seen) == [0, 1]
    assert seen[1].header.stamp.to_sec() - seen[0].header.stamp.to_sec() == pytest.approx(2.0)


def test_a_placement_is_no_failed_attempt_even_when_it_is_reported_late():
    scene = Scene()
    scene.percepts(GRASP, 2)
    ends = scene.percepts(IDLE, 16)
    placed = scene.event(TaskEvent.SUBTASK_SUCCEEDED, PERSON)
    later = scene.percepts(IDLE, 40)
    assert set(failed(ends + placed + later)) == {0}


def test_an_attempt_has_failed_when_the_person_reaches_again():
    scene = Scene()
    scene.percepts(GRASP, 2)
    scene.percepts(IDLE, 2)
    assert failed(scene.percepts(GRASP, 2)) == [1]


def test_a_person_who_reaches_on_for_the_next_cube_can_fail_with_it():
    scene = Scene()
    scene.percepts(GRASP, 2)
    scene.event(TaskEvent.SUBTASK_SUCCEEDED, PERSON)
    scene.event(TaskEvent.SUBTASK_STARTED)
    assert failed(scene.percepts(IDLE, 32)) == [0, 1]


def test_a_warning_wipes_the_failed_attempts_and_restarts_the_waiting():
    scene = Scene()
    scene.percepts(GRASP, 2)
    assert failed(scene.percepts(IDLE, 32)) == [0, 1]
    (warning,) = scene.percepts(WARN, 2)
    (ended,) = scene.percepts(IDLE, 2)
    (later,) = scene.percepts(IDLE, 30)
    assert failed((warning, ended, later)) == [0, 0, 0]
    assert [item.waiting_time for item in (warning, ended)] == [0.0, 0.0]
    assert later.waiting_time == pytest.approx(3.0)
    assert later.subtask_elapsed == pytest.approx(6.8)


def test_the_clock_of_a_subtask_runs_from_the_arrival_of_its_cube():
    scene = Scene(cube=False)
    scene.percepts(IDLE, 9)
    scene.event(TaskEvent.SUBTASK_STARTED)
    start, timeout = scene.percepts(IDLE, 31)
    (placed,) = scene.event(TaskEvent.SUBTASK_FAILED, ROBOT)
    (warning,) = scene.percepts(WARN, 2)
    elapsed = [item.subtask_elapsed for item in (start, timeout, placed, warning)]
    assert elapsed == pytest.approx([0.1, 3.1, 3.1, 0.0])


def test_numbers_go_on_across_tasks_and_the_rest_is_forgotten():
    scene = Scene(subtasks=1)
    scene.percepts(GRASP, 2)
    scene.event(TaskEvent.SUBTASK_SUCCEEDED, PERSON)
    scene.event(TaskEvent.TASK_SUCCEEDED)
    scene.begin(2)
    scene.percepts(IDLE)
    assert [item.sequence for item in scene.seen] == [1, 2, 3]
    assert [item.task_id for item in scene.seen] == [1, 1, 2]
    assert scene.seen[-1].trigger == START
    assert scene.seen[-1].failed_attempts == 0


def test_events_of_another_task_are_ignored():
    scene = Scene()
    scene.percepts(IDLE)
    stray = event(TaskEvent.WARNING, PERSON, task_id=7)
    assert scene.agent.on_task_event(scene.t, stray) == []


def test_the_stamp_is_the_moment_to_the_microsecond():
    agent = ObservationAgent()
    agent.start_task(12.0, TaskState(task_id=1, subtasks_total=1))
    agent.on_task_event(12.0, event(TaskEvent.TASK_STARTED))
    agent.on_task_event(12.0, event(TaskEvent.SUBTASK_STARTED))
    (observation,) = agent.on_percepts(12.35, activity(IDLE), head())
    assert observation.header.stamp.to_nsec() == 12_350_000_000


@pytest.mark.parametrize(
    "posterior, message",
    [
        ([math.nan, 0.5, 0.5, 0.0], r"posterior\[0\] is nan"),
        ([0.5, math.inf, 0.5, 0.0], r"posterior\[1\] is inf"),
        ([1.2, 0.0, -0.2, 0.0], r"posterior\[2\] is -0.2"),
        ([0.5, 0.5, 0.5, 0.5], "sums to 2.0"),
        ([1.0], "has 1 entries"),
    ],
)
def test_a_malformed_posterior_is_refused_by_name(posterior, message):
    scene = Scene()
    percept = activity(IDLE)
    percept.posterior = posterior
    with pytest.raises(ValueError, match=message):
        scene.agent.on_percepts(0.1, percept, head())


def test_an_age_that_is_no_number_is_refused():
    with pytest.raises(ValueError, match="evidence_age is nan"):
        Scene().agent.on_percepts(0.1, activity(IDLE, age=math.nan), head())


def test_time_must_be_finite_and_not_run_backwards():
    scene = Scene()
    scene.percepts(IDLE, 5)
    with pytest.raises(ValueError, match="backwards from 0.5 s to 0.4 s"):
        scene.agent.on_percepts(0.4, activity(IDLE), head())
    with pytest.raises(ValueError, match="time is nan"):
        scene.agent.on_percepts(math.nan, activity(IDLE), head())


def test_the_timeout_follows_its_parameter():
    scene = Scene(ObservationParameters(same_action_timeout=0.5))
    scene.percepts(IDLE)
    assert triggers(scene.percepts(IDLE, 5)) == [TIMEOUT]
