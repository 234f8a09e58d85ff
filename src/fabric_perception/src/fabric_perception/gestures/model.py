# SPDX-License-Identifier: BSD-3-Clause
"""The trained classifier as plain arrays: states of all classes in one row.

Classes K, states of all classes together N, Gaussians a state M, features D, frames of context L,
projected features P. Frames are looked at together with some before them: z = (x - centre) W, where
x (L D,) are the frames `lags` ago one after another. A state emits z with the density
sum_m w_m N(z; mu_m, diag(v_m)).
"""

from dataclasses import dataclass, fields

import numpy as np

from fabric_perception.gestures.checks import Array

SUM_TOLERANCE = 1e-6
LOG_2_PI = float(np.log(2.0 * np.pi))
FARTHEST = 100.0  # standard deviations; what lies beyond is like nothing anyway
NOTHING = -1e30  # log of a weight that is zero, finite so that sums stay finite


@dataclass(frozen=True)
class GestureModel:
    """Everything the scores rest on. Raises ValueError naming the array, row and value.

    labels: names of the classes. lags: (L,) frames, from 0 up. centre: (L D,). projection: W,
    (L D, P). owner: (N,) class of each state. start: (N,) sums to 1 over each class. follow: (N, N)
    within a class, rows sum to 1. leave: (N,) probability a frame that the gesture is over.
    next_class: (K, K) what comes then, rows sum to 1. prior: (K,) share of the frames, sums to 1.
    weights: (N, M), rows sum to 1. means, variances: (N, M, P). bias: (N,) added to the log
    densities, nat. garbage: class that gets what is like no gesture, -1 for none.
    """

    labels: tuple[str, ...]
    lags: Array
    centre: Array
    projection: Array
    owner: Array
    start: Array
    follow: Array
    leave: Array
    next_class: Array
    prior: Array
    weights: Array
    means: Array
    variances: Array
    bias: Array
    garbage: int = -1

    def __post_init__(self) -> None:
        _check_shapes(self)
        _check_values(self)

    @property
    def n_classes(self) -> int:
        """How many classes there are."""
        return len(self.labels)

    @property
    def width(self) -> int:
        """How many features a frame has."""
        return len(self.centre) // len(self.lags)

    def members(self) -> Array:
        """(N, K), 1 where the state belongs to the class."""
        return np.eye(self.n_classes)[self.owner]


def _check_shapes(model: GestureModel) -> None:
    if not model.labels or len(set(model.labels)) != len(model.labels):
        raise ValueError(f"labels are {model.labels!r}; they must differ, one or more")
    if model.means.ndim != 3 or 0 in model.means.shape:
        raise ValueError(f"means has shape {model.means.shape}; it must be (states, mixtures, P)")
    n, m, p = model.means.shape
    k, context = len(model.labels), len(model.centre)
    if model.lags.ndim != 1 or not len(model.lags) or context % len(model.lags) or not context:
        raise ValueError(f"{context} numbers are no {len(model.lags)} frames of context")
    wanted = {
        "centre": (context,), "projection": (context, p), "owner": (n,), "start": (n,),
        "follow": (n, n), "leave": (n,), "next_class": (k, k), "prior": (k,), "weights": (n, m),
        "variances": (n, m, p), "bias": (n,),
    }  # fmt: skip
    for name, shape in wanted.items():
        if getattr(model, name).shape != shape:
            raise ValueError(f"{name} has shape {getattr(model, name).shape}; it must be {shape}")


def _check_values(model: GestureModel) -> None:
    for item in fields(model):
        array = getattr(model, item.name)
        if isinstance(array, np.ndarray):
            wrong = np.argwhere(~np.isfinite(array))
            if len(wrong):
                at = tuple(int(i) for i in wrong[0])
                raise ValueError(f"{item.name}{list(at)} is {array[at]}")
    _check_range("variances", model.variances, np.nextafter(0.0, 1.0), np.inf)
    for name in ("start", "follow", "leave", "next_class", "prior", "weights"):
        _check_range(name, getattr(model, name), 0.0, 1.0 + SUM_TOLERANCE)
    _check_lags(model.lags)
    _check_owners(model)
    for name in ("follow", "next_class", "weights"):
        _check_sums(name, getattr(model, name).sum(axis=1))
    _check_sums("start of class", model.members().T @ model.start)
    _check_sums("prior", model.prior.sum(keepdims=True))
    if not -1 <= model.garbage < model.n_classes:
        raise ValueError(f"garbage is {model.garbage}; it must be a class or -1")


def _check_lags(lags: Array) -> None:
    if lags.dtype.kind != "i" or lags[0] != 0 or np.any(np.diff(lags) <= 0):
        raise ValueError(f"lags are {lags.tolist()}; they must be whole numbers from 0 up")


def _check_owners(model: GestureModel) -> None:
    if model.owner.dtype.kind != "i" or set(model.owner) != set(range(model.n_classes)):
        raise ValueError(f"owner is {model.owner.tolist()}; every class must have a state")
    crossing = np.argwhere((model.follow > 0) & (model.owner[:, None] != model.owner[None, :]))
    if len(crossing):
        row, column = crossing[0]
        raise ValueError(f"follow[{row}, {column}] leads from one class into another")


def _check_range(name: str, array: Array, low: float, high: float) -> None:
    wrong = np.argwhere((array < low) | (array > high))
    if len(wrong):
        at = tuple(int(i) for i in wrong[0])
        raise ValueError(f"{name}{list(at)} is {array[at]}; it must lie in {low:g}..{high:g}")


def _check_sums(name: str, sums: Array) -> None:
    for row, total in enumerate(sums):
        if abs(total - 1.0) > SUM_TOLERANCE:
            raise ValueError(f"{name} row {row} sums to {total:.6f}")


def with_context(frames: Array, lags: Array) -> Array:
    """(n, L D): each of the frames (n, D) with those `lags` before it; the first stands in for what
    was before it."""
    rows = np.arange(len(frames))
    return np.concatenate([frames[np.maximum(rows - lag, 0)] for lag in lags], axis=1)


class Emission:
    """Log densities of frames with their context in all states, as one product of matrices.

    log N(z; mu, v) = a + b.z + c.z^2 with b = mu / v, c = -1 / (2 v).
    """

    def __init__(self, model: GestureModel) -> None:
        n, m, p = model.means.shape
        self._shape = (n, m)
        self._centre, self._projection = model.centre, model.projection
        self._linear = (model.means / model.variances).reshape(n * m, p).T
        self._square = (-0.5 / model.variances).reshape(n * m, p).T
        constant = -0.5 * (np.log(model.variances) + model.means**2 / model.variances + LOG_2_PI)
        with np.errstate(divide="ignore"):
            log_weights = np.maximum(np.log(model.weights), NOTHING)
        self._constant = (constant.sum(axis=2) + log_weights + model.bias[:, None]).reshape(n * m)

    def log_density(self, frames: Array) -> Array:
        """(frames, N) of frames with context (frames, L D), in nat."""
        z = np.clip((frames - self._centre) @ self._projection, -FARTHEST, FARTHEST)
        each = z @ self._linear + (z * z) @ self._square + self._constant
        each = each.reshape(-1, *self._shape)
        top = each.max(axis=2)
        return top + np.log(np.exp(each - top[:, :, None]).sum(axis=2))
