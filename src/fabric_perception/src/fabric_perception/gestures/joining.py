# SPDX-License-Identifier: BSD-3-Clause
"""Trains every class and joins their models into one."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from fabric_perception.gestures.checks import Array
from fabric_perception.gestures.hmm_training import ClassHmm, train_class
from fabric_perception.gestures.model import GestureModel
from fabric_perception.gestures.projection import fit_projection
from fabric_perception.gestures.settings import ContextSettings, HmmSettings, ScoreSettings

UNSEEN = 1.0  # follows of each pair of classes that are taken as seen beforehand
GARBAGE_ENTRY = 0.1  # share of undefined gestures that are like none of the training


class TrainingSettings(NamedTuple):
    """How a classifier is trained: hmm by class name, "" for the others; garbage is a class."""

    hmm: dict[str, HmmSettings]
    context: ContextSettings
    score: ScoreSettings
    garbage: str | None
    seed: int


class Examples(NamedTuple):
    """What it is trained on: sequences (frames, L D) with their context, their labels, and pairs of
    labels that followed on each other (empty when that is not known)."""

    sequences: list[Array]
    labels: list[str]
    pairs: list[tuple[str, str]]


def train_model(
    examples: Examples, names: tuple[str, ...], settings: TrainingSettings
) -> GestureModel:
    """Return the model of the examples, classes in the order of names.

    Raises ValueError naming a class without sequences, an unknown label, or a class that cannot be
    trained.
    """
    _check_names(examples.labels, names, settings.garbage)
    owners = [names.index(label) for label in examples.labels]
    centre, projection = fit_projection(examples.sequences, owners, settings.context)
    seen = [(sequence - centre) @ projection for sequence in examples.sequences]
    classes, frames = [], np.zeros(len(names))
    for k, name in enumerate(names):
        mine = [sequence for sequence, owner in zip(seen, owners, strict=True) if owner == k]
        frames[k] = sum(map(len, mine))
        rng = np.random.default_rng([settings.seed, k])
        classes.append(train_class(name, mine, settings.hmm.get(name, settings.hmm[""]), rng))
    index = -1 if settings.garbage is None else names.index(settings.garbage)
    spread = np.concatenate(seen).std(axis=0)
    blocks = [
        _with_garbage(hmm, spread, settings.score) if k == index else _unbiased(hmm)
        for k, hmm in enumerate(classes)
    ]
    return GestureModel(
        labels=names,
        lags=np.array(settings.context.lags),
        centre=centre,
        projection=projection,
        next_class=_next_class(names, examples.pairs),
        prior=frames / frames.sum(),
        garbage=index,
        **_joined(blocks),
    )


def _check_names(labels: Sequence[str], names: tuple[str, ...], garbage: str | None) -> None:
    for i, label in enumerate(labels):
        if label not in names:
            raise ValueError(f"label {i} is {label!r}; the classes are {', '.join(names)}")
    for name in names:
        if name not in labels:
            raise ValueError(f"class {name!r} has no sequences")
    if garbage is not None and garbage not in names:
        raise ValueError(f"garbage is {garbage!r}; it must be one of {', '.join(names)}")


def _next_class(names: tuple[str, ...], pairs: Sequence[tuple[str, str]]) -> Array:
    """(K, K) probability of the class that follows on each; a gesture may also begin anew."""
    counts = np.full((len(names), len(names)), UNSEEN)
    for before, after in pairs:
        counts[names.index(before), names.index(after)] += 1.0
    return counts / counts.sum(axis=1, keepdims=True)


def _unbiased(hmm: ClassHmm) -> tuple[ClassHmm, Array]:
    return hmm, np.zeros(len(hmm.start))


def _with_garbage(hmm: ClassHmm, spread: Array, score: ScoreSettings) -> tuple[ClassHmm, Array]:
    """The model with one more state: the broad background of all data, spread (P,).

    A frame is rejected when its gesture scores worse than the background by `garbage_offset`.
    """
    _, m, p = hmm.means.shape
    background = np.broadcast_to((score.garbage_spread * spread) ** 2, (1, m, p))
    wider = hmm._replace(
        start=np.append((1.0 - GARBAGE_ENTRY) * hmm.start, GARBAGE_ENTRY),
        follow=block_diag(hmm.follow, [[1.0]]),
        leave=np.append(hmm.leave, hmm.leave.mean()),
        weights=np.vstack([hmm.weights, np.eye(m)[:1]]),
        means=np.concatenate([hmm.means, np.zeros((1, m, p))]),
        variances=np.concatenate([hmm.variances, background]),
    )
    return wider, np.append(np.zeros(len(hmm.start)), score.garbage_offset)


def _joined(blocks: list[tuple[ClassHmm, Array]]) -> dict[str, Array]:
    """Arrays of GestureModel over all states; mixtures are filled up with weights of zero."""
    most = max(hmm.weights.shape[1] for hmm, _ in blocks)
    sizes = [len(hmm.start) for hmm, _ in blocks]
    return {
        "owner": np.repeat(np.arange(len(blocks)), sizes),
        "start": np.concatenate([hmm.start for hmm, _ in blocks]),
        "follow": block_diag(*[hmm.follow for hmm, _ in blocks]),
        "leave": np.concatenate([hmm.leave for hmm, _ in blocks]),
        "weights": np.concatenate([_filled(hmm.weights, most, 0.0) for hmm, _ in blocks]),
        "means": np.concatenate([_filled(hmm.means, most, 0.0) for hmm, _ in blocks]),
        "variances": np.concatenate([_filled(hmm.variances, most, 1.0) for hmm, _ in blocks]),
        "bias": np.concatenate([bias for _, bias in blocks]),
    }


def _filled(array: Array, most: int, value: float) -> Array:
    """The array (S, M, ...) with `most` entries along M."""
    missing = [(0, 0)] * array.ndim
    missing[1] = (0, most - array.shape[1])
    return np.pad(array, missing, constant_values=value)
