# SPDX-License-Identifier: BSD-3-Clause
"""How well the head's pose is measured, on pictures whose truth is exact."""

import math

import numpy as np
import pytest
from head_scene import HEAD, HELMET, camera, degrees_apart, head

from fabric_perception.camera import Camera
from fabric_perception.head.aruco import Marker, MarkerFinder
from fabric_perception.head.continuity import Continuity
from fabric_perception.head.helmet import Helmet
from fabric_perception.head.parameters import HeadParameters
from fabric_perception.head.picture import helmet_picture, side_in_pixels
from fabric_perception.head.pose import Candidate, angle_between, candidates
from fabric_perception.head.tracker import HeadTracker

ONE = Helmet(HELMET.dictionary, {0: HELMET.markers[0]})
FRONT_LEFT = HELMET.markers[0]


def test_yaw_is_within_two_degrees_at_markers_of_eighty_pixels():
    rng = np.random.default_rng(111)
    tracker = HeadTracker(camera(), HELMET)
    errors, sides = [], []
    for number in range(25):
        at = HEAD + rng.uniform(-0.05, 0.05, 3)
        pose = head(rng.uniform(-1.2, 1.2), rng.uniform(-0.1, 0.6), rng.uniform(-0.15, 0.15), at)
        tracker.reset()
        seen = tracker.step(1.0, helmet_picture(camera(), HELMET, pose, seed=number))
        assert seen.visible
        errors.append(degrees_apart(seen.yaw, math.atan2(pose[1, 0], pose[0, 0])))
        sides.append(
            max(side_in_pixels(camera(), pose, HELMET.markers[m.id]) for m in seen.markers)
        )
        assert degrees_apart(seen.pitch, -math.asin(pose[2, 0])) < 2.0
        assert np.linalg.norm(seen.pose[:3, 3] - at) < 0.005
    assert 75.0 < np.median(sides) < 95.0
    assert max(errors) < 2.0


@pytest.mark.parametrize("turned", [0.35, 0.0, -0.05])
def test_one_marker_looking_aside_suffices_for_two_degrees(turned):
    """Its face is 30 to 60 degrees off the camera."""
    worst = 0.0
    for number in range(6):
        pose = head(turned, 0.1 * number)
        found = HeadTracker(camera(), ONE).step(
            0.1, helmet_picture(camera(), ONE, pose, seed=number)
        )
        worst = max(worst, degrees_apart(found.yaw, math.pi + turned))
    assert worst < 2.0


def test_a_lens_that_bends_lines_is_accounted_for():
    straight = camera()
    bent = Camera(straight.K, 640, 480, straight.pose_in_cell, (-0.12, 0.05, 0.001, -0.001, 0.0))
    pose = head(0.4)
    marker = MarkerFinder(wanted=[0]).find(helmet_picture(straight, ONE, pose))[0]
    corners = bent.project(FRONT_LEFT.corners @ pose[:3, :3].T + pose[:3, 3])
    found = candidates(bent, ONE, [marker._replace(corners=corners)], 4.0)
    best = min(angle_between((bent.pose_in_cell @ c.pose)[:3, :3], pose[:3, :3]) for c in found)
    assert best < 1e-3


def test_both_poses_of_one_marker_are_kept_and_one_is_right():
    pose, small = head(-0.611, 0.1), camera(600.0)  # the marker nearly faces the camera
    seen = MarkerFinder(wanted=[0]).find(helmet_picture(small, ONE, pose))
    found = candidates(small, ONE, seen, 4.0)
    assert len(found) == 2
    truth = small.pose_in_cell[:3, :3].T @ pose[:3, :3]
    assert min(angle_between(c.pose[:3, :3], truth) for c in found) < math.radians(10.0)
    assert angle_between(found[0].pose[:3, :3], found[1].pose[:3, :3]) > math.radians(5.0)


def test_two_markers_together_leave_one_pose():
    seen = MarkerFinder(wanted=HELMET.markers).find(helmet_picture(camera(), HELMET, head(0.0)))
    assert len(seen) == 2
    found = candidates(camera(), HELMET, seen, 4.0)
    assert [c.ids for c in found] == [(0, 1)]


def test_a_marker_that_does_not_belong_there_is_outvoted():
    pose = head(0.5)
    seen = MarkerFinder(wanted=HELMET.markers).find(helmet_picture(camera(), HELMET, pose))
    assert len(seen) == 3
    moved = [seen[0]._replace(corners=seen[0].corners + 90.0), *seen[1:]]
    best = candidates(camera(), HELMET, moved, 4.0)[0]
    assert best.ids == tuple(m.id for m in seen[1:])
    found = camera().pose_in_cell @ best.pose
    assert angle_between(found[:3, :3], pose[:3, :3]) < math.radians(2.0)


def test_no_marker_of_the_helmet_is_no_pose():
    assert candidates(camera(), HELMET, [], 4.0) == []
    seen = MarkerFinder().find(helmet_picture(camera(), HELMET, head(0.0)))
    assert candidates(camera(), Helmet("DICT_4X4_50", {9: FRONT_LEFT}), seen, 4.0) == []


def test_corners_that_make_no_square_are_no_pose():
    seen = MarkerFinder(wanted=[0]).find(helmet_picture(camera(), ONE, head(0.3)))
    crossed = seen[0]._replace(corners=seen[0].corners[[0, 2, 1, 3]])
    assert candidates(camera(), ONE, [crossed], 4.0) == []


def turned(angle: float, error: float) -> Candidate:
    pose = np.eye(4)
    pose[:3, :3] = head(angle, 0.0)[:3, :3]
    return Candidate(pose, error, (0,))


def chooser() -> Continuity:
    return Continuity(HeadParameters(), np.array((0.0, 0.0, 1.0)))


def test_of_two_poses_that_fit_alike_the_one_seen_before_is_chosen():
    continuity = chooser()
    assert continuity.choose(0.0, [turned(0.5, 0.2)]).error == 0.2
    chosen = continuity.choose(0.1, [turned(-0.5, 0.20), turned(0.5, 0.21)])
    assert chosen.error == 0.21


def test_a_wrong_beginning_is_overcome_by_pictures_that_fit_better():
    continuity = chooser()
    continuity.choose(0.0, [turned(-0.5, 0.2)])
    chosen = [continuity.choose(0.1 * k, [turned(0.5, 0.2), turned(-0.5, 0.9)]) for k in (1, 2, 3)]
    assert chosen[-1].error == 0.2


def test_a_story_that_moves_smoothly_wins_over_one_that_jumps():
    """The ambiguous first picture is settled by those that follow."""
    continuity = chooser()
    continuity.choose(0.0, [turned(-0.60, 0.20), turned(0.60, 0.22)])
    for step in range(1, 6):
        right = turned(0.60 - 0.02 * step, 0.20)
        wrong = turned((-1) ** step * 0.6, 0.20)
        chosen = continuity.choose(0.033 * step, [wrong, right])
    assert chosen is right


def test_a_head_that_leans_less_is_likelier():
    upright, leaning = turned(0.2, 0.2), turned(0.2, 0.2)
    leaning.pose[:3, :3] = head(0.2, 0.0, 1.2)[:3, :3]
    assert chooser().choose(0.0, [leaning, upright]) is upright


def test_what_was_seen_long_ago_does_not_count():
    continuity = chooser()
    continuity.choose(0.0, [turned(0.5, 0.2)])
    chosen = continuity.choose(5.0, [turned(-0.5, 0.20), turned(0.5, 0.21)])
    assert chosen.error == 0.20


def wrong_shares(seed: int) -> tuple[float, float]:
    """Of a slow turn through the ambiguous direction, corners blurred by motion (0.8 pixels):
    how often the pose is off by more than 10 degrees, by error alone and by continuity."""
    rng = np.random.default_rng(seed)
    small = camera(600.0)
    continuity = Continuity(HeadParameters(), small.pose_in_cell[2, :3])
    wrong = np.zeros((60, 2))
    for step in range(60):
        pose = head(-0.017 * step, 0.1)
        corners = small.project(FRONT_LEFT.corners @ pose[:3, :3].T + pose[:3, 3])
        seen = Marker(0, corners + rng.normal(0.0, 0.8, (4, 2)), True)
        found = candidates(small, ONE, [seen], 4.0)
        for column, chosen in enumerate((found[0], continuity.choose(step / 30.0, found))):
            turned_to = (small.pose_in_cell @ chosen.pose)[:3, :3]
            wrong[step, column] = angle_between(turned_to, pose[:3, :3]) > math.radians(15.0)
    by_error, by_story = wrong.mean(axis=0)
    return float(by_error), float(by_story)


def test_continuity_saves_most_of_what_bad_corners_lose():
    by_error, by_story = np.mean([wrong_shares(seed) for seed in range(111, 121)], axis=0)
    assert by_error > 0.08
    assert by_story < 0.3 * by_error
