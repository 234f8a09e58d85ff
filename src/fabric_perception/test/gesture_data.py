# SPDX-License-Identifier: BSD-3-Clause
"""Small sets of sequences and recordings for the tests of gestures."""

import numpy as np

from fabric_perception.gestures.features import FeatureSettings
from fabric_perception.gestures.recording import GRASP, IDLE, OTHER, WARN, Recording

NAMES = ("still", "ramp", "wave")
REST = np.array(FeatureSettings().rest)
PICK_POINT = np.array(FeatureSettings().pick_point)
STOP = np.array([0.42, 0.10, 0.34])
HELMET = np.array([0.70, 0.14, 0.55])


def still(rng, frames=25):
    """Does not move at all: the class that breaks naive training."""
    return np.full((frames, 2), 0.5)


def ramp(rng, frames=25):
    """Goes from one place to another."""
    way = np.linspace(0.0, 3.0, frames)
    return np.c_[way, np.zeros(frames)] + 0.05 * rng.standard_normal((frames, 2))


def wave(rng, frames=25):
    """Goes round and round, from anywhere on the circle."""
    phase = 0.6 * np.arange(frames) + rng.uniform(0.0, 6.0)
    return np.c_[np.sin(phase), np.cos(phase)] + 0.1 * rng.standard_normal((frames, 2))


MAKERS = dict(zip(NAMES, (still, ramp, wave), strict=True))


def labelled(rng, each=8):
    """Sequences of all three kinds and their labels."""
    names = [name for name in NAMES for _ in range(each)]
    return [MAKERS[name](rng, int(rng.integers(15, 40))) for name in names], names


def recording(person, seed, rounds=4, rate=15.0):
    """A person who rests, grasps, rests, warns, rests, touches the helmet; places in cell, m."""
    rng = np.random.default_rng(seed)
    rest = REST + rng.uniform(-0.03, 0.03, 3)
    hands, labels = [], []
    for _ in range(rounds):
        for label, goal in ((GRASP, PICK_POINT), (WARN, STOP), (OTHER, HELMET)):
            _stay(hands, labels, rest, rng.uniform(1.0, 3.0), IDLE, rate)
            goal = goal + rng.uniform(-0.02, 0.02, 3)
            _go(hands, labels, rest, goal, label, rate)
            _stay(hands, labels, goal, rng.uniform(0.8, 1.5), label, rate, waves=label == WARN)
            _go(hands, labels, goal, rest, IDLE if label == WARN else label, rate)
    hand = np.array(hands) + rng.normal(0.0, 0.002, (len(hands), 3))
    hand[rng.random(len(hand)) < 0.05] = np.nan
    target = np.tile(PICK_POINT, (len(hand), 1))
    return Recording(person, np.arange(len(hand)) / rate, hand, target, np.array(labels))


def _stay(hands, labels, place, time, label, rate, waves=False):
    for k in range(round(time * rate)):
        swing = 0.06 * np.sin(11.0 * k / rate) if waves else 0.0
        hands.append(place + (0.0, swing, 0.0))
        labels.append(label)


def _go(hands, labels, start, end, label, rate):
    steps = round(0.6 * rate)
    for k in range(steps):
        s = (k + 1) / steps
        hands.append(start + (10 * s**3 - 15 * s**4 + 6 * s**5) * (end - start))
        labels.append(label)
