# SPDX-License-Identifier: BSD-3-Clause
"""What a task was to the person who did it: measures on 0..1, on which answers depend."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from fabric_sim.character import Character
from fabric_sim.rehearsal.shift import PlayedTask

FEW_WARNINGS = 3.0  # warnings after which 63 % of "a lot" is reached
CHUNKS = 4.0  # items that people hold in mind without effort (Cowan 2001)
LONG = 180.0  # s of a task that is half of "very long"

#: What `weights` of rehearsal.yaml may name, with its meaning; all lie in 0..1 but the last two.
MEASURES = {
    "warnings": "how much had to be warned",
    "refused": "share of the robot's take-overs that came unwanted",
    "taken_over": "take-overs of the robot that the person noticed, for each cube",
    "helped": "share of the cubes that the robot placed right",
    "robot_errors": "share of the cubes that the robot placed wrong or the belt carried away",
    "success": "Eq. 6.4: share of the cubes placed right, as the result screen tells",
    "own_success": "Eq. 6.6: share of the person's own placements that were right",
    "own_share": "Eq. 6.3: share of the cubes that the person placed right",
    "mistakes": "share of the cubes that the person placed wrong",
    "memory_load": "items of the rules to be remembered, against what is held without effort",
    "length": "duration of the task",
    "weariness": "1 - stamina by now",
    "distraction": "1 - attention by now",
    "reluctance": "1 - collaborativeness by now",
    "inexperience": "1 - expertise by now",
    "tired_by_it": "share of the stamina at the door that the visit has taken by now",
    "calmer": "warnings of the first half of the tasks less those of the second, -1..1",
    "better": "own success of the second half of the tasks less that of the first, -1..1",
}
Measures = Mapping[str, float]
#: Of somebody who has done nothing yet.
NOTHING_YET = dict.fromkeys(MEASURES, 0.0)


def of_task(task: PlayedTask, begun: Character) -> dict[str, float]:
    """Return the MEASURES of one task. begun: the person's dials at the begin of the visit."""
    row, now = task.row, task.person
    placed = [row[f"{who}_{how}"] for who in ("human", "robot") for how in ("succeeded", "failed")]
    cubes = max(sum(placed), 1)
    own = row["human_success_rate"]
    return {
        "warnings": 1.0 - math.exp(-row["warnings"] / FEW_WARNINGS),
        "refused": task.refusals / task.interferences if task.interferences else 0.0,
        "taken_over": min(task.interferences / cubes, 1.0),
        "helped": row["robot_succeeded"] / cubes,
        "robot_errors": row["robot_failed"] / cubes,
        "success": row["task_success_rate"],
        "own_success": 0.5 if own is None else own,
        "own_share": row["human_contribution"],
        "mistakes": row["human_failed"] / cubes,
        "memory_load": task.remembered / (task.remembered + CHUNKS),
        "length": row["duration_s"] / (row["duration_s"] + LONG),
        "weariness": 1.0 - now.stamina,
        "distraction": 1.0 - now.attention,
        "reluctance": 1.0 - now.collaborativeness,
        "inexperience": 1.0 - now.expertise,
        "tired_by_it": max(0.0, 1.0 - now.stamina / max(begun.stamina, 0.05)),
        "calmer": 0.0,
        "better": 0.0,
    }


def of_several(tasks: Sequence[Measures]) -> dict[str, float]:
    """Return the MEASURES of tasks in a row: their means, and how they changed."""
    if not tasks:
        return dict(NOTHING_YET)
    found = {name: _mean(tasks, name) for name in MEASURES}
    half = len(tasks) // 2
    if half:
        first, last = tasks[:half], tasks[-half:]
        found["calmer"] = _mean(first, "warnings") - _mean(last, "warnings")
        found["better"] = _mean(last, "own_success") - _mean(first, "own_success")
    return found


def _mean(tasks: Sequence[Measures], name: str) -> float:
    return math.fsum(task[name] for task in tasks) / len(tasks)
