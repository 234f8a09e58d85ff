# SPDX-License-Identifier: BSD-3-Clause
"""What ABPS owes to its parts: forgetting, switching inside a task, known types, library size."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fabric_abps import Library, Policy, TrainedModels, train
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
    ("switching", "inside a task too", {"switch_inside": True}),
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
    """Return ABPS with other parameters."""
    return [
        Variant(
            group,
            label,
            replace(base, name=f"{group}: {label}", parameters=replace(base.parameters, **changed)),
        )
        for group, label, changed in PARAMETERS
    ]


def subset(policies: Sequence[Policy], base: Library, size: int) -> Library:
    """Return a library of the first `size` policies, the base among them."""
    first = [policy for policy in policies if policy.name == base.base]
    others = [policy for policy in policies if policy.name != base.base]
    return Library(base.scenario, tuple((first + others)[:size]), base.base)


def trained(
    context: Context,
    library: Library,
    types: Sequence[str],
    tasks: int,
    seed: int,
    processes: int,
) -> TrainedModels:
    """Return models of a library and known types, trained here, equal whatever `processes` is."""

    def spread(work: Callable[[Any], Any], jobs: Iterable[Any]) -> list[Any]:
        title = f"training {len(library.policies)} policies with {len(types)} types"
        return run_jobs(work, list(jobs), processes, title)

    context.add_policies(policy for policy in library.policies)
    with in_use(context):
        return train(library, types, _train, tasks, seed, spread)


def _train(job: Any) -> list[tuple[float, list[int]]]:
    context = in_use.context
    policy = context.policies[job.policy]
    return context.world.training(policy, job.type, job.seed, job.tasks)


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
    """Run all ablations. folder: where what is made for them is kept."""
    return run_variants(context, study, parameter_variants(base), processes)
