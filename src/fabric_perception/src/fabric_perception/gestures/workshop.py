# SPDX-License-Identifier: BSD-3-Clause
"""Trains gesture classifiers on recordings and judges them on people they were not trained on."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from fabric_perception.gestures.checks import Array
from fabric_perception.gestures.classifier import GmmHmmClassifier
from fabric_perception.gestures.evaluation import Score, score_stream, total
from fabric_perception.gestures.features import FeatureSettings, features_of
from fabric_perception.gestures.recogniser import RecogniserParameters
from fabric_perception.gestures.recording import LABELS, OTHER, Recording
from fabric_perception.gestures.settings import ContextSettings, HmmSettings, ScoreSettings
from fabric_perception.gestures.streams import Stream
from fabric_perception.gestures.warning_road import WarningRoad

Tell = Callable[[str], None]


@dataclass(frozen=True)
class Recipe:
    """Everything that decides how a classifier comes out of recordings."""

    features: FeatureSettings = field(default_factory=FeatureSettings)
    hmm: HmmSettings = field(default_factory=HmmSettings)
    context: ContextSettings = field(default_factory=ContextSettings)
    score: ScoreSettings = field(default_factory=ScoreSettings)
    recogniser: RecogniserParameters = field(default_factory=RecogniserParameters)


class Watched(NamedTuple):
    """Features of one recording: times (n,) s, frames (n, D) with rows of NaN, labels (n,)."""

    person: str
    situation: str
    t: Array
    frames: Array
    labels: Array

    @classmethod
    def of(cls, recording: Recording, features: FeatureSettings) -> "Watched":
        """The features of a recording, as they come in the node."""
        frames = features_of(recording, features)
        return cls(recording.person, recording.situation, *frames)

    def stream(self) -> Stream:
        """With the names of the labels."""
        return Stream(self.frames, [LABELS[i] if i >= 0 else "" for i in self.labels])


def train(watched: Sequence[Watched], recipe: Recipe, seed: int) -> GmmHmmClassifier:
    """Return a classifier trained on all of them. Raises ValueError as GmmHmmClassifier.fit."""
    classifier = GmmHmmClassifier(recipe.hmm, recipe.context, recipe.score, LABELS[OTHER], seed)
    return classifier.fit_streams([one.stream() for one in watched], LABELS)


def judge(classifier: GmmHmmClassifier, watched: Watched, recipe: Recipe) -> Score:
    """Return how well the classifier follows one recording, frame after frame."""
    p = recipe.recogniser
    lag, warning_lag = p.lags(recipe.features.period)
    stream = classifier.streaming(lag=lag)
    road = WarningRoad(
        classifier.streaming(p.warning_weight, warning_lag), p.warning_threshold, p.warning_rearm
    )
    rows = [None if np.isnan(row).all() else row for row in watched.frames]
    told = np.array([road.step(row) for row in rows])
    posteriors = np.array([stream.step(row) for row in rows])
    return score_stream(watched.t, watched.labels, posteriors, told, lag)


def leave_one_person_out(
    watched: Sequence[Watched], recipe: Recipe, seed: int, tell: Tell = lambda line: None
) -> dict[str, Score]:
    """Return how classifiers trained on the others follow each person: the sum over all people, by
    situation.

    Raises ValueError when there is only one person.
    """
    people = sorted({one.person for one in watched})
    if len(people) < 2:
        raise ValueError(f"there is {len(people)} person; leaving one out needs two or more")
    scores: dict[str, list[Score]] = {one.situation: [] for one in watched}
    for person in people:
        others = [one for one in watched if one.person != person]
        classifier = train(others, recipe, seed)
        mine = [(one.situation, judge(classifier, one, recipe)) for one in watched
                if one.person == person]  # fmt: skip
        for situation, score in mine:
            scores[situation].append(score)
        tell(f"{person}: {_in_a_line(total(score for _, score in mine))}")
    return {situation: total(some) for situation, some in scores.items()}


def _in_a_line(score: Score) -> str:
    figures = score.figures()
    return (
        f"accuracy {figures['accuracy']:.3f}, settled {figures['accuracy_settled']:.3f}, "
        f"{score.recalled} of {score.warnings} warnings, {score.false_warnings} false"
    )
