# SPDX-License-Identifier: BSD-3-Clause
"""What simpler ways of recognising gestures reach on the same people."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from fabric_perception.gestures.evaluation import Score, score_stream, total
from fabric_perception.gestures.recording import LABELS, WARN, Recording
from fabric_perception.gestures.reference import NearestWindow
from fabric_perception.gestures.settings import PLAIN
from fabric_perception.gestures.workshop import Recipe, Watched, judge, train

FOLDS = 2  # groups of people, each left out once
WINDOW = 10  # frames
TEMPLATES = 100  # training windows a class
EVERY = 5  # frames from one judged window to the next

COLUMNS = {
    "accuracy": "accuracy",
    "accuracy_settled": "settled",
    "accuracy_at_once": "at once",
    "warning_recall": "warning recall",
    "false_warnings_in_10_min": "false in 10 min",
    "change_seen_median_s": "change seen, median s",
}


def compare(data: Sequence[Recording], recipe: Recipe, seed: int) -> dict[str, dict[str, float]]:
    """Return figures by the name of the way, each judged on groups of people not trained on.

    Fewer people are trained on than where each is left out alone, and the nearest window is asked
    at every EVERY-th frame only, to save time.
    """
    thesis = replace(recipe.features, kind="thesis")
    ways = {
        "default": (recipe.features, recipe),
        "default features, each frame alone": (recipe.features, replace(recipe, context=PLAIN)),
        "thesis' three scalars, each frame alone": (thesis, replace(recipe, context=PLAIN)),
        "thesis' three scalars, with context": (thesis, recipe),
    }
    found = {}
    for name, (features, way) in ways.items():
        watched = [Watched.of(one, features) for one in data]
        found[name] = _figures(total(_trained(fold, way, seed) for fold in _folds(watched)))
    watched = [Watched.of(one, recipe.features) for one in data]
    rng = np.random.default_rng(seed)
    nearest = total(_nearest(fold, recipe, rng) for fold in _folds(watched))
    return {**found, "1-NN DTW over 1 s, default features": _figures(nearest)}


def comparison_table(found: Mapping[str, Mapping[str, float]]) -> str:
    """A Markdown table of what `compare` found."""
    lines = ["| | " + " | ".join(COLUMNS.values()) + " |", "| --- |" + " --- |" * len(COLUMNS)]
    for name, figures in found.items():
        cells = " | ".join(f"{figures[key]:.3f}" if key in figures else "-" for key in COLUMNS)
        lines.append(f"| {name} | {cells} |")
    return "\n".join(lines)


def _folds(watched: Sequence[Watched]) -> list[tuple[list[Watched], list[Watched]]]:
    """(to train on, to judge) of each group of people."""
    people = sorted({one.person for one in watched})
    groups = [set(people[i::FOLDS]) for i in range(min(FOLDS, len(people)))]
    return [
        ([w for w in watched if w.person not in mine], [w for w in watched if w.person in mine])
        for mine in groups
    ]


def _trained(fold: tuple[list[Watched], list[Watched]], recipe: Recipe, seed: int) -> Score:
    classifier = train(fold[0], recipe, seed)
    return total(judge(classifier, one, recipe) for one in fold[1])


def _nearest(
    fold: tuple[list[Watched], list[Watched]], recipe: Recipe, rng: np.random.Generator
) -> Score:
    lag, _ = recipe.recogniser.lags(recipe.features.period)
    pieces = [_windows(one, lag) for one in fold[0]]
    windows, labels = (np.concatenate(part) for part in zip(*pieces, strict=True))
    chosen = np.concatenate([
        rng.permutation(np.flatnonzero(labels == k))[:TEMPLATES] for k in range(len(LABELS))
    ])  # fmt: skip
    nearest = NearestWindow(windows[chosen], labels[chosen].tolist())
    scores = []
    for one in fold[1]:
        mine, done = _windows(one, lag)
        found = np.eye(len(LABELS))[[nearest.predict(window) for window in mine[::EVERY]]]
        warned = found[:, WARN] > 0.0
        told = warned & ~np.append(False, warned[:-1])
        times = one.t[WINDOW - 1 :][::EVERY]
        scores.append(score_stream(times, done[::EVERY], found, told))
    score = total(scores)
    late = lag * recipe.features.period
    return replace(
        score,
        delays=tuple(delay + late for delay in score.delays),
        warning_delays=tuple(delay + late for delay in score.warning_delays),
        at_once=np.zeros_like(score.at_once),
    )


def _windows(one: Watched, lag: int) -> tuple[np.ndarray, np.ndarray]:
    """Windows (n, WINDOW, D) and what was done (n,) `lag` frames before their ends; what was seen
    last stays."""
    seen = ~np.isnan(one.frames).all(axis=1)
    last = np.maximum.accumulate(np.where(seen, np.arange(len(seen)), int(np.argmax(seen))))
    slid = np.lib.stride_tricks.sliding_window_view(one.frames[last], WINDOW, axis=0)
    return slid.transpose(0, 2, 1), one.labels[WINDOW - 1 - lag : len(one.labels) - lag]


def _figures(score: Score) -> dict[str, float]:
    figures = score.figures()
    return {key: round(figures[key], 4) for key in COLUMNS if figures[key] == figures[key]}
