# SPDX-License-Identifier: BSD-3-Clause
"""Runs the long-term study: adaptation to changing people, convergence to a new one."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from fabric_abps import Policy
from fabric_sim.experiments.jobs import run_jobs
from fabric_sim.experiments.long_term_shifts import (
    MEASURES,
    Course,
    Shift,
    Strategy,
    World,
    shifts_of,
)

ABPS = "abps"
ORACLE = "oracle"
BEST = "best"
#: Halving of the candidates for the best policy in hindsight: share that goes on, shifts more.
ROUNDS = ((1.0, 1), (0.4, 1), (0.15, 3))
SHIFTS_TO_JUDGE = sum(more for _, more in ROUNDS)


@dataclass
class Context:
    """What the jobs refer to by name; handed to processes by forking."""

    world: World
    policies: dict[str, Policy] = field(default_factory=dict)
    strategies: dict[str, Strategy] = field(default_factory=dict)

    def add_policies(self, policies: Iterable[Policy]) -> None:
        """Prepare policies to be run as constants. Raises ValueError naming file and trouble."""
        for policy in policies:
            self.world.prepare(policy)
            self.policies[policy.name] = policy

    def add_strategy(self, strategy: Strategy) -> None:
        """Prepare a strategy with all its policies."""
        for policy in strategy.library.policies:
            self.world.prepare(policy)
        self.strategies[strategy.name] = strategy


@dataclass(frozen=True)
class Job:
    """Shifts one after the other under a strategy, or under the constant policy of that name."""

    strategy: str
    shifts: tuple[Shift, ...]


class InUse:
    """Which context jobs refer to: they carry names, and forked processes inherit the rest."""

    def __init__(self) -> None:
        self.context: Context | None = None

    @contextmanager
    def __call__(self, context: Context) -> Iterator[None]:
        """Use a context for a while."""
        before, self.context = self.context, context
        try:
            yield
        finally:
            self.context = before


in_use = InUse()


def _work(job: Job) -> Course:
    context = in_use.context
    if job.strategy in context.strategies:
        selector = context.strategies[job.strategy].selector()
        return Course.joined([context.world.selected(s, selector) for s in job.shifts])
    policy = context.policies[job.strategy]
    return Course.joined([context.world.constant(s, policy) for s in job.shifts])


def run(context: Context, jobs: Sequence[Job], processes: int, title: str) -> list[Course]:
    """Return what came of every job, equal whatever `processes` is."""
    with in_use(context):
        return run_jobs(_work, jobs, processes, title)


# -- the best policy in hindsight ------------------------------------------------------------------


@dataclass(frozen=True)
class Hindsight:
    """The best constant policy for each person, found on shifts that are used for nothing else.

    best: (n_people,) names. tasks: how many the finalists were judged by. rewards: (n_people,
    n_policies) mean reward of a task; of policies that went out early it is of fewer tasks.
    """

    best: list[str]
    tasks: int
    rewards: np.ndarray


def best_in_hindsight(
    context: Context, names: Sequence[str], people: Sequence[Sequence[Shift]], processes: int
) -> Hindsight:
    """Judge all policies on the first shift of each person, the better ones on the further ones.

    people: for each person SHIFTS_TO_JUDGE shifts or more; a round takes in proportion.
    """
    alive = [list(range(len(names))) for _ in people]
    sums, counts = (np.zeros((len(people), len(names))) for _ in range(2))
    scale, used = len(people[0]) // SHIFTS_TO_JUDGE, 0
    for number, (share, more) in enumerate(ROUNDS, 1):
        keep = max(2, math.ceil(share * len(names)))
        means = np.divide(sums, counts, out=np.zeros_like(sums), where=counts > 0)
        alive = [sorted(own, key=lambda i, p=p: -means[p, i])[:keep] for p, own in enumerate(alive)]
        places = [(p, i) for p, own in enumerate(alive) for i in own]
        shifts = [tuple(person[used : used + scale * more]) for person in people]
        jobs = [Job(names[i], shifts[p]) for p, i in places]
        done = run(context, jobs, processes, f"best in hindsight, round {number}")
        for (p, i), course in zip(places, done, strict=True):
            sums[p, i] += course.figures[:, 0].sum()
            counts[p, i] += len(course.figures)
        used += scale * more
    means = sums / counts
    best = [names[max(own, key=lambda i, p=p: means[p, i])] for p, own in enumerate(alive)]
    return Hindsight(best, int(counts.max()), means)


# -- adaptation: Fig. 5.3, 5.4, Table 5.1 ----------------------------------------------------------


@dataclass
class Adaptation:
    """Orders of unknown people, each of whom works a shift; the robot is not told of a change.

    shifts: [order][place]. constants: names, of the library first. figures: by strategy, (n_orders,
    n_tasks, len(MEASURES)); courses: of the strategies that choose, an order each.
    """

    seeds: list[int]
    shifts: list[list[Shift]]
    library: list[str]
    also: list[str]
    hindsight: Hindsight
    figures: dict[str, np.ndarray]
    courses: dict[str, list[Course]]

    @property
    def shift_tasks(self) -> int:
        """Tasks of a shift."""
        return self.shifts[0][0].tasks

    def per_order(self, strategy: str, measure: str) -> np.ndarray:
        """(n_orders,): mean of a task; of warnings the sum over the order."""
        table = self.figures[strategy][:, :, list(MEASURES).index(measure)]
        return table.sum(axis=1) if measure == "warnings" else table.mean(axis=1)

    def best_constant(self, names: Sequence[str] | None = None) -> str:
        """The constant policy with the largest mean reward, judged by these very orders."""
        names = self.library if names is None else names
        return max(names, key=lambda name: self.per_order(name, "reward").mean())


def run_adaptation(
    context: Context,
    seeds: Sequence[int],
    people: int,
    tasks: int,
    strategies: Sequence[str],
    library: Sequence[str],
    also: Sequence[str],
    processes: int,
) -> Adaptation:
    """Run every strategy and every constant policy over the same orders."""
    shifts = [[own[0] for own in shifts_of(s, "adaptation", people, 1, tasks)] for s in seeds]
    constants = [*library, *also]
    jobs = [Job(name, (shift,)) for name in constants for order in shifts for shift in order]
    done = iter(run(context, jobs, processes, "adaptation: constant policies"))
    figures = {
        name: np.array([np.concatenate([next(done).figures for _ in order]) for order in shifts])
        for name in constants
    }
    courses = run_strategies(context, shifts, strategies, processes, "adaptation: strategies")
    for name, own in courses.items():
        figures[name] = np.array([course.figures for course in own])
    spare = [
        own for s in seeds for own in shifts_of(s, "hindsight", people, SHIFTS_TO_JUDGE, tasks)
    ]
    hindsight = best_in_hindsight(context, library, spare, processes)
    figures[ORACLE] = _oracle(figures, hindsight.best, len(seeds), people, tasks)
    return Adaptation(list(seeds), shifts, list(library), list(also), hindsight, figures, courses)


def run_strategies(
    context: Context,
    shifts: Sequence[Sequence[Shift]],
    strategies: Sequence[str],
    processes: int,
    title: str,
) -> dict[str, list[Course]]:
    """Run strategies that choose over orders; by strategy, a course an order."""
    jobs = [Job(name, tuple(order)) for name in strategies for order in shifts]
    done = iter(run(context, jobs, processes, title))
    return {name: [next(done) for _ in shifts] for name in strategies}


def _oracle(
    figures: dict[str, np.ndarray], best: Sequence[str], orders: int, people: int, tasks: int
) -> np.ndarray:
    """Put together what each person's best policy did in the person's shift."""
    found = np.empty((orders, people * tasks, len(MEASURES)))
    for number, name in enumerate(best):
        order, place = divmod(number, people)
        span = slice(place * tasks, (place + 1) * tasks)
        found[order, span] = figures[name][order, span]
    return found


# -- convergence: Fig. 5.2 -------------------------------------------------------------------------


@dataclass
class Convergence:
    """New people, each met again and again by a robot that knows nobody yet.

    shifts: [worker][repeat]. rewards: by strategy, (n_workers, n_repeats, n_tasks); BEST is the
    best constant policy for that worker. chosen: (n_workers, n_repeats, n_tasks) ABPS chose it.
    """

    shifts: list[list[Shift]]
    hindsight: Hindsight
    rewards: dict[str, np.ndarray]
    chosen: np.ndarray


def run_convergence(
    context: Context,
    seeds: Sequence[int],
    repeats: int,
    tasks: int,
    library: Sequence[str],
    processes: int,
) -> Convergence:
    """Run ABPS and the best policy in hindsight with every worker; a worker a seed."""
    spare = [shifts_of(s, "apart", 1, 2 * SHIFTS_TO_JUDGE, tasks)[0] for s in seeds]
    hindsight = best_in_hindsight(context, library, spare, processes)
    shifts = [shifts_of(s, "convergence", 1, repeats, tasks)[0] for s in seeds]
    jobs = [
        Job(name, (shift,))
        for best, own in zip(hindsight.best, shifts, strict=True)
        for shift in own
        for name in (ABPS, best)
    ]
    done = run(context, jobs, processes, "convergence")
    table = np.array([course.figures[:, 0] for course in done])
    table = table.reshape(len(shifts), repeats, 2, tasks)
    chosen = np.array([course.policies for course in done]).reshape(table.shape)
    rewards = {ABPS: table[:, :, 0], BEST: table[:, :, 1]}
    return Convergence(shifts, hindsight, rewards, chosen[:, :, 0] == chosen[:, :, 1])
