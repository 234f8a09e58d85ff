# SPDX-License-Identifier: BSD-3-Clause
"""Features of the hand: what they are, at which rate they come, what is not believed."""

import numpy as np
import pytest
from gesture_data import PICK_POINT, recording

from fabric_perception.gestures.features import FeatureExtractor, FeatureSettings, features_of

SETTINGS = FeatureSettings(pick_point=tuple(PICK_POINT))
STILL = np.array([0.5, 0.1, 0.1])


def frames_of(path, rate, settings=SETTINGS, target=None):
    """Features of a hand at path(t) for 3 s at `rate` images a second."""
    extractor = FeatureExtractor(settings)
    steps = [extractor.step(k / rate, path(k / rate), target) for k in range(round(3 * rate))]
    return [frame for due, frame in steps if due]


@pytest.mark.parametrize("rate", [10.0, 15.0, 30.0])
def test_ten_frames_a_second_come_out_at_any_rate_of_the_camera(rate):
    assert len(frames_of(lambda t: STILL, rate)) == pytest.approx(30, abs=1)


@pytest.mark.parametrize("rate", [10.0, 30.0])
def test_an_even_movement_gives_its_place_and_velocity_and_no_swing(rate):
    velocity = np.array([0.1, -0.2, 0.05])
    frame = frames_of(lambda t: STILL + t * velocity, rate)[-1]
    last = STILL + velocity * (3.0 - 1.0 / rate)
    assert frame[3:6] == pytest.approx(last - np.array(SETTINGS.rest), abs=0.03)
    assert frame[6:9] == pytest.approx(velocity, abs=1e-9)
    assert frame[9] == pytest.approx(0.0, abs=1e-3)


def test_waving_swings_more_than_reaching_though_it_gets_nowhere():
    waving = frames_of(lambda t: STILL + (0.0, 0.06 * np.sin(10.0 * t), 0.0), 30.0)[-1]
    reaching = frames_of(lambda t: STILL + (0.2 * t, 0.0, 0.0), 30.0)[-1]
    assert waving[9] > 0.3 > 0.1 > reaching[9]


def test_the_object_is_the_one_seen_else_the_pick_point():
    with_cube = frames_of(lambda t: STILL, 30.0, target=(0.3, 0.0, 0.1))[-1]
    without = frames_of(lambda t: STILL, 30.0)[-1]
    assert with_cube[:3] == pytest.approx(STILL - (0.3, 0.0, 0.1))
    assert without[:3] == pytest.approx(STILL - PICK_POINT)


def test_the_thesis_features_are_two_distances_and_a_speed():
    thesis = FeatureSettings(kind="thesis", pick_point=tuple(PICK_POINT))
    frame = frames_of(lambda t: STILL, 30.0, thesis)[-1]
    camera = np.linalg.norm(STILL - np.array(thesis.camera))
    assert frame == pytest.approx([np.linalg.norm(STILL - PICK_POINT), 0.0, camera], abs=1e-9)


def test_a_hand_that_is_lost_for_a_moment_is_where_it_was_then_nowhere():
    extractor = FeatureExtractor(SETTINGS)
    extractor.step(0.0, STILL, None)
    assert extractor.step(0.1, None, None)[1] is not None
    assert extractor.step(0.3, None, None) == (True, None)
    assert extractor.seen == 0.0


def test_a_jump_that_no_hand_can_make_is_not_believed():
    extractor = FeatureExtractor(SETTINGS)
    extractor.step(0.0, STILL, None)
    _, frame = extractor.step(0.1, STILL + 0.9, None)
    assert frame[3:6] == pytest.approx(STILL - np.array(SETTINGS.rest))


@pytest.mark.parametrize(
    ("t", "hand", "target", "words"),
    [
        (np.nan, STILL, None, "t is nan"),
        (0.0, STILL, None, "not after"),
        (1.0, (np.nan, 0.0, 0.0), None, "hand is"),
        (1.0, (0.0, 0.0), None, "hand is"),
        (1.0, STILL, (np.inf, 0.0, 0.0), "target is"),
    ],
)
def test_damaged_input_is_refused(t, hand, target, words):
    extractor = FeatureExtractor(SETTINGS)
    extractor.step(0.0, STILL, None)
    with pytest.raises(ValueError, match=words):
        extractor.step(t, hand, target)


@pytest.mark.parametrize(
    ("change", "words"),
    [({"kind": "best"}, "kind is 'best'"), ({"period": 0.0}, "period is 0.0"),
     ({"rest": (0.0, 1.0)}, "rest is"), ({"camera": (0.0, np.nan, 0.0)}, "camera is")],
)  # fmt: skip
def test_settings_that_make_no_sense_are_named(change, words):
    with pytest.raises(ValueError, match=words):
        FeatureSettings(**change)


def test_a_recording_gives_what_the_frames_one_by_one_give():
    one = recording("P01", 101)
    t, frames, labels = features_of(one, SETTINGS)
    extractor, rows = FeatureExtractor(SETTINGS), []
    for at, hand in zip(one.t, one.hand, strict=True):
        due, frame = extractor.step(at, None if np.isnan(hand[0]) else hand, PICK_POINT)
        if due:
            rows.append(np.full(10, np.nan) if frame is None else frame)
    assert np.array_equal(frames, np.array(rows), equal_nan=True)
    assert len(t) == len(labels) == len(rows)
