# SPDX-License-Identifier: BSD-3-Clause
"""What a study measures in its tasks (thesis 6.3.2.1), under which names and in which units."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from fabric_study.protocol import Protocol, protocol_from
from fabric_study.study_data import StudyData

WITHOUT_ROBOT = "none"  # policy of a person alone
RATE_TOLERANCE = 1e-6  # results.csv keeps six decimals
COUNTS = ("human_succeeded", "human_failed", "robot_succeeded", "robot_failed")


@dataclass(frozen=True)
class Measure:
    """A column of results.csv. `factor` turns its values into the unit shown."""

    column: str
    title: str
    unit: str = ""
    factor: float = 1.0
    digits: int = 2
    needs_robot: bool = False

    @property
    def label(self) -> str:
        """Title and unit."""
        return f"{self.title} [{self.unit}]" if self.unit else self.title


MEASURES = (
    Measure("task_success_rate", "task success rate (Eq. 6.4)", "%", 100.0, 1),
    Measure("human_success_rate", "human success rate (Eq. 6.6)", "%", 100.0, 1),
    Measure("human_contribution", "human contribution (Eq. 6.3)", "%", 100.0, 1),
    Measure("efficiency", "efficiency (Eq. 6.5)"),
    Measure("discounted_reward", "discounted reward", needs_robot=True),
    Measure("warnings", "warnings of the robot", needs_robot=True),
    Measure("robot_succeeded", "right placements by the robot", needs_robot=True),
    Measure("duration_s", "duration", "s", digits=1),
)
KNOWN_WITH_THE_TRUTH = (  # simulation only; described, not tested
    Measure("false_warnings", "warnings recognised wrongly", needs_robot=True),
    Measure("stage1_accuracy", "states of stage 1 estimated rightly", "%", 100.0, 1, True),
    Measure("stage2_accuracy", "states of stage 2 estimated rightly", "%", 100.0, 1, True),
)


def protocol_of(data: StudyData) -> Protocol | None:
    """Return the protocol that a study keeps; None for a study made of tables."""
    content = data.meta.get("content")
    return protocol_from(content, "study.json: content") if content else None


def conditions_of(data: StudyData) -> tuple[str, ...]:
    """Return the conditions in the order of the protocol, else of first appearance."""
    met = [name for name in dict.fromkeys([*data.tasks["condition"], *data.answers["condition"]])]
    protocol = protocol_of(data)
    planned = list(protocol.conditions) if protocol else []
    return tuple([*planned, *(name for name in met if name and name not in planned)])


def conditions_with(measure: Measure, tasks: pd.DataFrame, all_of: Sequence[str]) -> list[str]:
    """Return the conditions in which a measure means something and has values."""
    found = []
    for name in all_of:
        rows = tasks[tasks["condition"] == name]
        alone = "policy" in rows and bool((rows["policy"] == WITHOUT_ROBOT).all())
        if rows[measure.column].notna().any() and not (measure.needs_robot and alone):
            found.append(name)
    return found


def check_rates(tasks: pd.DataFrame) -> None:
    """Raise ValueError where Eq. 6.3 to 6.6 do not follow from the counts of a row.

    The number of subtasks is not a column: one whole number, not below the sum of the counts, has
    to explain Eq. 6.3 and 6.4. Names person, task, column, value and what it should be.
    """
    for _, row in tasks.iterrows():
        for column, expected in _rates(row).items():
            if not _same(row[column], expected):
                raise ValueError(
                    f"tasks: person {row['person']}, task {row['number']}: {column} is "
                    f"{row[column]}, but the counts give {expected}"
                )


def _rates(row: pd.Series) -> dict[str, float]:
    human, failed, robot, robot_failed = (float(row[name]) for name in COUNTS)
    counted = human + failed + robot + robot_failed
    right = human + robot
    rate = float(row["task_success_rate"])
    total = round(right / rate) if right and rate > 0.0 else counted
    total = max(total, counted)
    contribution, success = (_share(part, total) for part in (human, right))
    return {
        "human_contribution": contribution,
        "task_success_rate": success,
        "efficiency": contribution * success,
        "human_success_rate": _share(human, human + failed),
    }


def _share(part: float, whole: float) -> float:
    return part / whole if whole else np.nan


def _same(value: float, expected: float) -> bool:
    if pd.isna(value) or pd.isna(expected):
        return bool(pd.isna(value) and pd.isna(expected))
    return abs(float(value) - expected) <= RATE_TOLERANCE
