# SPDX-License-Identifier: BSD-3-Clause
"""How often the tests find a difference where there is none, from simulated studies.

python -m fabric_study.statistics.null_studies      # the table of docs/statistics.md
"""

import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from fabric_study.statistics.descriptive import snap
from fabric_study.statistics.outcome import ALPHA
from fabric_study.statistics.pairs import signed_rank, t_p, t_statistic
from fabric_study.statistics.repeated import anova_statistics, kendall_w

STUDIES = 2000
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Design:
    """A study in which the condition changes nothing on average. Spreads are in logits."""

    people_differ: float  # SD of the level of a person
    people_react_differently: float  # SD of the level of a person in a condition
    people: int = 14
    tasks: tuple[int, ...] = (3, 3)  # a person, of each condition
    cubes: int = 10  # a task; the outcome is the share placed right, or a Likert answer


DESIGNS = {
    "people are alike": Design(0.0, 0.0),
    "people differ": Design(1.0, 0.0),
    "people differ, also in how they react": Design(1.0, 1.0),
}


def simulate(design: Design, studies: int, seed: int, likert: bool = False) -> list[Floats]:
    """Return outcomes of each condition, (studies, people, tasks): shares 0..1 or answers 1..5."""
    random = np.random.default_rng(seed)
    level = 0.5 + design.people_differ * random.normal(size=(studies, design.people, 1))
    found = []
    for tasks in design.tasks:
        reaction = random.normal(size=(studies, design.people, 1))
        logit = level + design.people_react_differently * reaction
        if likert:
            noise = random.normal(size=(studies, design.people, tasks))
            found.append(np.clip(np.rint(2.5 + logit + noise), 1.0, 5.0))
        else:
            chance = np.broadcast_to(1.0 / (1.0 + np.exp(-logit)), (*logit.shape[:2], tasks))
            found.append(random.binomial(design.cubes, chance) / design.cubes)
    return found


def default_p(outcomes: list[Floats]) -> Floats:
    """Return the p-value of the default test of each study: paired t, or repeated measures."""
    means = _means(outcomes)
    if len(outcomes) == 2:
        differences = means[..., 0] - means[..., 1]
        return t_p(t_statistic(differences), differences.shape[-1] - 1)
    return anova_statistics(means).p


def default_ordinal_p(outcomes: list[Floats]) -> Floats:
    """Return the p-value of the default test of single Likert items: Wilcoxon, or Friedman."""
    means = snap(_means(outcomes))
    if len(outcomes) == 2:
        differences = snap(means[..., 0] - means[..., 1])
        return np.array([signed_rank(study)[1] for study in differences])
    n, k = means.shape[-2:]
    return stats.chi2.sf(n * (k - 1) * kendall_w(means), k - 1)


def rows_p(outcomes: list[Floats]) -> Floats:
    """Return the p-value of the one-way ANOVA of each study, rows as independent."""
    samples = [condition.reshape(len(condition), -1) for condition in outcomes]
    values = np.concatenate(samples, axis=-1)
    n, k = values.shape[-1], len(samples)
    within = sum(sample.var(axis=-1) * sample.shape[-1] for sample in samples)
    between = values.var(axis=-1) * n - within
    with np.errstate(divide="ignore", invalid="ignore"):
        return stats.f.sf(between / (k - 1) / (within / (n - k)), k - 1, n - k)


def positive_rate(p_values: Floats) -> float:
    """Return the share of studies with p < .05; a study without a p-value finds nothing."""
    return float(np.mean(np.nan_to_num(p_values, nan=1.0) < ALPHA))


def _means(outcomes: list[Floats]) -> Floats:
    """Return (studies, people, conditions)."""
    return np.stack([condition.mean(axis=-1) for condition in outcomes], axis=-1)


def main() -> int:
    """Print the rates of all designs as a Markdown table."""
    print("| conditions, tasks | people | default | default, Likert | rows as independent |")
    print("| --- | --- | --- | --- | --- |")
    for tasks in ((3, 3), (1, 3, 3)):
        for name, spreads in DESIGNS.items():
            design = Design(spreads.people_differ, spreads.people_react_differently, tasks=tasks)
            shares = simulate(design, STUDIES, seed=101)
            answers = simulate(design, STUDIES, seed=102, likert=True)
            p_values = (default_p(shares), default_ordinal_p(answers), rows_p(shares))
            rates = " | ".join(f"{100.0 * positive_rate(p):.1f} %" for p in p_values)
            print(f"| {len(tasks)}: {' + '.join(map(str, tasks))} | {name} | {rates} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
