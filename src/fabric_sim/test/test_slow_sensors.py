# SPDX-License-Identifier: BSD-3-Clause
"""Simulated load cells and light barrier err as their file says, and perception copes with it."""

from dataclasses import replace

import numpy as np
import pytest
import yaml
from camera_helpers import CONFIGS

from fabric_perception.infrared import LightBarrier
from fabric_perception.load_cells import ScaleParameters, TrayScale
from fabric_sim.entries import ConfigError, Entries
from fabric_sim.infrared import InfraredBarrier, InfraredParameters
from fabric_sim.load_cells import HIGH, LOW, LoadCellBank, LoadCellParameters

FILE = Entries.read(CONFIGS / "sensors.yaml")
CELLS = LoadCellParameters.read(FILE.branch("load_cells"))
BARRIER = InfraredParameters.read(FILE.branch("infrared"))
QUIET = replace(CELLS, noise=0.0, drift=0.0, spike=0.0)
TICK = 0.05


def bank(parameters=CELLS, trays=(1,), seed=1):
    return LoadCellBank(parameters, trays, np.random.default_rng(seed))


def grams(counts, empty):
    """Course of one tray's weight, (n,)."""
    return (np.concatenate(counts)[:, 0] - empty) / CELLS.counts_per_gram


def empty_of(cells):
    return cells.step(TICK, {})[0, 0]


def test_a_load_makes_the_tray_swing_and_come_to_rest():
    cells = bank(QUIET)
    empty = empty_of(cells)
    course = grams([cells.step(TICK, {1: 18.0}) for _ in range(20)], empty)
    assert len(course) == 80
    assert course.max() > 20.0
    np.testing.assert_allclose(course[60:], 18.0, atol=0.05)


def test_cells_drift_slowly():
    ends = []
    for seed in range(8):
        cells = bank(replace(CELLS, noise=0.0, spike=0.0, swing=1.0), seed=seed)
        empty = empty_of(cells)
        course = grams([cells.step(TICK, {}) for _ in range(400)], empty)
        ends.append(course[-1])
        assert np.abs(np.diff(course)).max() < 0.05
    assert np.std(ends) == pytest.approx(CELLS.drift * np.sqrt(20.0), rel=0.5)


def test_now_and_then_a_reading_is_nonsense():
    cells = bank(replace(CELLS, spike=0.05))
    counts = np.concatenate([cells.step(TICK, {}) for _ in range(500)])[:, 0]
    nonsense = np.isin(counts, (HIGH, LOW, 0)).mean()
    assert nonsense == pytest.approx(0.05, abs=0.015)


def test_a_hand_presses_unevenly_and_lets_go():
    cells = bank(QUIET, trays=(1, 2))
    empty = empty_of(cells)
    pressed = grams([cells.step(TICK, {}, (1,)) for _ in range(60)], empty)[40:]
    assert pressed.mean() > 5.0
    assert pressed.std() > 1.0
    after = grams([cells.step(TICK, {}) for _ in range(40)], empty)
    np.testing.assert_allclose(after[-20:], 0.0, atol=0.1)


def test_edges_of_the_barrier_chatter_and_its_controller_does_not():
    device = InfraredBarrier(BARRIER, np.random.default_rng(3))
    flips, levels = 0, []
    for tick in range(400):
        there = tick % 20 >= 10
        samples = device.step(TICK, there)
        assert len(samples) == 20
        flips += np.count_nonzero(np.diff(samples))
        levels.append(device.level == there)
    assert flips > 40
    assert all(levels)


@pytest.mark.parametrize("seed", range(101, 104))
def test_perception_finds_every_edge_once(seed):
    device, barrier = InfraredBarrier(BARRIER, np.random.default_rng(seed)), LightBarrier()
    rng, there, truth, found, n = np.random.default_rng(seed + 1), False, [], [], 0
    for tick in range(1200):
        if rng.random() < 0.05:
            there = not there
            truth.append(tick * TICK)
        for level in device.step(TICK, there):
            n += 1
            edge = barrier.step(n / BARRIER.rate, bool(level))
            if edge is not None:
                found.append(edge.t)
    np.testing.assert_allclose(found, truth, atol=0.025)


@pytest.mark.parametrize("seed", range(101, 106))
def test_perception_counts_every_cube_once_and_in_time(seed):
    cells = bank(seed=seed)
    scale = TrayScale(ScaleParameters(CELLS.counts_per_gram, 18.0))
    rng, load, placed, told = np.random.default_rng(seed), 0.0, [], []
    due = 3.0
    for tick in range(1200):
        now = tick * TICK
        if now >= due and now < 55.0:
            load += cells.weight()
            placed.append(now)
            due = now + rng.uniform(2.5, 8.0)
        touched = (
            (1,) if due - 0.3 <= now < 55.0 else ()
        )  # the hand leaves with the cube it puts down
        for i, (count,) in enumerate(cells.step(TICK, {1: load}, touched)):
            t = now + (i + 1) / CELLS.rate
            change = scale.step(t, int(count))
            told += [(t, change)] if change is not None else []
    assert [change.cubes for _, change in told] == [1] * len(placed)
    delays = [t - p for (t, _), p in zip(told, placed, strict=True)]
    assert np.median(delays) < 0.6
    assert max(delays) < 1.2


@pytest.mark.parametrize(
    ("branch", "key", "value", "words"),
    [
        ("load_cells", "rate", 0.0, "load_cells.rate is 0.0, want 1 to 1000"),
        ("load_cells", "counts_per_gram", -1.0, "load_cells.counts_per_gram is -1.0"),
        ("load_cells", "press", [9.0, 1.0], "load_cells.press is [9.0, 1.0]"),
        ("infrared", "wrong", 0.9, "infrared.wrong is 0.9"),
        ("infrared", "chatter", "long", "infrared.chatter is 'long', want 2 numbers"),
    ],
)
def test_damaged_files_are_refused_by_name(tmp_path, branch, key, value, words):
    tree = yaml.safe_load((CONFIGS / "sensors.yaml").read_text())
    tree[branch][key] = value
    path = tmp_path / "sensors.yaml"
    path.write_text(yaml.safe_dump(tree))
    entries = Entries.read(path)
    with pytest.raises(ConfigError) as caught:
        LoadCellParameters.read(entries.branch("load_cells"))
        InfraredParameters.read(entries.branch("infrared"))
    assert words in str(caught.value)


@pytest.mark.parametrize("dt", [0.0, -0.05, float("nan")])
def test_time_passes_forwards(dt):
    with pytest.raises(ValueError, match="cannot pass"):
        bank().step(dt, {})
    with pytest.raises(ValueError, match="cannot pass"):
        InfraredBarrier(BARRIER, np.random.default_rng(1)).step(dt, False)
