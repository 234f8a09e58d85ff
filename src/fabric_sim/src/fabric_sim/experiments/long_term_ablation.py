# SPDX-License-Identifier: BSD-3-Clause
"""What ABPS owes to its parts: forgetting, switching inside a task, known types, library size."""

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
    ("forgetting", "nothing", {"forgetting": 0.0, "change_rate": 0.0}),
    ("forgetting", ".02 a task, no change detection", {"forgetting": 0.02, "change_rate": 0.0}),
    ("forgetting", ".10 a task, no change detection", {"forgetting": 0.1, "change_rate": 0.0}),
    ("forgetting", "change detection only", {"forgetting": 0.0, "change_rate": 0.01}),
    ("switching", "between tasks only", {"switch_inside": False}),
    ("switching", "inside too, for .5 points", {"switch_inside": True, "switch_margin": 0.5}),
    ("switching", "inside too, for .1 points", {"switch_inside": True, "switch_margin": 0.1}),
)
TYPES = (4, 8, 16, 32)
SIZES = (5, 10, 20, 40)


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


def type_variants(base: Strategy, training: Training) -> list[Variant]:
    """Return ABPS with fewer and more known types; each set holds the smaller ones."""
    return [
        _retrained(base, "known types", number, training(base.library, known_types(number)))
        for number in TYPES
    ]


def size_variants(base: Strategy, training: Training, library: Library) -> list[Variant]:
    """Return ABPS with libraries of all sizes, each chosen out of the largest."""
    types = known_types(16)
    largest = training(library, types)
    dials = np.array([Character.parse(name).dials for name in types])
    always = [library.names.index(name) for name in ALWAYS]
    variants = []
    for size in (size for size in SIZES if size <= len(library.policies)):
        chosen = choose(largest.performance.mean.T, dials, size, always)
        part = Library(library.scenario, tuple(library.policies[i] for i in chosen), library.base)
        variants.append(_retrained(base, "library size", size, training(part, types), part))
    return variants


def _retrained(
    base: Strategy, group: str, number: int, models: TrainedModels, library: Library | None = None
) -> Variant:
    strategy = replace(
        base, name=f"{group}: {number}", models=models, library=library or base.library
    )
    return Variant(group, str(number), strategy)


def large_library(scenario: str, seed: int, folder: Path, processes: int) -> Library:
    """Build a library of the largest of SIZES, as the shipped one was built."""

    def spread(work: Callable[[Any], Any], names: Iterable[Any]) -> list[Any]:
        return run_jobs(work, list(names), processes, "ablations: a library of 40")

    plan = batch_library.Plan(scenario, seed, size=max(SIZES))
    built = batch_library.build(plan, folder, spread)
    renamed = tuple(replace(p, name=_unlike_shipped(p.name)) for p in built.policies)
    return replace(built, policies=renamed)


def _unlike_shipped(name: str) -> str:
    return name if name in ALWAYS else f"{name} of 40"


def run_variants(
    context: Context, study: Adaptation, variants: Sequence[Variant], processes: int
) -> list[AblationResult]:
    """Run variants over the orders of the study."""
    for variant in variants:
        context.add_strategy(variant.strategy)
    names = [variant.strategy.name for variant in variants]
    done = run_strategies(context, study.shifts, names, processes, "ablations")
    return [
        AblationResult(
            variant.group,
            variant.label,
            np.array([course.figures for course in done[variant.strategy.name]]),
        )
        for variant in variants
    ]


def ablation_lines(study: Adaptation, results: Sequence[AblationResult]) -> list[AblationLine]:
    """Return ABPS as shipped, then every variant compared with it, paired by order."""
    own = study.per_order(ABPS, "reward")
    warnings = mean_of(study.per_order(ABPS, "warnings"))
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
    context: Context, study: Adaptation, base: Strategy, folder: Path, processes: int
) -> list[AblationResult]:
    """Run all ablations. folder: where the library made for them is kept."""
    tasks = int(base.models.performance.count.max())
    training = Training(context, tasks, base.models.seed, processes)
    variants = parameter_variants(base) + type_variants(base, training)
    scenario = base.library.scenario
    library = large_library(scenario, base.models.seed, folder / "library_of_40", processes)
    variants += size_variants(base, Training(context, tasks, base.models.seed, processes), library)
    return run_variants(context, study, variants, processes)
