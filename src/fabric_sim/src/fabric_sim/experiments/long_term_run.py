# SPDX-License-Identifier: BSD-3-Clause
"""Runs the long-term study: adaptation to changing people, convergence to a new one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from fabric_abps import Policy
from fabric_sim.experiments.jobs import run_jobs
from fabric_sim.experiments.long_term_hindsight import (
    SHIFTS_TO_JUDGE,
    Hindsight,
    Judge,
    best_in_hindsight,
)
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
BASE = "base"


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


def _mean_reward(job: Job) -> float:
    world, policy = in_use.context.world, in_use.context.policies[job.strategy]
    return float(np.concatenate([world.rewards(s, policy) for s in job.shifts]).mean())


def run(context: Context, jobs: Sequence[Job], processes: int, title: str) -> list[Course]:
    """Return what came of every job, equal whatever `processes` is."""
    with in_use(context):
        return run_jobs(_work, jobs, processes, title)


# -- the best policy in hindsight -----------------------------------------------------------------


def judge_in(
    context: Context, names: Sequence[str], spare: Sequence[Sequence[Shift]], processes: int
) -> Judge:
    """Return what judges policies by spare[person][shift], which nothing else is run on."""

    def judge(places: list[tuple[int, int]], first: int, last: int) -> np.ndarray:
        jobs = [Job(names[i], (shift,)) for p, i in places for shift in spare[p][first:last]]
        title = f"best in hindsight, shifts {first + 1} to {last}"
        with in_use(context):
            rewards = run_jobs(_mean_reward, jobs, processes, title)
        return np.array(rewards).reshape(len(places), last - first)

    return judge


# -- adaptation: Fig. 5.3, 5.4, Table 5.1 ----------------------------------------------------------


@dataclass
class Adaptation:
    """Orders of unknown people, each of whom works a shift; the robot is not told of a change.

    shifts: [order][place]. library, also: names of the constant policies. figures: by strategy,
    (n_orders, n_tasks, len(MEASURES)); courses: of the strategies that choose, an order each.
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
    hindsight: Hindsight,
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
    best constant policy for that worker, BASE the one that ABPS begins with. chosen: (n_workers,
    n_repeats, n_tasks) whether ABPS chose the best one.
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
    hindsight: Hindsight,
    processes: int,
) -> Convergence:
    """Run ABPS, the best policy in hindsight and the base with every worker; a worker a seed."""
    shifts = [shifts_of(s, "convergence", 1, repeats, tasks)[0] for s in seeds]
    base = context.strategies[ABPS].library.base
    jobs = [
        Job(name, (shift,))
        for best, own in zip(hindsight.best, shifts, strict=True)
        for shift in own
        for name in (ABPS, best, base)
    ]
    done = run(context, jobs, processes, "convergence")
    table = np.array([course.figures[:, 0] for course in done])
    table = table.reshape(len(shifts), repeats, 3, tasks)
    policies = np.array([course.policies for course in done]).reshape(table.shape)
    rewards = {name: table[:, :, place] for place, name in enumerate((ABPS, BEST, BASE))}
    return Convergence(shifts, hindsight, rewards, policies[:, :, 0] == policies[:, :, 1])


def judge_everybody(
    context: Context,
    orders: Sequence[int],
    people: int,
    workers: Sequence[int],
    tasks: int,
    library: Sequence[str],
    processes: int,
) -> tuple[Hindsight, Hindsight]:
    """Return the best policies for the people of the orders, and for those of the convergence."""
    spare = [o for s in orders for o in shifts_of(s, "hindsight", people, SHIFTS_TO_JUDGE, tasks)]
    count = len(spare)
    spare += [shifts_of(s, "apart", 1, SHIFTS_TO_JUDGE, tasks)[0] for s in workers]
    persons = [own[0].person for own in spare]
    found = best_in_hindsight(library, persons, judge_in(context, library, spare, processes))
    return found.part(0, count), found.part(count, len(spare))
