# SPDX-License-Identifier: BSD-3-Clause
"""A classifier of multivariate sequences: one GMM-HMM a class.

classifier = GmmHmmClassifier(seed=1).fit(sequences, labels)
classifier.predict_proba(sequence)  # (K,), in the order of classifier.labels
stream = classifier.streaming()
stream.step(frame)  # (K,), one forward step
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from fabric_perception.gestures.checks import Array, check_sequence, check_sequences
from fabric_perception.gestures.model import GestureModel, with_context
from fabric_perception.gestures.scoring import StreamingScore, class_scores, softmax
from fabric_perception.gestures.settings import ContextSettings, HmmSettings, ScoreSettings
from fabric_perception.gestures.streams import Stream, segments


class GmmHmmClassifier:
    """Learns from labelled sequences of any width; tells how likely each class is.

    hmm: settings of every class, or by class name with "" for the others. garbage: name of the
    class that gets what is like nothing seen in training, None for none.
    """

    def __init__(
        self,
        hmm: HmmSettings | dict[str, HmmSettings] | None = None,
        context: ContextSettings | None = None,
        score: ScoreSettings | None = None,
        garbage: str | None = None,
        seed: int = 0,
    ) -> None:
        given = dict(hmm) if isinstance(hmm, dict) else {"": hmm or HmmSettings()}
        self._hmm = {"": HmmSettings(), **given}
        self._context = context or ContextSettings()
        self.score = score or ScoreSettings()
        self._garbage = garbage
        self._seed = seed
        self._model: GestureModel | None = None

    @classmethod
    def of(cls, model: GestureModel, score: ScoreSettings) -> "GmmHmmClassifier":
        """A classifier that was trained before."""
        classifier = cls(score=score)
        classifier._model = model
        return classifier

    @property
    def model(self) -> GestureModel:
        """What was learnt. Raises ValueError before `fit`."""
        if self._model is None:
            raise ValueError("the classifier is not trained; call fit first")
        return self._model

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the classes in the order of the posteriors."""
        return self.model.labels

    def fit(
        self, sequences: Sequence[Any], labels: Sequence[str], order: Sequence[str] | None = None
    ) -> "GmmHmmClassifier":
        """Train on sequences (frames, D), each of one class; return the classifier itself.

        order: of the classes, else alphabetical. Raises ValueError naming a bad sequence, a class
        without sequences, or a class that cannot be trained; the former model then stays.
        """
        checked = check_sequences(sequences, labels)
        lags = np.array(self._context.lags)
        return self._fit([with_context(s, lags) for s in checked], list(labels), [], order)

    def fit_streams(
        self, streams: Sequence[Stream], order: Sequence[str] | None = None
    ) -> "GmmHmmClassifier":
        """Train on recordings in which one gesture follows on another; return the classifier.

        Also learns which class follows on which. Raises ValueError as `fit`.
        """
        found = [segments(stream, self._context.lags) for stream in streams]
        sequences = [frames for one in found for _, frames in one]
        labels = [label for one in found for label, _ in one]
        follows = [two for one in found for two in zip(one, one[1:], strict=False)]
        pairs = [(a, b) for (a, _), (b, _) in follows if a != b]
        check_sequences(sequences, labels)
        return self._fit(sequences, labels, pairs, order)

    def predict_proba(self, sequence: Any) -> Array:
        """(K,) posterior of the classes for one whole sequence (frames, D); sums to 1.

        Frames weigh `evidence_weight` each, as in a stream. Raises ValueError for a bad sequence.
        """
        frames = check_sequence(sequence, self.model.width)
        evidence = self.score.evidence_weight * len(frames) * class_scores(self.model, frames)
        with np.errstate(divide="ignore"):
            return softmax(evidence + np.log(self.model.prior))

    def predict(self, sequence: Any) -> str:
        """Name of the most likely class of one whole sequence (frames, D)."""
        return self.labels[int(np.argmax(self.predict_proba(sequence)))]

    def streaming(self, evidence_weight: float | None = None, lag: int = 0) -> StreamingScore:
        """A fresh stream: `step(frame)` returns the posterior (K,) of the moment `lag` frames ago.

        evidence_weight: in place of that of the settings.
        """
        return StreamingScore(self.model, self.score, evidence_weight, lag)

    def _fit(
        self,
        sequences: list[Array],
        labels: list[str],
        pairs: list[tuple[str, str]],
        order: Sequence[str] | None,
    ) -> "GmmHmmClassifier":
        # hmmlearn is wanted for training alone: who only recognises does without it
        from fabric_perception.gestures.joining import (  # noqa: PLC0415
            Examples,
            TrainingSettings,
            train_model,
        )

        names = tuple(sorted(set(labels)) if order is None else order)
        settings = TrainingSettings(self._hmm, self._context, self.score, self._garbage, self._seed)
        self._model = train_model(Examples(sequences, labels, pairs), names, settings)
        return self
