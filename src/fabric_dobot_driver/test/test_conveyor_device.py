# SPDX-License-Identifier: BSD-3-Clause
"""The belt over a fake link: calibrated pulses, the sensor that stops it, an arm that goes away."""

import math

import pytest
from fake_magician import Bench
from pydobotlab.commands import CommandID as Id


def connected(**settings: float) -> Bench:
    bench = Bench(**settings)
    bench.until(lambda: bench.arm.connected)
    return bench


def test_the_belt_runs_at_calibrated_pulses():
    bench = connected(pulses_per_mm=282.9)
    assert bench.belt.run(0.05, False) == ""
    bench.run(0.1)
    assert bench.fake.belt == 14145
    assert bench.belt.state.speed == pytest.approx(0.05, abs=1e-5)
    bench.belt.run(0.0, False)
    bench.run(0.1)
    assert bench.fake.belt == 0


@pytest.mark.parametrize("speed", [math.nan, math.inf, -0.01, 0.5])
def test_a_speed_that_makes_no_sense_is_refused(speed):
    bench = connected()
    assert "want a finite number of m/s, 0 to 0.12" in bench.belt.run(speed, False)
    bench.run(0.2)
    assert bench.fake.belt == 0


def test_a_cube_in_the_beam_stops_the_belt_within_one_look():
    bench = connected()
    bench.belt.run(0.05, False)
    bench.run(0.5)
    bench.fake.infrared, since = True, bench.fake.now
    bench.until(lambda: bench.fake.belt == 0, limit=0.06)
    assert bench.fake.now - since <= 1 / 25 + 0.02
    assert bench.belts[-1] == (0.0, True)


def test_the_belt_goes_on_when_the_beam_has_been_free_for_a_moment():
    bench = connected(infrared_clear=0.3)
    bench.belt.run(0.05, False)
    bench.fake.infrared = True
    bench.run(0.5)
    assert bench.fake.belt == 0
    bench.fake.infrared, since = False, bench.fake.now
    bench.until(lambda: bench.fake.belt != 0)
    assert 0.3 <= bench.fake.now - since < 0.4


def test_a_chattering_edge_does_not_make_the_belt_jerk():
    bench = connected()
    bench.belt.run(0.05, False)
    bench.run(0.2)
    before = len(bench.fake.sent(Id.SET_E_MOTOR))
    for _ in range(20):
        bench.fake.infrared = not bench.fake.infrared
        bench.run(0.04)
    bench.fake.infrared = True
    bench.run(0.2)
    assert len(bench.fake.sent(Id.SET_E_MOTOR)) == before + 1


def test_the_belt_runs_on_when_it_is_to_ignore_the_sensor():
    bench = connected()
    bench.fake.infrared = True
    bench.belt.run(0.05, True)
    bench.run(0.5)
    assert bench.fake.belt > 0
    assert bench.belt.state.cube


def test_the_belt_stands_when_the_arm_comes_back():
    bench = connected()
    bench.belt.run(0.05, False)
    bench.run(0.3)
    bench.fake.missing = True
    bench.run(0.3)
    assert bench.belt.run(0.05, False) == "the arm, which drives the belt, is not connected"
    bench.fake.missing = False
    bench.until(lambda: bench.arm.connected)
    bench.run(1.0)
    assert bench.fake.belt == 0


def test_the_belt_answers_while_the_arm_moves():
    bench = Bench.homed()
    bench.go(0.197, -0.200, 0.060)
    bench.until(lambda: bench.arm.moving == 1)
    bench.belt.run(0.05, False)
    bench.until(lambda: bench.fake.belt > 0, limit=0.05)
    assert bench.arm.moving == 1


def test_the_arm_and_the_belt_stand_after_the_end():
    bench = Bench.homed()
    bench.go(0.197, -0.200, 0.060)
    bench.belt.run(0.05, False)
    bench.until(lambda: bench.arm.moving == 1 and bench.fake.belt > 0)
    bench.controller.close()
    bench.controller.run()
    assert bench.fake.belt == 0
    assert not bench.fake.running
    assert not bench.fake.is_open
