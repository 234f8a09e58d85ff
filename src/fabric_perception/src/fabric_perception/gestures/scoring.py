# SPDX-License-Identifier: BSD-3-Clause
"""Scores of a trained model: whole sequences against each class, or frame after frame."""

from collections import deque
from typing import Any

import numpy as np

from fabric_perception.gestures.checks import Array, check_sequence
from fabric_perception.gestures.model import Emission, GestureModel, with_context
from fabric_perception.gestures.settings import ScoreSettings


def entries(model: GestureModel, late: float) -> Array:
    """(K, N): where a gesture of each class begins; `late` is the share that begins anywhere."""
    member = model.members().T
    anywhere = member / member.sum(axis=1, keepdims=True)
    return (1.0 - late) * member * model.start + late * anywhere


def class_scores(model: GestureModel, sequence: Any) -> Array:
    """(K,) log likelihood of the sequence (frames, D) under each class alone, nat a frame.

    The forward algorithm over all states at once: no state leads into another class.
    Raises ValueError when the sequence is empty, of another width or not finite.
    """
    frames = check_sequence(sequence, model.width)
    density = Emission(model).log_density(with_context(frames, model.lags))
    member = model.members()
    forward, total = model.start, np.zeros(model.n_classes)
    for i, row in enumerate(density):
        top = np.where(member > 0.0, row[:, None], -np.inf).max(axis=0)
        before = forward if i == 0 else forward @ model.follow
        forward = before * np.exp(row - top[model.owner])
        each = np.maximum(forward @ member, np.finfo(float).tiny)
        forward = forward / each[model.owner]
        total += top + np.log(each)
    return total / len(frames)


def softmax(scores: Array) -> Array:
    """The distribution proportional to exp(scores), same shape; scores (K,)."""
    weights = np.exp(scores - scores.max())
    return weights / weights.sum()


class StreamingScore:
    """Posterior over the classes, carried on by one forward step a frame.

    The classes' models are joined into one: a gesture ends with probability e_i in state i, and
    another begins, so that no window has to be chosen. With A the joint transitions, b the
    densities and w the weight of evidence: alpha_t ~ (alpha_{t-1} A) * b(x_t)^w.

    With a `lag` of L frames the posterior speaks of the moment L frames ago, in the light of all
    that was seen since (fixed-lag smoothing): alpha_{t-L} * beta with beta = A (b(x)^w * beta)
    back from the newest frame. Until there are so many it speaks of the first.
    """

    def __init__(
        self,
        model: GestureModel,
        settings: ScoreSettings,
        evidence_weight: float | None = None,
        lag: int = 0,
    ) -> None:
        """evidence_weight: in place of that of the settings. Raises ValueError for a lag < 0."""
        if lag < 0:
            raise ValueError(f"lag is {lag} frames; it must not be less than 0")
        self._past: deque[tuple[Array, Array]] = deque(maxlen=lag + 1)  # alpha, b^w; oldest first
        self._emission = Emission(model)
        self._member = model.members()
        self._width = model.width
        self._lags = model.lags
        self._before: deque[Array] = deque(maxlen=int(model.lags[-1]) + 1)  # the newest first
        self._weight = evidence_weight or settings.evidence_weight
        end = np.maximum(model.leave, settings.interruption)[:, None]
        begin = model.next_class @ entries(model, settings.late_entry)
        self._joint = (1.0 - end) * model.follow + end * begin[model.owner]
        self._first = model.prior @ entries(model, 1.0)
        self._alpha = self._first
        self.reset()

    def reset(self) -> None:
        """Forget everything seen."""
        self._alpha = self._first
        self._before.clear()
        self._past.clear()

    @property
    def posterior(self) -> Array:
        """(K,) of the classes `lag` frames ago, after what was seen so far; sums to 1."""
        if len(self._past) < 2:
            return self._alpha @ self._member
        later = np.ones(len(self._alpha))
        for _, likelihood in list(self._past)[:0:-1]:
            later = self._joint @ (likelihood * later)
            later /= max(later.max(), np.finfo(float).tiny)
        then = self._past[0][0] * later
        if then.sum() <= 0.0:  # too unlikely for floating point: what is likely now has to do
            then = self._alpha
        return (then / then.sum()) @ self._member

    @property
    def states(self) -> Array:
        """(N,) of the states of all classes now, whatever the lag; sums to 1."""
        return self._alpha.copy()

    def step(self, frame: Any | None) -> Array:
        """Take one frame (D,), None where nothing was seen; return the posterior (K,).

        Raises ValueError when the frame is of another width or not finite; then nothing changes.
        """
        if frame is None:
            return self._pass_over()
        now = check_sequence([frame], self._width, "frame")[0]
        self._before.appendleft(now)
        oldest = len(self._before) - 1
        context = np.concatenate([self._before[min(lag, oldest)] for lag in self._lags])
        density = self._weight * self._emission.log_density(context[None, :])[0]
        likelihood = np.exp(density - density.max())
        alpha = (self._alpha @ self._joint) * likelihood
        if alpha.sum() <= 0.0:  # what is seen cannot follow on what was: start anew from it
            alpha = self._first * likelihood
            self._past.clear()
        return self._go_on(alpha, likelihood)

    def _pass_over(self) -> Array:
        """Let a frame pass without evidence; the hand is taken to be where it was."""
        if self._before:
            self._before.appendleft(self._before[0])
        return self._go_on(self._alpha @ self._joint, np.ones(len(self._alpha)))

    def _go_on(self, alpha: Array, likelihood: Array) -> Array:
        self._alpha = alpha / alpha.sum()
        self._past.append((self._alpha, likelihood))
        return self.posterior

    def run(self, frames: Any) -> Array:
        """(frames, K): the posterior after each of the frames (frames, D), rows of NaN where there
        was nothing to be seen."""
        rows = np.asarray(frames, dtype=float)
        return np.array([self.step(None if np.isnan(row).all() else row) for row in rows])
