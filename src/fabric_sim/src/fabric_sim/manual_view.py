# SPDX-License-Identifier: BSD-3-Clause
"""What somebody at the keys gets to see: the newest messages in plain words."""

from __future__ import annotations

import threading
from typing import Any

from fabric_msgs.msg import (
    Cube,
    CubeArray,
    Decision,
    GroundTruth,
    RobotActionState,
    SortingRule,
    TaskState,
)
from fabric_sim.manual_commands import command_of_key

TOPICS = {
    "task/state": TaskState,
    "robot/state": RobotActionState,
    "cell/cubes": CubeArray,
    "truth": GroundTruth,
}

_STATUS = {
    TaskState.WAITING: "no task yet",
    TaskState.SHOWING_RULES: "get ready",
    TaskState.RUNNING: "running",
    TaskState.SUCCEEDED: "succeeded",
    TaskState.FAILED: "failed",
    TaskState.ABORTED: "aborted",
}
_COLOURS = {
    Cube.COLOUR_UNKNOWN: "grey",
    Cube.COLOUR_RED: "red",
    Cube.COLOUR_GREEN: "green",
    Cube.COLOUR_BLUE: "blue",
}
_ROBOT = {
    Decision.IDLE: "stands by",
    Decision.PLANNING: "plans a grasp",
    Decision.POINT: "points at the cube",
    Decision.GRASP: "takes over",
    Decision.CANCEL: "withdraws",
    RobotActionState.NONE: "rests",
}
_PHASES = {
    RobotActionState.PHASE_APPROACH: "on its way",
    RobotActionState.PHASE_CONTACT: "at the cube",
    RobotActionState.PHASE_CARRY: "carrying",
}
_OPEN = (TaskState.SHOWING_RULES, TaskState.RUNNING)
_INSPECTED = ["inspected"]


class ManualView:
    """Takes messages of TOPICS from any thread and tells them as one dictionary."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._newest: dict[str, Any] = {topic: kind() for topic, kind in TOPICS.items()}
        self._newest["robot/state"].current = RobotActionState.NONE

    def take(self, message: Any, topic: str) -> None:
        """Remember the newest message of a topic."""
        with self._lock:
            self._newest[topic] = message

    def command_of_key(self, key: str) -> tuple[str, str] | None:
        """(name, tray) of a key in the running task, None for other keys."""
        return command_of_key(key, self.snapshot()["trays"])

    def snapshot(self) -> dict[str, Any]:
        """Task, robot, cubes and person, ready for JSON.

        waiting: time stands until somebody begins. seconds: since the task's start. trays: labels
        in the order of the digit keys.
        """
        with self._lock:
            task, robot, cubes, truth = (self._newest[topic] for topic in TOPICS)
        begun = truth.task_id == task.task_id
        return {
            "task": _task(task, truth.header.stamp.to_sec()),
            "waiting": task.status in _OPEN and not begun,
            "trays": _trays(task),
            "robot": _robot(robot),
            "cubes": _cubes(cubes) if begun else _cubes(CubeArray()),
            "person": _person(truth) if begun else _person(GroundTruth()),
        }


def _task(task: TaskState, now: float) -> dict[str, Any]:
    return {
        "number": task.task_id,
        "scenario": task.scenario,
        "status": _STATUS[task.status],
        "rules": [_rule(rule) for rule in task.rules],
        "seconds": _seconds(task, now),
        "total": task.subtasks_total,
        "by_person": task.succeeded_by_person,
        "by_robot": task.succeeded_by_robot,
        "failed": task.failed_by_person + task.failed_by_robot,
        "warnings": task.warnings,
        "score": task.score,
    }


def _rule(rule: SortingRule) -> dict[str, Any]:
    """An item to remember. colour: none when it does not matter. word, ink: none without."""
    return {
        "colour": _COLOURS[rule.colour] if rule.colour else None,
        "occurrence": rule.occurrence,
        "tray": rule.label,
        "word": _COLOURS[rule.word] if rule.word else None,
        "ink": _COLOURS[rule.ink] if rule.word else None,
        "ink_counts": rule.ink_counts,
    }


def _seconds(task: TaskState, now: float) -> float:
    """How long the task has been running, or was; s."""
    if task.status == TaskState.RUNNING:
        return round(max(0.0, now - task.started), 1)
    return 0.0 if task.status == TaskState.SHOWING_RULES else task.duration


def _robot(state: RobotActionState) -> str:
    if state.phase == RobotActionState.PHASE_RETREAT:
        return "goes home"
    return ", ".join(filter(None, (_ROBOT[state.current], _PHASES.get(state.phase))))


def _trays(task: TaskState) -> list[str]:
    return sorted({rule.label for rule in task.rules}) or _INSPECTED


def _cubes(message: CubeArray) -> dict[str, list[str]]:
    """Colours of the cubes by place; on the belt the next one first."""
    places = {
        Cube.WHERE_BELT: "belt",
        Cube.WHERE_PICK_POINT: "pick_point",
        Cube.WHERE_PERSON: "person",
        Cube.WHERE_ROBOT: "robot",
    }
    found: dict[str, list[str]] = {name: [] for name in places.values()}
    for cube in sorted(message.cubes, key=lambda cube: cube.id):
        if cube.where in places:
            found[places[cube.where]].append(_COLOURS[cube.colour])
    return found


def _person(truth: GroundTruth) -> dict[str, Any]:
    return {
        "action": truth.action,
        "state": truth.state,
        "for_the_robot": truth.anticipated_state,
        "away": truth.state == "recovery",
    }
