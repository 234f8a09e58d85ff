# SPDX-License-Identifier: BSD-3-Clause
"""Linear discriminants: the directions in which the parts of gestures differ most (Fisher, Rao).

W maximises between-part against within-part scatter, so that in the projection the scatter within
parts is the identity: Gaussians with diagonal covariances fit there.
"""

from collections.abc import Sequence

import numpy as np
from scipy.linalg import eigh

from fabric_perception.gestures.checks import Array
from fabric_perception.gestures.settings import ContextSettings

RIDGE = 1e-4  # of each feature's own scatter, against features that hang together
LEAST_SCALE = 1e-9  # a feature that never changes is left as it is


def fit_projection(
    sequences: Sequence[Array], owners: Sequence[int], settings: ContextSettings
) -> tuple[Array, Array]:
    """Return centre (C,) and projection (C, P) of sequences (frames, C) of the classes `owners`.

    P is the number of dimensions asked for, or what there are to tell apart if that is less.
    """
    frames = np.concatenate(sequences)
    centre, scale = frames.mean(axis=0), frames.std(axis=0)
    scale = np.where(scale > LEAST_SCALE, scale, 1.0)
    if settings.dimensions == 0:
        return centre, np.diag(1.0 / scale)
    z = (frames - centre) / scale
    parts = np.concatenate([
        owner * settings.parts + np.arange(len(s)) * settings.parts // len(s)
        for s, owner in zip(sequences, owners, strict=True)
    ])  # fmt: skip
    within, between = _scatter(z, parts)
    within += np.diag(RIDGE * np.diag(within) + RIDGE)
    size = min(settings.dimensions, z.shape[1], len(np.unique(parts)) - 1) or 1
    _, directions = eigh(between, within)
    return centre, directions[:, ::-1][:, :size] / scale[:, None]


def _scatter(z: Array, parts: Array) -> tuple[Array, Array]:
    """Scatter (C, C) within and between the parts of frames (n, C), a frame."""
    within = np.zeros((z.shape[1], z.shape[1]))
    between = np.zeros_like(within)
    for part in np.unique(parts):
        mine = z[parts == part]
        middle = mine.mean(axis=0)
        within += (mine - middle).T @ (mine - middle)
        between += len(mine) * np.outer(middle, middle)
    return within / len(z), between / len(z)
