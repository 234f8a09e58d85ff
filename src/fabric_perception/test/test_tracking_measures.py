# SPDX-License-Identifier: BSD-3-Clause
"""How well places are measured: cubes, hand, filter; what is a glove and what is not."""

import numpy as np
import pytest
from drawn import YELLOW, Painter, camera, looking, palette, workspace

from fabric_perception.camera import Camera
from fabric_perception.tracking.hand import Glove, judge
from fabric_perception.tracking.kalman import PointFilter
from fabric_perception.tracking.measuring import View
from fabric_perception.tracking.pipeline import Tracking

PICTURES = 20
RMSE = 0.006  # m, three times what an Xtion at 0.9 m can do


@pytest.fixture(scope="module")
def painter():
    return Painter(camera(), workspace(), seed=105)


def step_all(tracking, painter, pictures=PICTURES, **looks):
    looks = {"noise": 4.0, "blur": 0.6, "holes": 0.02, "depth_noise": 0.0012} | looks
    return [tracking.step(0.1 * (k + 1), *painter.picture(**looks)) for k in range(pictures)]


@pytest.mark.parametrize("view", ["above", "from the side"])
def test_cubes_that_lie_still_are_measured_to_millimetres(painter, view):
    if view == "from the side":
        oblique = Camera(camera().K, 640, 480, looking((0.85, 0.35, 0.75), (0.25, 0.0, 0.1)))
        painter = Painter(oblique, workspace(), seed=106)
    rng = np.random.default_rng(107)
    painter.clear()
    truth = [np.array([0.281, y, 0.1345]) for y in (-0.25, -0.12, 0.035)]
    for colour, place in zip((3, 2, 1), truth, strict=True):
        painter.cube(colour, place, yaw=rng.uniform(0.0, 1.5))
    found = step_all(Tracking(painter.camera, workspace(), palette()), painter)
    assert [cube.colour for cube in found[-1].cubes] == [1, 2, 3]  # the foremost is the first
    errors = [cube.position - truth[3 - cube.id] for seen in found[8:] for cube in seen.cubes]
    assert len(errors) == 3 * (PICTURES - 8)
    assert np.sqrt((np.array(errors) ** 2).sum(axis=1).mean()) < RMSE


@pytest.mark.parametrize("light", [0.6, 1.0, 1.25])
def test_cubes_keep_their_colours_in_other_light(painter, light):
    painter.clear()
    for colour, y in enumerate((-0.25, -0.12, 0.035), start=1):
        painter.cube(colour, (0.281, y, 0.1345))
    seen = step_all(Tracking(camera(), workspace(), palette()), painter, 6, light=light)[-1]
    assert sorted(cube.colour for cube in seen.cubes) == [1, 2, 3]
    assert min(cube.confidence for cube in seen.cubes) > 0.9


def test_cubes_that_touch_are_told_apart_in_a_container(painter):
    painter.clear()
    places = [(0.47 + dx, 0.035 + dy, 0.0225) for dx in (0.0, 0.026) for dy in (-0.013, 0.013)]
    for place in places:
        painter.cube(2, place)
    seen = step_all(Tracking(camera(), workspace(), palette()), painter, 1)[0]
    found = np.array([cube.position for cube in seen.detections])
    assert len(found) == 4
    for place in places:
        assert np.linalg.norm(found - place, axis=1).min() < 0.012


def test_a_hand_at_rest_is_measured_still(painter):
    painter.clear().glove((0.56, 0.195, 0.08))
    found = step_all(Tracking(camera(), workspace(), palette()), painter, 40)
    speeds = [np.linalg.norm(seen.hand.velocity) for seen in found[10:]]
    assert max(speeds) < 0.05
    assert np.linalg.norm(found[-1].hand.position - (0.56, 0.195, 0.08)) < 0.03


def test_a_hand_out_of_view_ages_where_it_was(painter):
    tracking = Tracking(camera(), workspace(), palette())
    painter.clear().glove((0.56, 0.195, 0.08))
    last = step_all(tracking, painter, 5)[-1].hand
    painter.clear()
    gone = tracking.step(2.0, *painter.picture()).hand
    assert last.visible and not gone.visible
    assert gone.age == pytest.approx(1.5)
    assert (gone.position == last.position).all()
    assert (gone.velocity == 0.0).all()


@pytest.mark.parametrize(
    ("draw", "reason"),
    [
        (lambda p: p.box((0.6, -0.3, 0.01), (0.09, 0.10, 0.02), YELLOW), "high|flat"),
        (lambda p: p.box((0.6, -0.3, 0.06), (0.09, 0.10, 0.12), YELLOW), "flat"),
        (lambda p: p.ball((0.6, -0.3, 0.03), 0.03, YELLOW), "area|length"),
        (lambda p: p.box((0.5, 0.0, 0.05), (0.35, 0.3, 0.1), YELLOW), "area"),
        (lambda p: p.box((0.6, 0.0, 0.05), (0.02, 0.35, 0.02), YELLOW), "length|longer"),
        (lambda p: p.cube(1, (0.6, 0.0, 0.05)).box((0.6, 0.1, 0.05), (0.02,) * 3, YELLOW), "area"),
    ],
    ids=["tape", "block", "ball", "jacket", "rule", "yellow cube"],
)
def test_yellow_things_are_no_gloves(painter, draw, reason):
    painter.clear()
    draw(painter)
    tracking = Tracking(camera(), workspace(), palette())
    seen = step_all(tracking, painter, 2)[-1]
    assert seen.hand is None
    assert seen.refusals
    for refusal in seen.refusals:
        assert any(word in refusal.reason for word in reason.split("|")), refusal.reason


@pytest.mark.parametrize("yaw", [0.0, 0.8, 2.0, 3.1])
@pytest.mark.parametrize("height", [0.05, 0.2, 0.35])
def test_a_glove_is_one_whichever_way_it_points(painter, yaw, height):
    painter.clear().glove((0.5, 0.1, height), yaw)
    tracking = Tracking(camera(), workspace(), palette())
    bgr, depth = painter.picture(noise=3.0, blur=0.6, depth_noise=0.001)
    patches, masks = tracking.find(bgr, depth)
    judged = [
        judge(p, tracking.measuring, View(depth, masks), tracking.parameters)
        for p in patches
        if p.colour == "glove"
    ]
    assert sum(isinstance(entry, Glove) for entry in judged) == 1


def test_the_filter_is_the_textbook_one():
    rng = np.random.default_rng(108)
    tested = PointFilter(0.0, np.zeros(3), 0.003, push=1.5)
    x, P, t = np.zeros(6), np.diag([0.003**2] * 3 + [1.0] * 3), 0.0
    eye, H = np.eye(3), np.eye(3, 6)
    for k in range(100):
        dt, z, sigma = rng.uniform(0.02, 0.2), rng.normal(size=3) * 0.1, rng.uniform(0.001, 0.01)
        t += dt
        F = np.block([[eye, dt * eye], [np.zeros((3, 3)), eye]])
        G = np.vstack([dt**2 / 2 * eye, dt * eye])
        x, P = F @ x, F @ P @ F.T + 1.5**2 * G @ G.T
        tested.predict(t)
        if k % 4:  # now and then nothing is measured
            K = P @ H.T @ np.linalg.inv(H @ P @ H.T + sigma**2 * eye)
            x, P = x + K @ (z - H @ x), (np.eye(6) - K @ H) @ P
            tested.correct(z, sigma)
        np.testing.assert_allclose(tested.position, x[:3], atol=1e-9)
        np.testing.assert_allclose(tested.velocity, x[3:], atol=1e-7)
        assert tested.spread == pytest.approx(np.sqrt(P[0, 0]), rel=1e-6)
