# SPDX-License-Identifier: BSD-3-Clause
"""Which candidates make a library: each is among the best for somebody, and they differ.

All work on the performance of candidates, the mean utility (n_candidates, n_people) that each
earned from each of the same people.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.hierarchy import fcluster, linkage

RIDGE = 0.3  # weight of the ridge penalty in `smoothed`
CHOICE = 1.25  # so many candidates for each place in a library are clustered


def smoothed(utility: NDArray, dials: NDArray) -> NDArray:
    """Utility (n_candidates, n_people) as a quadratic function of the people's dials.

    Ridge regression of each candidate's row on dials (n_people, n_dials), their squares and
    products. A mean over a few tasks is noisy, and the best of many noisy means flatters; similar
    people say more about a person than the person's own few tasks.
    """
    n_people, n_dials = dials.shape
    pairs = [dials[:, a] * dials[:, b] for a in range(n_dials) for b in range(a + 1)]
    features = np.column_stack([np.ones(n_people), dials, *pairs])
    penalty = RIDGE * np.eye(features.shape[1])
    penalty[0, 0] = 0.0
    weights = np.linalg.solve(features.T @ features + penalty, features.T @ utility.T)
    return (features @ weights).T


def shortlist(utility: NDArray, dials: NDArray, count: int, always: Sequence[int]) -> list[int]:
    """Indices of `count` candidates worth another look, in order: `always`, and the least weak.

    A candidate is weak that is for nobody near the best: by the least that it earns less than the
    best for somebody. Raises ValueError as `choose` does.
    """
    _check(utility, count, always)
    return sorted(_strongest(smoothed(utility, dials), count, always))


def _strongest(expected: NDArray, count: int, always: Sequence[int]) -> list[int]:
    weakness = (expected.max(axis=0) - expected).min(axis=1)
    weakness[list(always)] = -1.0
    order = sorted(range(len(expected)), key=lambda i: (weakness[i], -expected[i].mean(), i))
    return order[:count]


def clusters(utility: NDArray, count: int) -> NDArray:
    """Number of the cluster of each candidate, (n_candidates,): at most `count` of them.

    Average linkage of what candidates earn from whom, Euclidean.
    """
    if len(utility) <= count:
        return np.arange(len(utility))
    return fcluster(linkage(utility, method="average"), count, criterion="maxclust") - 1


def choose(utility: NDArray, dials: NDArray, size: int, always: Sequence[int]) -> list[int]:
    """Indices of the library's candidates: `always` first, the others by mean utility.

    utility: (n_candidates, n_people) points; dials: (n_people, n_dials) in [0, 1]. The weakest (see
    `shortlist`) are dropped, the rest clustered by for whom they are better than on average, and of
    each cluster the one is kept that adds most to what the best of the library for each person
    earns. Raises ValueError when a figure is not finite or there are fewer candidates than the
    library takes.
    """
    _check(utility, size, always)
    expected = smoothed(utility, dials)
    pool = _strongest(expected, math.ceil(CHOICE * size), always)
    left = sorted(set(pool) - set(always))
    shape = expected[left] - expected[left].mean(axis=1, keepdims=True)
    label = clusters(shape, size - len(always)) if size > len(always) else []
    chosen = list(always)
    for number in sorted(set(label), key=lambda n: -expected[left][label == n].max()):
        members = [left[i] for i in np.flatnonzero(label == number)]
        chosen.append(_most_added(expected, chosen, members))
    while len(chosen) < size:
        chosen.append(_most_added(expected, chosen, sorted(set(left) - set(chosen))))
    rest = sorted(chosen[len(always) :], key=lambda i: (-utility[i].mean(), i))
    return [*always, *rest]


def _check(utility: NDArray, count: int, always: Sequence[int]) -> None:
    if not np.isfinite(utility).all():
        candidate, person = np.argwhere(~np.isfinite(utility))[0]
        raise ValueError(f"utility of candidate {candidate} with person {person} is not finite")
    if not len(always) <= count <= len(utility):
        raise ValueError(f"{count} to keep of {len(utility)} candidates, {len(always)} of them set")


def _most_added(expected: NDArray, chosen: Sequence[int], members: Sequence[int]) -> int:
    """The member that adds most to the best of the chosen, averaged over people."""
    best = expected[list(chosen)].max(axis=0) if chosen else np.full(expected.shape[1], -np.inf)
    added = [np.maximum(expected[i], best).mean() for i in members]
    most = max(added)
    equal = [i for i, gain in zip(members, added, strict=True) if gain >= most - 1e-12]
    return max(equal, key=lambda i: (expected[i].mean(), -i))
