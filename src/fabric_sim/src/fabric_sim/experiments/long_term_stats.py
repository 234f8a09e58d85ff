# SPDX-License-Identifier: BSD-3-Clause
"""Numbers of the long-term study: regret (Eq. 5.5), the closed share of the gap, the goals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fabric_sim.experiments.long_term_run import ABPS, BEST, ORACLE, Adaptation, Convergence
from fabric_sim.experiments.paired import (
    Comparison,
    Interval,
    compare,
    holm,
    mean_of,
    share_of_way,
)

WINDOW = 3  # tasks, of the moving regret
NEAR = 0.05  # of the best policy's reward: what counts as converged
BY_TASK = 6  # published
AIM = 3
DRAWS = 4000
SIGNIFICANT = 0.001
HALF = 0.5


def regret(best: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Eq. 5.5 task by task: U of the best policy minus U of one's own, any equal shapes."""
    best, own = np.asarray(best, dtype=float), np.asarray(own, dtype=float)
    if best.shape != own.shape or not (np.isfinite(best).all() and np.isfinite(own).all()):
        raise ValueError(f"regret needs finite tables of one shape, got {best.shape}, {own.shape}")
    return best - own


def moving_mean(table: np.ndarray, window: int = WINDOW) -> np.ndarray:
    """Mean of the last `window` values up to each along the last axis; of fewer at the start."""
    if window < 1:
        raise ValueError(f"window is {window}; it must be 1 or more")
    table = np.asarray(table, dtype=float)
    total = np.cumsum(table, axis=-1)
    total[..., window:] -= total[..., :-window].copy()
    return total / np.minimum(np.arange(1, table.shape[-1] + 1), window)


class Approach(NamedTuple):
    """How near a strategy comes to the best policy for each worker, by task.

    share: (n_tasks,) moving regret as a share of the best policy's reward; low, high: its 95 %
    bootstrap interval over workers. settled: the first task from which the share stays within
    NEAR, None when it does not; rest: mean share from task BY_TASK on
    (from the last one, when there are fewer).
    """

    share: np.ndarray
    low: np.ndarray
    high: np.ndarray
    settled: int | None
    rest: Interval


def approach(study: Convergence, strategy: str = ABPS) -> Approach:
    """Return how ABPS approaches the best policy in hindsight (Fig. 5.2)."""
    best = study.rewards[BEST].mean(axis=1)  # (n_workers, n_tasks)
    missed = regret(best, study.rewards[strategy].mean(axis=1))
    level = best.mean()
    if not level > 0.0:
        raise ValueError(f"the best policies earn {level:.2f} a task; shares of it mean nothing")
    smooth = moving_mean(missed)
    tail = missed[:, min(BY_TASK, missed.shape[1]) - 1 :].mean(axis=1)
    picks = np.random.default_rng(1).integers(len(best), size=(DRAWS, len(best)))
    levels = best.mean(axis=1)[picks].mean(axis=1)
    low, high = np.percentile(smooth[picks].mean(axis=1) / levels[:, None], [2.5, 97.5], axis=0)
    ends = np.percentile(tail[picks].mean(axis=1) / levels, [2.5, 97.5])
    share = smooth.mean(axis=0) / level
    return Approach(share, low, high, settled(share), Interval(tail.mean() / level, *ends))


def settled(share: np.ndarray) -> int | None:
    """Number, from 1, of the first task from which on the share stays at NEAR or below."""
    beyond = np.flatnonzero(np.asarray(share) > NEAR)
    first = int(beyond[-1]) + 2 if beyond.size else 1
    return first if first <= len(share) else None


def compare_orders(study: Adaptation, one: str, other: str, measure: str) -> Comparison:
    """Compare two strategies in a measure, paired by order."""
    return compare(study.per_order(one, measure), study.per_order(other, measure))


def against(study: Adaptation, other: str, measures: Sequence[str]) -> dict[str, Comparison]:
    """ABPS minus another strategy, by measure; Holm over the measures."""
    return holm({m: compare_orders(study, ABPS, other, m) for m in measures})


def ranking(study: Adaptation) -> list[str]:
    """All strategies, ABPS first, then by mean reward."""
    others = [name for name in study.figures if name != ABPS]
    return [ABPS, *sorted(others, key=lambda name: -study.per_order(name, "reward").mean())]


def reward_tests(study: Adaptation) -> dict[str, Comparison]:
    """ABPS minus every other strategy in reward; Holm over all of them."""
    names = [name for name in study.figures if name != ABPS]
    return holm({name: compare_orders(study, ABPS, name, "reward") for name in names})


def constant_apart(study: Adaptation) -> str:
    """The constant policy that earned most in the tasks that the oracle's policies were chosen by.

    It is chosen as the oracle is, while the best constant also profits from luck in these orders.
    """
    return study.library[int(study.hindsight.rewards.mean(axis=0).argmax())]


def gap(study: Adaptation, constant: str | None = None) -> Interval:
    """Oracle minus a constant, by default the best one, points a task; interval over orders."""
    base = study.per_order(constant or study.best_constant(), "reward")
    return mean_of(study.per_order(ORACLE, "reward") - base)


def closed_share(study: Adaptation, strategy: str = ABPS, constant: str | None = None) -> Interval:
    """How much of the way from a constant (0), by default the best, to the oracle (1) is gone.

    With a bootstrap interval over orders; NaN where there is no gap to be closed.
    """
    names = (strategy, constant or study.best_constant(), ORACLE)
    return share_of_way(*(study.per_order(name, "reward") for name in names), seed=1)


class Goal(NamedTuple):
    """A goal of the study; met is None when it cannot be judged."""

    text: str
    ours: str
    met: bool | None


def percent(value: float) -> str:
    """Return a share in per cent."""
    return f"{100.0 * value:.1f} %"


def convergence_goals(study: Convergence) -> list[Goal]:
    """Whether ABPS comes within NEAR of the best policy soon enough."""
    found = approach(study)
    goals = []
    for task, word in ((BY_TASK, "goal"), (AIM, "aim")):
        if task > len(found.share):
            continue
        i = task - 1
        spread = f"[{percent(found.low[i])}, {percent(found.high[i])}]"
        ours = f"{percent(found.share[i])} {spread}"
        text = f"regret within {percent(NEAR)} of the best policy by task {task} ({word})"
        goals.append(Goal(text, ours, bool(found.share[i] <= NEAR)))
    return goals


def adaptation_goals(study: Adaptation) -> list[Goal]:
    """Whether ABPS beats the best constant, and how much of the gap it closes."""
    best = study.best_constant()
    found = against(study, best, ("reward", "warnings", "success"))
    reward, warnings, success = (found[m] for m in ("reward", "warnings", "success"))
    share, way = closed_share(study), gap(study)
    closed = None if math.isnan(share.value) else bool(share.value >= HALF)
    ours = (
        f"there is no clear gap: {_signed(way)}"
        if closed is None
        else f"{share.value:.2f} [{share.low:.2f}, {share.high:.2f}] of {_signed(way)}"
    )
    above = reward.difference.value > 0.0 and reward.p_holm < SIGNIFICANT
    return [
        Goal(f"reward above the best constant ({best}), p < .001", _tested(reward), above),
        Goal(
            "fewer warnings than the best constant",
            _tested(warnings),
            bool(warnings.difference.high < 0.0),
        ),
        Goal(
            "success not lower than of the best constant",
            _tested(success, 3),
            bool(success.difference.high >= 0.0),
        ),
        Goal("half of the gap from the best constant to the oracle closed", ours, closed),
    ]


def _tested(found: Comparison, digits: int = 2) -> str:
    return f"{_signed(found.difference, digits)}, p = {found.p_holm:.2g}"


def _signed(interval: Interval, digits: int = 2) -> str:
    half = (interval.high - interval.low) / 2.0
    return f"{interval.value:+.{digits}f} ± {half:.{digits}f}"
