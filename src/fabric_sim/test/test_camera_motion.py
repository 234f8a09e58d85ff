# SPDX-License-Identifier: BSD-3-Clause
"""People move smoothly, in time, and each in a way of their own."""

import math

import numpy as np
import pytest
from cell_helpers import CONFIG

from fabric_msgs.msg import HumanActivity
from fabric_sim.camera.hand import held_at
from fabric_sim.camera.manner import WAVES, manner_of
from fabric_sim.camera.motion import Intent, PersonMotion, Phase
from fabric_sim.camera.trajectory import Track, Wobble
from fabric_sim.character import named_generator
from fabric_sim.geometry import Point
from fabric_sim.sensing import Behaviour

GEOMETRY = CONFIG.geometry
CUBE = np.array(GEOMETRY.conveyor.to_cell(Point(0.0, 0.0, GEOMETRY.edge / 2)))
TRAY = GEOMETRY.trays("sorting")[0].floor
GRASPS = Behaviour(HumanActivity.GRASP)
REACH = Intent(GRASPS, deadline=3.0, episode=1)
CARRY = Intent(GRASPS, holding=True, goal=TRAY, deadline=6.0, episode=1)
RETREAT = Intent(GRASPS, deadline=7.3, episode=1)
WARN = Intent(Behaviour(HumanActivity.WARN), episode=2)
STORY = ((0.0, Intent()), (2.0, REACH), (3.0, CARRY), (6.0, RETREAT), (7.3, Intent()), (9.0, WARN))
PEOPLE = range(1, 8)


def motion(person=1, seed=101):
    return PersonMotion(GEOMETRY, manner_of(seed, person), named_generator(seed, "motion", person))


def play(person=1, story=STORY, until=11.0, rate=100, seed=101):
    """Poses at this rate; what is wanted is told every 0.05 s."""
    moving, poses = motion(person, seed), []
    for i in range(int(until * rate)):
        if i % (rate // 20) == 0:
            t = i / rate
            moving.tell(t, [intent for start, intent in story if start <= t + 1e-9][-1])
        poses.append(moving.pose(i / rate))
    return poses


def hands(*arguments, **words):
    return np.array([pose.hand for pose in play(*arguments, **words)])


def speeds(places, rate=100):
    return np.linalg.norm(np.diff(places, axis=0), axis=1) * rate


def test_a_leg_is_the_polynomial_of_least_jerk():
    track = Track((0.0,))
    track.go(0.0, (1.0,), 2.0)
    for s in (0.1, 0.5, 0.8):
        expected = 10 * s**3 - 15 * s**4 + 6 * s**5
        assert track.at(2.0 * s).p[0] == pytest.approx(expected)
    assert track.at(1.0).v[0] == pytest.approx(1.875 / 2.0)  # the known peak of the bell


def test_a_new_goal_on_the_way_changes_neither_place_nor_speed_at_once():
    track = Track((0.0, 0.0, 0.0))
    track.go(0.0, (0.3, 0.1, 0.0), 1.0, arc=(0.0, 0.0, 0.05))
    before = track.at(0.4)
    track.go(0.4, (0.0, 0.4, 0.2), 0.8)
    after = track.at(0.4)
    for old, new in zip(before, after, strict=True):
        np.testing.assert_allclose(new, old, atol=1e-12)
    np.testing.assert_allclose(track.at(5.0).p, (0.0, 0.4, 0.2))


@pytest.mark.parametrize("duration", [0.0, -1.0, math.nan, math.inf])
def test_a_movement_takes_time(duration):
    with pytest.raises(ValueError, match="duration of a movement is"):
        Track((0.0,)).go(0.0, (1.0,), duration)


def test_trembling_is_as_strong_as_it_is_said_to_be():
    wobble = Wobble(np.random.default_rng(3), 0.002, (5.0, 9.0))
    places = np.array([wobble.at(0.001 * i) for i in range(60000)])
    np.testing.assert_allclose(places.std(axis=0), 0.002, rtol=0.05)


@pytest.mark.parametrize("person", PEOPLE)
def test_hands_never_jump(person):
    places = hands(person)
    assert speeds(places).max() < 3.0  # m/s
    pushes = np.linalg.norm(np.diff(places, 2, axis=0), axis=1) * 100**2
    assert pushes.max() < 60.0  # m/s^2


@pytest.mark.parametrize("person", PEOPLE)
def test_the_hand_is_at_the_cube_when_it_is_picked_and_at_the_tray_when_it_is_placed(person):
    moving = motion(person)
    for tick in range(121):
        t = tick / 20
        moving.tell(t, [intent for start, intent in STORY if start <= t][-1])
        if t == 3.0:
            cube = held_at(moving.pose(t).hand, GEOMETRY)
            assert np.linalg.norm(cube - CUBE) < 0.02
        if t == 5.95:
            cube = held_at(moving.pose(t).hand, GEOMETRY)
            assert np.linalg.norm(np.array(cube) - TRAY) < 0.05


def test_the_hand_goes_home_while_it_still_counts_as_grasping():
    moving = motion()
    for tick in range(140):
        moving.tell(tick / 20, [i for start, i in STORY if start <= tick / 20][-1])
    assert moving.phase is Phase.RETREAT
    moving.tell(7.0, RETREAT._replace(episode=2))  # reaches anew
    assert moving.phase is Phase.REACH


def test_a_warning_raises_the_open_hand_against_the_robot():
    poses = play()
    assert max(pose.stop for pose in poses[:900]) == 0.0
    assert poses[-1].stop == 1.0
    assert np.mean([pose.hand[2] for pose in poses[-50:]]) > 0.25


def test_people_wave_in_different_ways():
    manners = [manner_of(101, person) for person in range(60)]
    assert {manner.wave for manner in manners} == set(WAVES)
    assert max(m.pace for m in manners) > 1.4 * min(m.pace for m in manners)


def test_quick_people_reach_sooner():
    paces = {manner_of(101, person).pace: person for person in range(60)}
    slow, quick = paces[min(paces)], paces[max(paces)]
    story = ((0.0, Intent()), (0.5, REACH._replace(deadline=math.inf)))

    def arrival(person):
        away = np.linalg.norm(hands(person, story, until=4.0) - hands(person, story)[399], axis=1)
        return np.flatnonzero(away > 0.05)[-1]

    assert arrival(quick) < arrival(slow)


def test_looking_around_turns_the_head_far_from_the_work():
    story = ((0.0, Intent()), (2.0, Intent(Behaviour(looking_around=True))))
    yaws = np.abs([pose.yaw for pose in play(story=story, until=10.0)])
    assert yaws[:200].max() < 0.45
    away = yaws[300:] > 0.6
    assert away.mean() > 0.85  # a turn to the other side passes the middle


def test_who_walks_away_is_gone_in_time_and_comes_back():
    walk = Intent(Behaviour(HumanActivity.OTHER), walking=True, deadline=5.0)
    gone = Intent(Behaviour(present=False))
    poses = play(story=((0.0, walk), (5.0, gone), (12.0, Intent())), until=16.0)
    assert poses[520].head[0] - poses[0].head[0] > 0.8
    np.testing.assert_allclose(poses[-1].head, poses[0].head, atol=0.03)


def test_a_seed_and_a_number_make_a_person():
    np.testing.assert_array_equal(hands(2), hands(2))
    assert np.abs(hands(2) - hands(3)).max() > 0.01
    assert np.abs(hands(2) - hands(2, seed=102)).max() > 0.01
