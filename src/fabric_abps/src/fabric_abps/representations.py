# SPDX-License-Identifier: BSD-3-Clause
"""Ways to describe what a task looks like, compared by the likelihood of tasks held out.

Each makes of the codes of a task a table of counts (n_rows, n_columns); a row is what is counted
after one kind of past. Rows are independent Dirichlet-multinomials, whose parameters are the counts
of the training plus `concentration` times what everybody does (or the same pair, in any order).
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln, logsumexp

from fabric_abps.observation_model import everybody
from fabric_abps.signals import BITS, N_CODES

START = END = N_CODES
Counting = Callable[[NDArray], NDArray]


class Representation(NamedTuple):
    """What is counted, and what unseen things are likened to."""

    name: str
    count: Counting  # codes (n_codes,) -> counts (n_rows, n_columns)
    own: bool = False  # liken to the same pair in any order, not to everybody in this order


def unordered(codes: NDArray) -> NDArray:
    """How often each code occurs, (1, 64)."""
    return np.bincount(codes, minlength=N_CODES)[None, :]


def unordered_length(codes: NDArray) -> NDArray:
    """As unordered, and that the task ends, (1, 65)."""
    return np.append(np.bincount(codes, minlength=N_CODES), 1)[None, :]


def ordered(codes: NDArray) -> NDArray:
    """How often each code follows each code or the start, (65, 64)."""
    return ordered_length(codes)[:, :N_CODES]


def ordered_length(codes: NDArray) -> NDArray:
    """As ordered, and after which code the task ends, (65, 65)."""
    counts = np.zeros((N_CODES + 1, N_CODES + 1), dtype=np.int64)
    np.add.at(counts, (np.append(START, codes), np.append(codes, END)), 1)
    return counts


def bits(codes: NDArray) -> NDArray:
    """How often each of the six booleans is true and false, each on its own, (6, 2)."""
    true = (np.asarray(codes)[:, None] >> np.arange(len(BITS)) & 1).sum(axis=0)
    return np.stack([true, len(codes) - true], axis=1)


REPRESENTATIONS = (
    Representation("six booleans, each on its own", bits),
    Representation("codes in any order", unordered),
    Representation("codes in order, else own in any", ordered, own=True),
    Representation("codes in order, else everybody's", ordered),
    Representation("codes in any order, and the end", unordered_length),
    Representation("codes in order, and the end", ordered_length),
)


def posterior(counts: NDArray, concentration: float, own: bool) -> NDArray:
    """Dirichlet parameters (n_types, n_policies, n_rows, n_columns) from the training's counts."""
    if own:
        unordered_counts = counts.sum(axis=(0, 1, 2)) + 1.0
        R = unordered_counts / unordered_counts.sum()
        pair = counts.sum(axis=2) + concentration * R
        Q = (pair / pair.sum(axis=-1, keepdims=True))[:, :, None, :]
    else:
        Q = everybody(counts.sum(axis=(0, 1)), concentration)
    return counts + concentration * Q


def log_probability(alpha: NDArray, counts: NDArray) -> NDArray:
    """ln probability of ordered draws with these counts, rows and columns on the last two axes."""
    each = (gammaln(alpha + counts) - gammaln(alpha)).sum(axis=(-1, -2))
    total, n = alpha.sum(axis=-1), counts.sum(axis=-1)
    return each - (gammaln(total + n) - gammaln(total)).sum(axis=-1)


class HeldOut(NamedTuple):
    """How well tasks of people that the training has not seen are described."""

    likelihood: float  # nats a task under the own pair, mean
    log_posterior: NDArray  # (n_tasks,) of the true type after 1, 2, ... tasks, nats, mean


def held_out(
    codes: Sequence[Sequence[Sequence[Sequence[NDArray]]]],
    representation: Representation,
    concentration: float = 16.0,
    effective: float = np.inf,
) -> HeldOut:
    """Leave each person out in turn: codes[type][policy][person][task] is (n_codes,).

    Every pair needs as many people, two at least, with as many tasks each. effective: as in
    `task_weight`, for the posterior.
    """
    counts = _tables(codes, representation.count)  # types, policies, people, tasks, rows, columns
    n_codes = np.array(
        [[[[len(t) for t in p] for p in pair] for pair in row] for row in codes], dtype=float
    )
    weight = np.minimum(1.0, effective / np.maximum(n_codes, 1.0))
    everything = counts.sum(axis=(2, 3), dtype=np.int64)
    own, of_true = [], []
    for person in range(counts.shape[2]):
        tasks = counts[:, :, person]
        alpha = posterior(everything - tasks.sum(axis=2), concentration, representation.own)
        found = np.array(
            [log_probability(alpha[tau][None, :, None], tasks) for tau in range(len(codes))]
        )  # model's type, true type, policy, task
        truth = np.arange(len(codes))
        own.append(found[truth, truth])
        believed = np.cumsum(found * weight[:, :, person], axis=-1)
        of_true.append((believed - logsumexp(believed, axis=0))[truth, truth])
    return HeldOut(float(np.mean(own)), np.mean(of_true, axis=(0, 1, 2)))


def _tables(codes: Sequence, count: Counting) -> NDArray:
    """Counts of all tasks, without rows and columns in which nobody ever has any but one."""

    def small(task: NDArray) -> NDArray:
        return count(np.asarray(task)).astype(np.uint16)

    counts = np.array([[[[small(t) for t in p] for p in pair] for pair in row] for row in codes])
    seen = counts.sum(axis=(0, 1, 2, 3), dtype=np.int64)
    rows, columns = seen.sum(axis=1) > 0, seen.sum(axis=0) > 0
    return counts[..., rows, :][..., columns]
