# SPDX-License-Identifier: BSD-3-Clause
"""What ABPS owes to its parts: forgetting, switching inside a task, known types, library size.

Each variant differs from ABPS as shipped in one thing, which its label tells. Fewer known types and
smaller libraries are parts of the shipped models. Libraries of all sizes out of one of 40 are a
group of their own: that library is built and trained for the purpose with less work than the
shipped one, so they are to be compared with each other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fabric_abps import Job, Library, TrainedModels, train
from fabric_abps.diversity import choose
from fabric_sim import batch_library
from fabric_sim.batch_library import ALWAYS
from fabric_sim.batch_train_people import known_types
from fabric_sim.character import Character
from fabric_sim.experiments.jobs import run_jobs
from fabric_sim.experiments.long_term_run import (
    ABPS,
    Adaptation,
    Context,
    in_use,
    run_strategies,
)
from fabric_sim.experiments.long_term_shifts import MEASURES, Strategy
from fabric_sim.experiments.paired import Comparison, Interval, compare, mean_of

#: Changes to the parameters of the selector: part, variant, values.
PARAMETERS: tuple[tuple[str, str, dict[str, Any]], ...] = (
    ("forgetting", "none", {"forgetting": 0.0}),
    ("forgetting", ".10 a task", {"forgetting": 0.1}),
    ("change detection", "none", {"change_rate": 0.0}),
    ("change detection", ".01 false alarms a task", {"change_rate": 0.01}),
    ("both", "neither forgetting nor detection", {"forgetting": 0.0, "change_rate": 0.0}),
    ("switching", "between tasks only", {"switch_inside": False}),
    ("switching", "inside too", {"switch_inside": True}),
)
TYPES = (4, 8, 16)
SIZES = (5, 10)
OF_40 = (5, 10, 20, 40)
TASKS_OF_40 = 30  # of each policy of the library of 40 with each of the 16 corners
#: How the library of 40 is built: one generation, each candidate looked at less.
PLAN_OF_40 = {"candidates": 60, "generations": 1, "first": 1, "second": 3}


@dataclass(frozen=True)
class Variant:
    """ABPS with something altered."""

    group: str
    label: str
    strategy: Strategy


@dataclass(frozen=True)
class AblationResult:
    """What a variant did: figures (n_orders, n_tasks, len(MEASURES))."""

    group: str
    label: str
    figures: np.ndarray


@dataclass(frozen=True)
class AblationLine:
    """A line of the table; against: variant minus ABPS as shipped, None for itself."""

    group: str
    label: str
    reward: Interval
    warnings: Interval
    against: Comparison | None


def parameter_variants(base: Strategy) -> list[Variant]:
    """Return ABPS with other parameters; what says the same as the shipped ones is left out."""
    variants = []
    for group, label, changed in PARAMETERS:
        parameters = replace(base.parameters, **changed)
        if parameters != base.parameters:
            strategy = replace(base, name=f"{group}: {label}", parameters=parameters)
            variants.append(Variant(group, label, strategy))
    return variants


class Training:
    """Trains on libraries and known types; a session that two trainings share is run once."""

    def __init__(self, context: Context, tasks: int, seed: int, processes: int) -> None:
        """tasks: of each policy with each type."""
        self._context, self._tasks, self._seed = context, tasks, seed
        self._processes = processes
        self._done: dict[Job, list[tuple[float, list[int]]]] = {}

    def __call__(self, library: Library, types: Sequence[str]) -> TrainedModels:
        """Return the models, equal whatever the processes and what was trained before."""
        self._context.add_policies(library.policies)
        with in_use(self._context):
            return train(library, types, _train, self._tasks, self._seed, self._spread)

    def _spread(self, work: Callable[[Job], Any], jobs: Sequence[Job]) -> list[Any]:
        new = [job for job in jobs if job not in self._done]
        found = run_jobs(work, new, self._processes, "ablations: training") if new else []
        self._done.update(zip(new, found, strict=True))
        return [self._done[job] for job in jobs]


def _train(job: Job) -> list[tuple[float, list[int]]]:
    context = in_use.context
    policy = context.policies[job.policy]
    return context.world.training(policy, job.type, job.seed, job.tasks)


def type_variants(base: Strategy) -> list[Variant]:
    """Return ABPS with fewer known types; each set holds the smaller ones."""
    variants = []
    for number in TYPES:
        types = known_types(number)
        if set(types) < set(base.models.types):
            models = base.models.part(base.library, types)
            variants.append(_altered(base, "known types", number, models, base.library))
    return variants


def size_variants(
    base: Strategy, group: str, models: TrainedModels, library: Library, sizes: Sequence[int]
) -> list[Variant]:
    """Return ABPS with libraries of several sizes, each chosen out of `library`, and with the part
    of `models` that belongs to it. A smaller one begins with a new person as the large one, or,
    when that policy is not in it, with what earns most in the training.
    """
    dials = np.array([Character.parse(name).dials for name in models.types])
    earned = models.performance.mean.T
    always = [i for i, name in enumerate(library.names) if name in ALWAYS]
    variants = []
    for size in (size for size in sizes if size <= len(library.policies)):
        chosen = choose(earned, dials, size, always)
        policies = tuple(library.policies[i] for i in chosen)
        best = library.names[max(chosen, key=lambda i: earned[i].mean())]
        first = library.base if library.base in {policy.name for policy in policies} else best
        part = Library(library.scenario, policies, first)
        variants.append(_altered(base, group, size, models.part(part, models.types), part))
    return variants


def _altered(
    base: Strategy, group: str, number: int, models: TrainedModels, library: Library
) -> Variant:
    strategy = replace(base, name=f"{group}: {number}", models=models, library=library)
    return Variant(group, str(number), strategy)


def large_library(scenario: str, seed: int, folder: Path, processes: int) -> Library:
    """Build a library of the largest of OF_40."""

    def spread(work: Callable[[Any], Any], names: Iterable[Any]) -> list[Any]:
        return run_jobs(work, list(names), processes, "ablations: a library of 40")

    plan = batch_library.Plan(scenario, seed, size=max(OF_40), **PLAN_OF_40)
    built = batch_library.build(plan, folder, spread)
    renamed = tuple(replace(p, name=_unlike_shipped(p.name)) for p in built.policies)
    return replace(built, policies=renamed, base=_unlike_shipped(built.base))


def _unlike_shipped(name: str) -> str:
    return name if name in ALWAYS else f"{name} of 40"


def run_variants(
    context: Context, study: Adaptation, variants: Sequence[Variant], orders: int, processes: int
) -> list[AblationResult]:
    """Run variants over the first orders of the study."""
    for variant in variants:
        context.add_strategy(variant.strategy)
    names = [variant.strategy.name for variant in variants]
    done = run_strategies(context, study.shifts[:orders], names, processes, "ablations")
    return [
        AblationResult(
            variant.group,
            variant.label,
            np.array([course.figures for course in done[variant.strategy.name]]),
        )
        for variant in variants
    ]


def ablation_lines(study: Adaptation, results: Sequence[AblationResult]) -> list[AblationLine]:
    """Return ABPS as shipped, then every variant compared with it, paired by order.

    All over the orders that the variants ran over.
    """
    orders = min((len(result.figures) for result in results), default=len(study.seeds))
    own = study.per_order(ABPS, "reward")[:orders]
    warnings = mean_of(study.per_order(ABPS, "warnings")[:orders])
    lines = [AblationLine("as shipped", "", mean_of(own), warnings, None)]
    place = list(MEASURES).index("warnings")
    for result in results:
        reward = result.figures[:, :, 0].mean(axis=1)
        warned = mean_of(result.figures[:, :, place].sum(axis=1))
        lines.append(
            AblationLine(result.group, result.label, mean_of(reward), warned, compare(reward, own))
        )
    return lines


def run_ablations(
    context: Context,
    study: Adaptation,
    base: Strategy,
    folder: Path,
    orders: int,
    processes: int,
) -> list[AblationResult]:
    """Run all ablations over the first orders. folder: where the library of 40 is kept."""
    scenario, seed = base.library.scenario, base.models.seed
    variants = parameter_variants(base) + type_variants(base)
    smaller = [size for size in SIZES if size < len(base.library.policies)]
    variants += size_variants(base, "library size", base.models, base.library, smaller)
    library = large_library(scenario, seed, folder / "library_of_40", processes)
    models = Training(context, TASKS_OF_40, seed, processes)(library, known_types(16))
    variants += size_variants(base, "size, out of 40", models, library, OF_40)
    return run_variants(context, study, variants, orders, processes)
