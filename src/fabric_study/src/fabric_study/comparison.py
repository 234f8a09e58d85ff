# SPDX-License-Identifier: BSD-3-Clause
"""Paired comparison of policies that worked with the same people: equal seed, equal task."""

import math
from collections.abc import Mapping, Sequence

from fabric_study.meter import Value
from fabric_study.results import mean_interval

MEASURES = (
    ("discounted_reward", "reward"),
    ("warnings", "warnings"),
    ("success", "success"),
    ("duration_s", "duration s"),
)


def paired_differences(
    rows: Sequence[Mapping[str, Value]],
    seeds: Sequence[int],
    first: str,
    second: str,
    measure: str,
) -> list[float]:
    """Return `measure` of `first` minus that of `second`, (n,), one a pair of equal tasks.

    rows: of results.csv, seeds: root seed of each row, (n_rows,). Pairs with an undefined value
    are left out.
    """
    values: dict[str, dict[tuple[int, Value], float]] = {first: {}, second: {}}
    for row, seed in zip(rows, seeds, strict=True):
        value = row[measure]
        if row["policy"] in values and value is not None:
            values[str(row["policy"])][(seed, row["task"])] = float(value)
    common = [key for key in values[first] if key in values[second]]
    return [values[first][key] - values[second][key] for key in common]


def effect_size(differences: Sequence[float]) -> float | None:
    """Return Cohen's dz: mean over standard deviation of paired differences; None if undefined."""
    n = len(differences)
    if n < 2:
        return None
    mean = math.fsum(differences) / n
    variance = math.fsum((value - mean) ** 2 for value in differences) / (n - 1)
    return None if variance == 0.0 else mean / math.sqrt(variance)


def comparison_lines(rows: Sequence[Mapping[str, Value]], seeds: Sequence[int]) -> list[str]:
    """Return a line a measure: the first policy against each other one."""
    policies = list(dict.fromkeys(str(row["policy"]) for row in rows))
    lines = []
    for other in policies[1:]:
        lines.append(f"{policies[0]} minus {other}, pairs of equal seed and task:")
        for measure, title in MEASURES:
            differences = paired_differences(rows, seeds, policies[0], other, measure)
            mean, half = mean_interval(differences)
            if mean is None:
                continue
            spread = "" if half is None else f" ± {half:.3f}"
            size = effect_size(differences)
            effect = "" if size is None else f", dz {size:+.2f}"
            lines.append(f"  {title:<10} {mean:+.3f}{spread}{effect} (n {len(differences)})")
    return lines
