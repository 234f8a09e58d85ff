# SPDX-License-Identifier: BSD-3-Clause
"""Recorded trials: what a camera saw of a person, what the robot did and where the cubes went.

One CSV file a task, `personNN_taskK_<robot>.csv`, one row an event; docs/experiments.md lists the
columns. `Trial` is the same on an even grid of time, which is what a likelihood works on.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

TICK = 0.5  # s

SYMBOLS = ("idle", "grasp", "look", "warn", "walk", "absent")
IDLE, GRASP, LOOK, WARN, WALK, ABSENT = range(len(SYMBOLS))
UNSEEN = -1  # no observation yet

ROBOT_ACTIONS = ("idle", "planning for grasping", "point to remind human", "grasp")
ROBOT_IDLE, ROBOT_PLANNING, ROBOT_POINT, ROBOT_GRASP = range(len(ROBOT_ACTIONS))
CANCEL = "cancel all actions"

EVENTS = ("", "person succeeded", "person failed", "robot succeeded", "robot failed")
NOTHING, PERSON_SUCCEEDED, PERSON_FAILED, ROBOT_SUCCEEDED, ROBOT_FAILED = range(len(EVENTS))

FLAGS = (
    "looking_around", "detected", "grasp_attempt", "warning", "idle", "task_success",
    "task_failure",
)  # fmt: skip
COLUMNS = ("time_s", "source", *FLAGS, "mapped_obs", "robot_action", "subtask_status", "who")
SOURCES = ("manager", "manager-task-done", "observation", "robot", "sensor")
_SUCCESS = {"success": True, "robot succeeded": True, "fail": False, "robot failed": False}
_NAME = re.compile(r"(?P<person>.+)_task(?P<task>\d+)_(?P<robot>[^_]+)$")


class TrialError(ValueError):
    """A recording cannot be used; the message names file, row, column and value."""


@dataclass(frozen=True)
class Trial:
    """One task on a grid of TICK seconds.

    symbols: (n,) of SYMBOLS, UNSEEN before the first observation. robot: (n,) of ROBOT_ACTIONS.
    events: (n,) of EVENTS, at most one a tick. observations: how many were recorded.
    waits: whether the first cube still has to come.
    """

    person: str
    task: int
    robot_name: str
    scenario: str
    symbols: np.ndarray
    robot: np.ndarray
    events: np.ndarray
    observations: int
    waits: bool = True

    @property
    def name(self) -> str:
        """As the file is called, without its ending."""
        return f"{self.person}_task{self.task}_{self.robot_name}"

    def __len__(self) -> int:
        return len(self.symbols)


def symbol_of(flags: Mapping[str, bool]) -> int:
    """Return what a person is seen to do: absence hides all, a warning the rest, a grasp a look."""
    if not flags["detected"]:
        return ABSENT
    if flags["warning"]:
        return WARN
    if flags["grasp_attempt"]:
        return GRASP
    if flags["looking_around"]:
        return LOOK
    return IDLE if flags["idle"] else WALK


def gridded(
    person: str,
    task: int,
    robot_name: str,
    scenario: str,
    rows: Sequence[Mapping[str, str]],
    waits: bool = True,
) -> Trial:
    """Return rows of text cells by COLUMNS, already checked, as a Trial."""
    times = np.array([float(row["time_s"]) for row in rows])
    n = max(1, math.ceil(times[-1] / TICK) + 1)
    ticks = np.ceil(times / TICK - 1e-9).astype(int)
    symbols, robot = np.full(n, UNSEEN), np.full(n, ROBOT_IDLE)
    events = np.zeros(n, dtype=int)
    observations = 0
    for tick, row in zip(ticks, rows, strict=True):
        if row["source"] == "observation":
            symbols[tick:] = symbol_of({flag: row[flag] == "1" for flag in FLAGS})
            observations += 1
        elif row["source"] == "robot":
            robot[tick:] = robot_action(row["robot_action"])
        elif row["source"] == "sensor":
            _put(events, tick, event_of(row["subtask_status"], row["who"]))
    return Trial(person, task, robot_name, scenario, symbols, robot, events, observations, waits)


def _put(events: np.ndarray, tick: int, event: int) -> None:
    """Two cubes in one tick go to ticks of their own; the end has room for no more."""
    while tick < len(events) and events[tick]:
        tick += 1
    if tick < len(events):
        events[tick] = event


def robot_action(text: str) -> int:
    """Return the number of a robot's action; a robot that stops or was told nothing is idle."""
    return ROBOT_IDLE if text in ("", CANCEL) else ROBOT_ACTIONS.index(text)


def event_of(status: str, who: str) -> int:
    """Return the number of a sensor's event."""
    if who == "human":
        return PERSON_SUCCEEDED if _SUCCESS[status] else PERSON_FAILED
    return ROBOT_SUCCEEDED if _SUCCESS[status] else ROBOT_FAILED


# -- files ----------------------------------------------------------------------------------------


def read_folder(folder: Path, scenario: str = "sorting") -> list[Trial]:
    """Return the trials of every CSV file in a folder, by person and task.

    Raises TrialError naming the folder, or file, row, column and value.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise TrialError(f"{folder}: no such folder")
    paths = sorted(folder.glob("*.csv"))
    if not paths:
        raise TrialError(f"{folder}: holds no .csv file of a trial")
    trials = [read_trial(path, scenario) for path in paths]
    return sorted(trials, key=lambda trial: (trial.person, trial.task, trial.robot_name))


def read_trial(path: Path, scenario: str = "sorting") -> Trial:
    """Return one recorded task; raises TrialError naming file, row, column and value."""
    path = Path(path)
    match = _NAME.match(path.stem)
    if not match:
        raise TrialError(f"{path}: the name should be like person04_task1_proactive.csv")
    try:
        with path.open(newline="", encoding="utf-8") as file:
            reader = csv.DictReader(file)
            missing = [name for name in COLUMNS if name not in (reader.fieldnames or ())]
            if missing:
                raise TrialError(f"{path}: row 1: column {missing[0]} is missing")
            rows = list(reader)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise TrialError(f"{path}: {error}") from None
    _check(path, rows)
    return gridded(match["person"], int(match["task"]), match["robot"], scenario, rows)


def _check(path: Path, rows: list[dict[str, str]]) -> None:
    before = 0.0
    for number, row in enumerate(rows, start=2):
        where = f"{path}: row {number}"
        if None in row or None in row.values():
            raise TrialError(f"{where}: has not {len(COLUMNS)} cells")
        before = _time(where, row["time_s"], before)
        _one_of(where, "source", row["source"], SOURCES)
        _check_source(where, row)
    if not any(row["source"] == "observation" for row in rows):
        raise TrialError(f"{path}: column source: there is no observation")


def _check_source(where: str, row: dict[str, str]) -> None:
    if row["source"] == "observation":
        for flag in FLAGS:
            _one_of(where, flag, row[flag], ("0", "1"))
    elif row["source"] == "robot":
        _one_of(where, "robot_action", row["robot_action"], ("", *ROBOT_ACTIONS, CANCEL))
    elif row["source"] == "sensor":
        _one_of(where, "subtask_status", row["subtask_status"], tuple(_SUCCESS))
        _one_of(where, "who", row["who"], ("human", "robot"))


def _time(where: str, text: str, before: float) -> float:
    try:
        value = float(text)
    except ValueError:
        raise TrialError(f"{where}: column time_s: {text!r} is not a number") from None
    if not math.isfinite(value) or not 0.0 <= value < 86400.0:
        raise TrialError(f"{where}: column time_s: {text!r} is not within a day")
    if value < before:
        raise TrialError(f"{where}: column time_s: {text} is before the row above ({before:g})")
    return value


def _one_of(where: str, column: str, value: str, allowed: tuple[str, ...]) -> None:
    if value not in allowed:
        words = ", ".join(repr(word) for word in allowed)
        raise TrialError(f"{where}: column {column}: {value!r} is not one of {words}")


def write_rows(path: Path, rows: Iterable[Mapping[str, object]]) -> None:
    """Write a trial's rows; cells that a row does not name stay empty."""
    with Path(path).open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, restval="", lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def by_person(trials: Iterable[Trial]) -> dict[str, list[Trial]]:
    """Group trials by person, in the order of their tasks."""
    people: dict[str, list[Trial]] = {}
    for trial in trials:
        people.setdefault(trial.person, []).append(trial)
    return {name: sorted(own, key=lambda trial: trial.task) for name, own in people.items()}
