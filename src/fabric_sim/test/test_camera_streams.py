# SPDX-License-Identifier: BSD-3-Clause
"""Labelled movements for training: what is recorded is what people do."""

import numpy as np
import pytest
from cell_helpers import CONFIG

from fabric_msgs.msg import HumanActivity
from fabric_sim.camera.streams import PretendingRobot, labelled_stream
from fabric_sim.worker_events import ROBOT_CANCEL, ROBOT_GRASP, ROBOT_IDLE, ROBOT_PLANNING

RELUCTANT = "expert_rested_attentive_noncollaborative"


def stream(person=1, seconds=120.0, human="random", **words):
    return labelled_stream(CONFIG, person, 101, seconds, human=human, **words)


def test_a_stream_has_a_row_for_each_moment():
    got = stream(seconds=10.0, rate=25.0)
    np.testing.assert_allclose(got.t, np.arange(250) / 25.0)
    assert got.hand.shape == got.head.shape == got.cube.shape == (250, 3)
    assert all(len(column) == 250 for column in got)
    assert np.isfinite(got.hand).all()


def test_reluctant_people_grasp_and_warn():
    got = stream(human=RELUCTANT)
    shares = np.bincount(got.label, minlength=4) / len(got.label)
    assert shares[HumanActivity.GRASP] > 0.1
    assert shares[HumanActivity.WARN] > 0.01
    raised = got.hand[got.label == HumanActivity.WARN][:, 2]
    assert np.percentile(raised, 80) > np.percentile(got.hand[:, 2], 80)


def test_a_held_cube_is_in_the_hand():
    got = stream(human=RELUCTANT)
    away = np.linalg.norm(got.cube - got.hand, axis=1)
    np.testing.assert_allclose(away[got.holding], 0.079, atol=0.001)
    assert got.label[got.holding].tolist().count(HumanActivity.IDLE) == 0


def test_people_differ_and_come_again():
    first, again, other = stream(1, 30.0), stream(1, 30.0), stream(2, 30.0)
    np.testing.assert_array_equal(first.hand, again.hand)
    assert np.abs(first.hand - other.hand).max() > 0.05


def test_inspection_can_be_recorded_too():
    assert stream(seconds=20.0, scenario="inspection").holding.dtype == bool


@pytest.mark.parametrize(
    ("words", "named"),
    [
        ({"seconds": 0.0}, "0.0 s at 30.0 Hz"),
        ({"rate": float("nan")}, "at nan Hz"),
        ({"scenario": "cooking"}, "scenario is 'cooking'"),
        ({"human": "martian"}, "unknown human type 'martian'"),
    ],
)
def test_what_cannot_be_recorded_is_named(words, named):
    with pytest.raises(ValueError, match=named):
        stream(**{"seconds": 5.0} | words)


def test_the_robot_pretends_and_gives_in():
    robot = PretendingRobot(np.random.default_rng(1))
    shown = [robot.at(0.05 * i, False).current for i in range(2000)]
    assert set(shown) == {ROBOT_IDLE, ROBOT_PLANNING, ROBOT_GRASP, ROBOT_CANCEL}
    t = 100.0
    while robot.at(t, False).current != ROBOT_GRASP:
        t += 0.05
    assert robot.at(t, True).current == ROBOT_CANCEL
