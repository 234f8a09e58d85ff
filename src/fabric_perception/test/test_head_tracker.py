# SPDX-License-Identifier: BSD-3-Clause
"""Streams of pictures, whole and damaged, and when a person is said to look around."""

import dataclasses
import math

import cv2
import numpy as np
import pytest
import yaml
from head_scene import CONFIG, HEAD, HELMET, camera, head

from fabric_msgs.settings import settings_from
from fabric_perception.head.helmet import Helmet
from fabric_perception.head.looking import LookingAround, offsets
from fabric_perception.head.parameters import HeadParameters
from fabric_perception.head.picture import Optics, helmet_picture
from fabric_perception.head.tracker import HeadTracker
from fabric_perception.images import ImageError

WORK = np.array((0.30, 0.0, 0.10))
TURN = 1.1  # rad, of a head that looks around
PERIOD = 0.1  # s
EMPTY = helmet_picture(camera(), HELMET, head(math.pi), seed=1)  # seen from behind
AHEAD = helmet_picture(camera(), HELMET, head(0.0), seed=2)
ASIDE = helmet_picture(camera(), HELMET, head(TURN), seed=3)


def tracker(**changes) -> HeadTracker:
    return HeadTracker(camera(), HELMET, HeadParameters(**changes))


def believed(parameters: HeadParameters, turns, period: float = PERIOD) -> list[bool]:
    looking = LookingAround(parameters)
    return [looking.step(period * k, head(turn)) for k, turn in enumerate(turns)]


def test_the_shipped_parameters_are_the_defaults():
    held = yaml.safe_load((CONFIG / "head.yaml").read_text())
    assert held == dataclasses.asdict(HeadParameters())
    assert settings_from(HeadParameters, held) == HeadParameters()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"window": 22}, "window is 22; it must be odd"),
        ({"window": 23.0}, "window is 23.0; it must be of type int"),
        ({"memory": math.nan}, "memory is nan"),
        ({"yaw_limit": 4.0}, "yaw_limit is 4.0; it must lie in"),
        ({"yaw_limit": 0.2, "margin": 0.2}, "below both limits"),
        ({"gaze": 1.0}, "unknown parameter 'gaze'"),
    ],
)
def test_a_bad_parameter_is_refused_by_name_and_value(changes, words):
    with pytest.raises(ValueError, match=words):
        settings_from(HeadParameters, changes)


# -- where a face points ---------------------------------------------------------------------------


def test_a_face_that_points_at_the_work_area_has_no_offset():
    way = WORK - HEAD
    pose = head(math.atan2(way[1], way[0]) - math.pi, math.atan2(-way[2], np.hypot(*way[:2])))
    assert np.allclose(offsets(pose, WORK), 0.0, atol=1e-9)


def test_offsets_are_positive_to_the_left_and_above():
    aside, above = offsets(head(0.3, 0.0), WORK)
    assert aside > 0.2
    assert above > 0.4
    assert offsets(head(-0.4, 1.3), WORK)[0] < 0.0
    assert offsets(head(0.0, 1.3), WORK)[1] < 0.0


def test_the_cone_goes_with_the_person():
    """From aside, the same direction of the face looks past the work area."""
    from_the_side = HEAD + np.array((0.0, 0.5, 0.0))
    assert abs(offsets(head(0.0, 0.3), WORK)[0]) < 0.15
    assert offsets(head(0.0, 0.3, at=from_the_side), WORK)[0] < -0.5


def test_every_container_and_the_belt_lie_inside_the_cone():
    cell = yaml.safe_load((CONFIG.parents[2] / "launch/config/cell.yaml").read_text())
    places = [(0.281, 0.035, 0.122), (0.281, -0.285, 0.122)]
    for scenario in cell["scenarios"].values():
        places += [(c["x"], c["y"], c["z"]) for c in scenario["containers"]]
    for place in places:
        way = np.array(place) - HEAD
        pose = head(math.atan2(way[1], way[0]) - math.pi, math.atan2(-way[2], np.hypot(*way[:2])))
        assert not LookingAround(HeadParameters()).step(0.0, pose), place


# -- hysteresis ------------------------------------------------------------------------------------


def test_one_picture_of_a_turned_head_is_not_yet_looking_around():
    p = HeadParameters(look_frames=2)
    assert believed(p, [0, 0, TURN, 0, 0]) == [False] * 5
    assert believed(p, [0, 0, TURN, TURN, 0, 0]) == [False, False, False, True, True, False]


def test_the_first_picture_is_believed():
    assert believed(HeadParameters(look_frames=5), [TURN])[0]


def test_a_face_at_the_limit_does_not_flicker():
    p = HeadParameters(look_frames=1)
    limit = p.yaw_limit
    inside = [t for t in np.arange(0, 1.2, 0.01) if abs(offsets(head(t), WORK)[0]) < limit][-1]
    turns = [0.0, inside + 0.05] + [inside - 0.03, inside + 0.03] * 5
    assert believed(p, turns)[1:] == [True] * 11


def test_a_head_not_seen_for_long_begins_anew():
    looking = LookingAround(HeadParameters(look_frames=3, memory=1.0))
    assert not looking.step(0.0, head(0.0))
    assert not looking.step(0.9, head(TURN))
    assert looking.step(2.0, head(TURN))


# -- pictures --------------------------------------------------------------------------------------


def test_no_marker_is_unknown_and_not_looking_away():
    seen = tracker().step(0.0, EMPTY)
    assert not seen.visible
    assert not seen.looking_around
    assert np.array_equal(seen.pose, np.eye(4))
    assert math.isnan(seen.error)


def test_a_loss_for_some_pictures_changes_nothing_of_what_is_believed():
    t = tracker(look_frames=2)
    pictures = [AHEAD, ASIDE, EMPTY, EMPTY, ASIDE, EMPTY, ASIDE]
    percepts = [t.step(PERIOD * k, picture) for k, picture in enumerate(pictures)]
    assert [p.visible for p in percepts] == [True, True, False, False, True, False, True]
    assert [p.looking_around for p in percepts if p.visible] == [False, False, True, True]


def test_a_head_that_appears_elsewhere_is_found_again():
    t = tracker()
    assert t.step(0.0, helmet_picture(camera(), HELMET, head(0.0, at=HEAD + (0, 0.13, 0)))).visible
    moved = helmet_picture(camera(), HELMET, head(0.0, at=HEAD - (0, 0.13, 0)))
    assert t.step(0.1, moved).pose[1, 3] == pytest.approx(HEAD[1] - 0.13, abs=0.01)


def test_after_a_reset_time_may_begin_anew():
    t = tracker()
    t.step(5.0, AHEAD)
    t.reset()
    assert t.step(0.0, AHEAD).visible


def test_a_stale_picture_is_refused_and_changes_nothing():
    t = tracker()
    t.step(1.0, AHEAD)
    for stamp in (1.0, 0.5, math.nan, math.inf):
        with pytest.raises(ValueError, match="does not come after one of 1.0 s"):
            t.step(stamp, ASIDE)
    assert t.step(1.1, AHEAD).visible


@pytest.mark.parametrize(
    ("picture", "words"),
    [
        (AHEAD[::2, ::2], "is 320x240 pixels, its camera's are 640x480"),
        (np.empty((0, 0), np.uint8), "is 0x0 pixels"),
        (cv2.cvtColor(AHEAD, cv2.COLOR_GRAY2BGR), "no grey picture"),
        (AHEAD.astype(np.float32), "no grey picture"),
    ],
)
def test_a_damaged_picture_is_refused_and_changes_nothing(picture, words):
    t = tracker()
    with pytest.raises(ImageError, match=words):
        t.step(1.0, picture)
    assert t.step(0.5, AHEAD).visible


@pytest.mark.parametrize(
    "picture",
    [
        np.zeros((480, 640), np.uint8),
        np.full((480, 640), 255, np.uint8),
        np.random.default_rng(1).integers(0, 256, (480, 640), dtype=np.uint8),
        np.vstack([AHEAD[:240], np.zeros((240, 640), np.uint8)]),  # the lower half was lost
        cv2.GaussianBlur(AHEAD, (0, 0), 8.0),
    ],
)
def test_a_picture_that_shows_nothing_usable_is_unknown(picture):
    assert not tracker().step(0.0, picture).visible


def test_a_helmet_the_dictionary_has_no_markers_for_is_refused():
    with pytest.raises(ValueError, match="DICT_4X4_50 has no marker 77"):
        HeadTracker(camera(), Helmet("DICT_4X4_50", {77: HELMET.markers[0]}))


# -- looking around over a stream ------------------------------------------------------------------


def script(rng: np.random.Generator, looks: int) -> tuple[np.ndarray, list[tuple[int, int]]]:
    """Turns of a head (n,) rad at 10 Hz, and the looks in it as [first, last) pictures.

    Looks of 1 to 3 s, with turns of 0.3 s; between them 2 to 5 s at work, the head not still.
    """
    turns, spans = [0.0] * 5, []
    for _ in range(looks):
        aside = rng.choice((-1.0, 1.0)) * rng.uniform(0.95, 1.25)
        work = np.cumsum(rng.normal(0.0, 0.06, rng.integers(20, 50)))
        turns += list(0.35 * np.tanh(work))
        begin = len(turns) + 2
        turns += [turns[-1] + (aside - turns[-1]) * s for s in (0.2, 0.8)]
        turns += [aside] * int(rng.integers(10, 31))
        spans.append((begin, len(turns)))
        turns += [aside * s for s in (0.8, 0.2)]
    return np.array(turns), spans


def f1_of_looks(states: list[bool | None], spans: list[tuple[int, int]]) -> float:
    """Looks as events: a span in which looking around was told, a tell outside every span.

    states: one a picture, None when unknown. A tell may last 4 pictures longer than its span.
    """
    told = [k for k, state in enumerate(states) if state]
    hits = sum(any(a <= k < b + 4 for k in told) for a, b in spans)
    outside = [k for k in told if not any(a - 2 <= k < b + 4 for a, b in spans)]
    false = sum(k - 1 not in outside for k in outside)
    return 2.0 * hits / (2.0 * hits + false + len(spans) - hits)


def test_looks_are_told_though_a_fifth_of_the_pictures_is_lost():
    """Poses with errors of 2 degrees, 200 looks."""
    rng = np.random.default_rng(101)
    turns, spans = script(rng, 200)
    looking = LookingAround(HeadParameters())
    states = [
        None if rng.random() < 0.2 else looking.step(PERIOD * k, head(turn + rng.normal(0, 0.035)))
        for k, turn in enumerate(turns)
    ]
    assert f1_of_looks(states, spans) >= 0.97


def test_looks_are_told_from_pictures_of_which_a_fifth_is_lost():
    rng = np.random.default_rng(102)
    turns, spans = script(rng, 4)
    t = tracker()
    states = []
    for number, turn in enumerate(turns):
        if rng.random() < 0.2:
            states.append(None)
            continue
        at = HEAD + rng.normal(0.0, 0.005, 3)
        smear = 6.0 if abs(turn - turns[max(number - 1, 0)]) > 0.3 else 0.0
        optics = Optics(noise=5.0, motion=smear, clutter=10)
        picture = helmet_picture(camera(), HELMET, head(turn, at=at), optics, seed=number)
        percept = t.step(PERIOD * number, picture)
        states.append(percept.looking_around if percept.visible else None)
    assert f1_of_looks(states, spans) >= 0.97
    assert np.mean([state is None for state in states]) < 0.35
