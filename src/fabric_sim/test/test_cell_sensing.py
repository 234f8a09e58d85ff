# SPDX-License-Identifier: BSD-3-Clause
"""Direct sensing: how often, how late and how surely it errs."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fabric_msgs.msg import Container, Cube, HumanActivity
from fabric_sim.entries import ConfigError
from fabric_sim.sensing import Behaviour, ColourSensor, LoadCells, PersonSensor, load_sensing

PATH = Path(__file__).resolve().parents[1] / "config" / "sensing.yaml"
PARAMETERS = load_sensing(PATH)
EXACT = replace(PARAMETERS, confusion=0.0)
IDLE = Behaviour()
GRASP = Behaviour(HumanActivity.GRASP)
WARN = Behaviour(HumanActivity.WARN)
LOOK = Behaviour(looking_around=True)
AWAY = Behaviour(present=False)


def watch(sensor: PersonSensor, start: float, behaviour: Behaviour, seconds: float = 1.0):
    """Percepts at 10 Hz."""
    return [sensor.sense(round(start + 0.1 * i, 6), behaviour) for i in range(round(10 * seconds))]


def rng(seed: int = 1) -> np.random.Generator:
    return np.random.default_rng(seed)


def rates(behaviour: Behaviour, count: int = 8000) -> dict[Behaviour, float]:
    """What stretches of one behaviour are taken for, in shares."""
    sensor, seen, t = PersonSensor(PARAMETERS, rng()), {}, 0.0
    other = IDLE if behaviour != IDLE else GRASP
    for _ in range(count):
        watch(sensor, t, other, 0.5)
        taken = watch(sensor, t + 0.5, behaviour, 0.5)[-1].behaviour
        seen[taken] = seen.get(taken, 0) + 1 / count
        t = round(t + 1.0, 6)
    return seen


def test_grasps_are_confused_in_one_of_twenty_half_with_warnings_half_dropped():
    seen = rates(GRASP)
    assert seen[GRASP] == pytest.approx(0.95, abs=0.01)
    assert seen[WARN] == pytest.approx(0.025, abs=0.007)
    assert seen[IDLE] == pytest.approx(0.025, abs=0.007)


def test_warnings_are_confused_the_other_way_round():
    seen = rates(WARN)
    assert seen[WARN] == pytest.approx(0.95, abs=0.01)
    assert seen[GRASP] == pytest.approx(0.025, abs=0.007)


def test_idling_is_confused_with_looking_around():
    assert rates(IDLE)[LOOK] == pytest.approx(0.05, abs=0.01)
    assert rates(LOOK)[IDLE] == pytest.approx(0.05, abs=0.01)


def test_nobody_is_never_taken_for_somebody():
    assert rates(AWAY, 500) == pytest.approx({AWAY: 1.0})


def test_an_error_lasts_as_long_as_the_behaviour():
    sensor = PersonSensor(replace(PARAMETERS, confusion=1.0, swap_share=1.0), rng())
    watch(sensor, 0.0, IDLE)
    late = watch(sensor, 1.0, GRASP, 5.0)[5:]
    assert {p.behaviour.activity for p in late} == {HumanActivity.WARN}


def test_a_change_is_recognised_after_the_delay():
    sensor = PersonSensor(EXACT, rng())
    watch(sensor, 0.0, IDLE)
    activities = [p.behaviour.activity for p in watch(sensor, 1.0, GRASP)]
    first = activities.index(HumanActivity.GRASP)
    assert 2 <= first <= 4
    assert set(activities[first:]) == {HumanActivity.GRASP}


def test_posteriors_sum_to_one_and_are_as_sure_as_configured():
    sensor = PersonSensor(PARAMETERS, rng())
    for i, behaviour in enumerate([IDLE, GRASP, WARN, LOOK, AWAY, IDLE] * 20):
        for percept in watch(sensor, float(i), behaviour):
            assert sum(percept.posterior) == pytest.approx(1.0)
            if percept.behaviour.present:
                sure = percept.posterior[percept.behaviour.activity]
                assert PARAMETERS.certainty[0] <= sure <= PARAMETERS.certainty[1]


def test_each_recognised_warning_is_announced_once():
    sensor = PersonSensor(EXACT, rng())
    watch(sensor, 0.0, IDLE)
    first = [p.warning for p in watch(sensor, 1.0, WARN, 2.0)]
    watch(sensor, 3.0, IDLE)
    second = [p.warning for p in watch(sensor, 4.0, WARN, 2.0)]
    assert sum(first) == 1 and sum(second) == 1
    assert 2 <= first.index(True) <= 4


def test_evidence_ages_while_nobody_is_in_view():
    sensor = PersonSensor(EXACT, rng())
    watch(sensor, 0.0, IDLE)
    percepts = watch(sensor, 1.0, AWAY, 3.0)
    assert percepts[0].evidence_age == 0.0
    assert not percepts[-1].behaviour.present
    assert 2.4 < percepts[-1].evidence_age < 2.9
    assert percepts[-1].posterior == (0.25,) * 4


def test_colours_are_read_wrongly_as_often_as_configured():
    sensor = ColourSensor(PARAMETERS, rng())
    reads = [sensor.read(Cube.COLOUR_RED) for _ in range(10_000)]
    wrong = [colour for colour, _ in reads if colour != Cube.COLOUR_RED]
    assert len(wrong) / len(reads) == pytest.approx(PARAMETERS.colour_misread, abs=0.006)
    assert set(wrong) == {Cube.COLOUR_GREEN, Cube.COLOUR_BLUE}
    assert all(0.85 <= confidence <= 0.99 for _, confidence in reads)


def test_load_cells_report_each_cube_once_after_settling():
    cells = LoadCells(PARAMETERS, rng())
    cells.put(0.0, 1, Container.OWNER_PERSON, 7)
    cells.put(0.0, 4, Container.OWNER_ROBOT, 8)
    assert cells.settled(0.05) == []
    assert cells.settled(0.35) == [(4, 8)]
    assert cells.settled(1.55) == [(1, 7)]
    assert cells.settled(100.0) == []


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("confusion: 1.5", "direct.confusion is 1.5, want 0 to 1"),
        ("delay: [0.4, 0.2]", "direct.delay is [0.4, 0.2], want the smaller number first"),
        ("settle_belt: [0.1]", "direct.settle_belt is [0.1], want 2 numbers"),
    ],
)
def test_bad_parameters_are_named(tmp_path, line, words):
    lines = PATH.read_text(encoding="utf-8").splitlines()
    key = line.split(":")[0]
    path = tmp_path / "sensing.yaml"
    path.write_text(
        "\n".join(f"  {line}" if old.strip().startswith(key + ":") else old for old in lines),
        encoding="utf-8",
    )
    with pytest.raises(ConfigError) as caught:
        load_sensing(path)
    assert words in str(caught.value)
