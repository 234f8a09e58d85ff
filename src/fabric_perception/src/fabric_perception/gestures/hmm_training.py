# SPDX-License-Identifier: BSD-3-Clause
"""Trains the GMM-HMM of one class with hmmlearn, and does not trust what comes out.

Plain expectation-maximisation fails on a class that hardly moves: variances vanish and parameters
become NaN. Against that: a floor under the variances in every M-step, dither, a start by uniform
segmentation, and checks after which another seed is tried.
"""

from typing import NamedTuple

import numpy as np
from hmmlearn.hmm import GMMHMM
from scipy.cluster.vq import kmeans2

from fabric_perception.gestures.checks import Array
from fabric_perception.gestures.settings import HmmSettings

LOSS_TOLERANCE = 1e-6  # relative; a likelihood that falls by more is a failure
STAY, NEXT = 0.7, 0.25  # transitions to begin with; the rest jumps over one state
EMPTY = 1e-9  # frames; less does not change a state


class TrainingError(ValueError):
    """A class cannot be trained; the message names it and says why."""


class ClassHmm(NamedTuple):
    """The trained GMM-HMM of one class: S states, M Gaussians each, D features."""

    start: Array  # (S,)
    follow: Array  # (S, S)
    leave: Array  # (S,) probability a frame that the gesture is over
    weights: Array  # (S, M)
    means: Array  # (S, M, D)
    variances: Array  # (S, M, D)
    history: Array  # log likelihood after each iteration, nat a frame


class _FlooredHmm(GMMHMM):
    """hmmlearn's model that starts where it is told and keeps its variances above a floor.

    Given the means, the floor is the constrained maximum of the M-step, so that the likelihood
    still never falls.
    """

    floor = 0.0

    def _init(self, X: Array, lengths: object = None) -> None:
        self._check_and_set_n_features(X)
        self._init_covar_priors()
        self._fix_priors_shape()

    def _do_mstep(self, stats: dict[str, Array]) -> None:
        before = (self.transmat_, self.weights_, self.means_, self.covars_)
        with np.errstate(divide="ignore", invalid="ignore"):
            super()._do_mstep(stats)
        rows = self.transmat_.sum(axis=1) > 0.0
        self.transmat_ = np.where(rows[:, None], self.transmat_, before[0])
        used = (stats["post_mix_sum"] > EMPTY).any(axis=1)
        self.weights_ = np.where(used[:, None], self.weights_, before[1])
        used_mix = (stats["post_mix_sum"] > EMPTY)[:, :, None]
        self.means_ = np.where(used_mix, self.means_, before[2])
        self.covars_ = np.maximum(np.where(used_mix, self.covars_, before[3]), self.floor)


def train_class(
    name: str, sequences: list[Array], settings: HmmSettings, rng: np.random.Generator
) -> ClassHmm:
    """Return the GMM-HMM of the class `name` from its sequences (frames, D), standardised.

    Raises TrainingError when no seed gives finite parameters and a likelihood that does not fall.
    """
    n_frames = sum(len(sequence) for sequence in sequences)
    needed = settings.states * settings.mixtures
    if n_frames < needed:
        raise TrainingError(f"class {name!r} has {n_frames} frames; {needed} are needed")
    reason = ""
    for _ in range(1 + settings.retries):
        trained = _attempt(sequences, settings, rng)
        reason = _fault(trained)
        if not reason:
            return trained
    raise TrainingError(f"class {name!r} cannot be trained: {reason}")


def _attempt(sequences: list[Array], settings: HmmSettings, rng: np.random.Generator) -> ClassHmm:
    noisy = [s + settings.dither * rng.standard_normal(s.shape) for s in sequences]
    frames, lengths = np.concatenate(noisy), [len(s) for s in noisy]
    model = _FlooredHmm(
        settings.states,
        settings.mixtures,
        n_iter=settings.iterations,
        tol=settings.tolerance * len(frames),
        params="tmcw" if settings.left_right else "stmcw",
        init_params="",
        implementation="log",  # the scaled sums underflow far from a left-right model's states
    )
    model.floor = settings.variance_floor
    model.startprob_, model.transmat_ = _topology(settings)
    model.weights_, model.means_, model.covars_ = _segmentation(noisy, settings, rng)
    try:
        with np.errstate(divide="ignore", invalid="ignore"):  # what comes of it is checked
            model.fit(frames, lengths)
            occupied = model.predict_proba(frames, lengths)
    except (ValueError, FloatingPointError, ZeroDivisionError):
        occupied = np.full((len(frames), settings.states), np.nan)
    return ClassHmm(
        model.startprob_, model.transmat_, _leave(occupied, lengths), model.weights_, model.means_,
        model.covars_, np.array(model.monitor_.history) / len(frames),
    )  # fmt: skip


def _fault(trained: ClassHmm) -> str:
    """What is wrong with a trained model, empty when nothing is."""
    for field in ClassHmm._fields:
        if not np.all(np.isfinite(getattr(trained, field))):
            return f"{field} is not finite"
    losses = -np.diff(trained.history)
    allowed = LOSS_TOLERANCE * np.maximum(1.0, np.abs(trained.history[:-1]))
    falls = np.argwhere(losses > allowed)
    if len(falls):
        at = int(falls[0, 0])
        return f"the likelihood fell by {losses[at]:g} nat a frame in iteration {at + 1}"
    return ""


def _topology(settings: HmmSettings) -> tuple[Array, Array]:
    """Start (S,) and transitions (S, S) before training; what is 0 stays 0."""
    n = settings.states
    if not settings.left_right:
        follow = np.full((n, n), (1.0 - STAY) / max(1, n - 1))
        np.fill_diagonal(follow, STAY if n > 1 else 1.0)
        return np.full(n, 1.0 / n), follow
    follow = STAY * np.eye(n) + NEXT * np.eye(n, k=1) + (1.0 - STAY - NEXT) * np.eye(n, k=2)
    return np.eye(n)[0], follow / follow.sum(axis=1, keepdims=True)


def _segmentation(
    sequences: list[Array], settings: HmmSettings, rng: np.random.Generator
) -> tuple[Array, Array, Array]:
    """Weights (S, M), means and variances (S, M, D) of each sequence cut into S equal parts."""
    n, m = settings.states, settings.mixtures
    part = np.concatenate([np.arange(len(s)) * n // len(s) for s in sequences])
    frames = np.concatenate(sequences)
    weights, means, variances = [], [], []
    for state in range(n):
        mine = frames[part == state] if np.any(part == state) else frames
        centres, cluster = _clusters(mine, m, rng)
        groups = [mine[cluster == i] if np.any(cluster == i) else mine for i in range(m)]
        share = np.array([1.0 + np.sum(cluster == i) for i in range(m)])
        weights.append(share / share.sum())
        means.append(centres)
        variances.append([np.maximum(g.var(axis=0), settings.variance_floor) for g in groups])
    return np.array(weights), np.array(means), np.array(variances)


def _clusters(frames: Array, m: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """Centres (m, D) and the number of each frame's cluster (frames,)."""
    if m == 1 or len(frames) <= m:
        centres = np.repeat(frames.mean(axis=0)[None, :], m, axis=0)
        return centres, np.arange(len(frames)) % m
    seed = int(rng.integers(2**31))
    centres, cluster = kmeans2(frames, m, minit="++", seed=seed, missing="warn")
    return centres, cluster


def _leave(occupied: Array, lengths: list[int]) -> Array:
    """(S,) ends in a state over frames spent there; occupied (frames, S) of each sequence."""
    ends = occupied[np.cumsum(lengths) - 1].sum(axis=0)
    spent = np.maximum(occupied.sum(axis=0), EMPTY)
    return np.minimum(ends / spent, 1.0)
