# SPDX-License-Identifier: BSD-3-Clause
"""Whatever the percepts, every event is observed exactly once."""

from itertools import pairwise

from hypothesis import given, settings
from hypothesis import strategies as st
from scene import Scene

from fabric_msgs.msg import HumanActivity, Observation, TaskEvent

PERCEPT = st.tuples(
    st.integers(0, 3), st.sampled_from([0.3, 0.6, 0.9]), st.booleans(), st.booleans()
)
EVENT = st.sampled_from(
    [
        (TaskEvent.SUBTASK_STARTED, TaskEvent.BY_NOBODY),
        (TaskEvent.SUBTASK_SUCCEEDED, TaskEvent.BY_PERSON),
        (TaskEvent.SUBTASK_FAILED, TaskEvent.BY_ROBOT),
        (TaskEvent.WARNING, TaskEvent.BY_PERSON),
    ]
)
STREAM = st.lists(st.one_of(PERCEPT, EVENT), max_size=120)
ENDS = (TaskEvent.SUBTASK_SUCCEEDED, TaskEvent.SUBTASK_FAILED)


def play(stream: list[tuple]) -> tuple[Scene, int]:
    """Play a stream; return the scene and the number of subtasks that ended."""
    scene = Scene(subtasks=1000)
    for item in stream:
        if len(item) == 2:
            scene.event(*item)
        else:
            gesture, probability, detected, looking = item
            scene.percepts(gesture, probability=probability, detected=detected, looking=looking)
    return scene, sum(len(item) == 2 and item[0] in ENDS for item in stream)


@settings(max_examples=150, deadline=None)
@given(STREAM)
def test_every_container_event_is_observed_exactly_once(stream):
    scene, ended = play(stream)
    results = [o for o in scene.seen if o.trigger == Observation.TRIGGER_SUBTASK]
    assert len(results) == ended
    for observation in scene.seen:
        told = observation.subtask_success + observation.robot_failure
        assert told == (observation.trigger == Observation.TRIGGER_SUBTASK)


@settings(max_examples=150, deadline=None)
@given(STREAM)
def test_numbers_have_no_gaps_and_stamps_never_fall(stream):
    scene, _ = play(stream)
    assert [o.sequence for o in scene.seen] == list(range(1, len(scene.seen) + 1))
    stamps = [o.header.stamp.to_sec() for o in scene.seen]
    assert stamps == sorted(stamps)


@settings(max_examples=150, deadline=None)
@given(STREAM)
def test_two_warning_interrupts_have_an_end_between_them(stream):
    scene, _ = play(stream)
    warned = False
    for observation in scene.seen:
        if observation.trigger == Observation.TRIGGER_WARNING:
            assert not warned
        if observation.trigger != Observation.TRIGGER_SUBTASK:
            warned = observation.warning


@settings(max_examples=150, deadline=None)
@given(STREAM)
def test_at_most_one_gesture_is_true(stream):
    scene, _ = play(stream)
    for observation in scene.seen:
        assert observation.grasp_attempt + observation.warning + observation.idle <= 1


@settings(max_examples=150, deadline=None)
@given(st.lists(PERCEPT, min_size=31, max_size=120))
def test_with_a_cube_there_silence_never_exceeds_the_timeout(stream):
    scene, _ = play(stream)
    stamps = [observation.header.stamp.to_sec() for observation in scene.seen] + [scene.t]
    assert all(after - before <= 3.0 + 1e-6 for before, after in pairwise(stamps))


def test_the_gesture_constants_are_those_of_the_tests():
    gestures = (HumanActivity.IDLE, HumanActivity.GRASP, HumanActivity.WARN, HumanActivity.OTHER)
    assert gestures == (0, 1, 2, 3)
