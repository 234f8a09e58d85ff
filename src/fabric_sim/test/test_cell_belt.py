# SPDX-License-Identifier: BSD-3-Clause
"""The belt: feeding, stopping at the light barrier, running on, putting back."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabric_sim.belt import Belt
from fabric_sim.geometry import BeltShape

SHAPE = BeltShape(feeder=-0.32, end=0.12, width=0.07, spacing=0.16, gap=0.005, edge=0.025)
DT = 0.05


def running(cubes: int, speed: float = 0.05) -> Belt:
    belt = Belt(SHAPE)
    belt.load(list(range(1, cubes + 1)))
    belt.command(speed, False)
    return belt


def run(belt: Belt, seconds: float) -> list[int]:
    return [cube for _ in range(round(seconds / DT)) for cube in belt.step(DT)]


def test_nothing_moves_before_a_command():
    belt = Belt(SHAPE)
    belt.load([1, 2])
    run(belt, 10.0)
    assert belt.places == {} and belt.waiting == [1, 2] and belt.speed == 0.0


def test_the_first_cube_stops_exactly_at_the_pick_point():
    belt = running(3)
    run(belt, 20.0)
    assert belt.at_pick_point == 1
    assert belt.speed == 0.0
    assert belt.places[1] == 0.0
    assert belt.places[2] == pytest.approx(-0.16)
    assert belt.places[3] == pytest.approx(-0.32)


def test_the_belt_goes_on_when_the_cube_is_taken():
    belt = running(2)
    run(belt, 20.0)
    belt.take(1)
    assert belt.at_pick_point is None and belt.speed == 0.05
    run(belt, 3.3)
    assert belt.at_pick_point == 2 and belt.speed == 0.0


def test_ignoring_the_sensor_lets_the_cube_fall_but_not_the_next_one():
    belt = running(2)
    run(belt, 20.0)
    belt.command(0.05, True)
    assert run(belt, 2.5) == [1]
    belt.command(0.05, False)
    assert run(belt, 5.0) == []
    assert belt.at_pick_point == 2


def test_a_cube_put_where_another_lies_goes_beside_it():
    belt = running(1)
    run(belt, 20.0)
    assert belt.put(9, -0.004)
    assert belt.places[9] == pytest.approx(-0.030)
    assert belt.at_pick_point == 1


def test_a_cube_put_back_at_the_pick_point_stops_the_belt_again():
    belt = running(1)
    run(belt, 20.0)
    belt.take(1)
    run(belt, 1.0)
    assert belt.put(1, 0.0)
    run(belt, 1.0)
    assert belt.at_pick_point == 1 and belt.places[1] == 0.0


@pytest.mark.parametrize("speed", [math.nan, math.inf, -0.05])
def test_a_senseless_speed_is_refused(speed):
    with pytest.raises(ValueError, match=str(speed)):
        Belt(SHAPE).command(speed, False)


@given(
    st.lists(st.tuples(st.sampled_from(["run", "take", "put", "on", "off"]), st.floats(-0.4, 0.2)))
)
def test_cubes_never_overlap_nor_get_lost(commands):
    belt = running(5)
    held: list[int] = []
    fallen: list[int] = []
    for word, x in commands:
        if word == "take" and belt.at_pick_point is not None:
            held.append(belt.at_pick_point)
            belt.take(held[-1])
        elif word == "put" and held and belt.put(held[-1], x):
            held.pop()
        elif word in ("on", "off"):
            belt.command(0.05, word == "on")
        elif word == "run":
            fallen += run(belt, 1.5)
        places = sorted(belt.places.values())
        assert all(b - a >= SHAPE.edge for a, b in zip(places, places[1:], strict=False))
        everywhere = [*belt.places, *belt.waiting, *held, *fallen]
        assert sorted(everywhere) == [1, 2, 3, 4, 5]
