# SPDX-License-Identifier: BSD-3-Clause
"""A folder of recordings as people, and the take-overs of the recorded robots in them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from fabric_planner.replay import Recording, ReplayError, Step, read_csv
from fabric_planner.replay_bag import read_bag

SCENARIO = "sorting"
UNKNOWN = "unknown"  # what the readers call a robot that a file does not name
READERS = {".csv": read_csv, ".bag": read_bag}
_NAME = re.compile(r"(?P<person>.+)_task(?P<task>\d+)_(?P<robot>[^_]+)$")


@dataclass(frozen=True)
class Task:
    """One recorded task of a person; tasks of a person are in the order of `number`."""

    person: str
    number: int
    recording: Recording


@dataclass(frozen=True)
class Folder:
    """The recordings of a folder by person, and the files whose names say no person."""

    path: Path
    people: dict[str, list[Task]]
    nameless: tuple[str, ...]


@dataclass(frozen=True)
class Answer:
    """How the person answered a take-over: `accepted` if no warning was seen before the next
    placement; `ended_by` says who made that placement."""

    accepted: bool
    ended_by: str


@dataclass(frozen=True)
class Begin:
    """A take-over begun at step `index`: the first grasp of its subtask, or one after another
    action (`begun`), or both."""

    index: int
    first: bool
    begun: bool


def read_folder(folder: Path) -> Folder:
    """Read every .csv and .bag file of a folder. Raises ReplayError naming folder or file."""
    folder = Path(folder)
    if not folder.is_dir():
        raise ReplayError(f"{folder}: there is no such folder")
    paths = sorted(path for path in folder.iterdir() if path.suffix in READERS)
    if not paths:
        raise ReplayError(f"{folder}: holds no recording, no .csv or .bag file")
    tasks, nameless = [], []
    for path in paths:
        match = _NAME.match(path.stem)
        recording = _read(path)
        if match and recording.robot == UNKNOWN:
            recording.robot = match["robot"]
        if match:
            tasks.append(Task(match["person"], int(match["task"]), recording))
        else:
            nameless.append(path.name)
            tasks.append(Task(path.stem, 1, recording))
    people: dict[str, list[Task]] = {}
    for task in sorted(tasks, key=lambda t: (t.person, t.number, t.recording.name)):
        people.setdefault(task.person, []).append(task)
    return Folder(folder, people, tuple(nameless))


def _read(path: Path) -> Recording:
    recording = READERS[path.suffix](path)
    if recording.scenario != SCENARIO:
        raise ReplayError(
            f"{path}: was recorded in scenario '{recording.scenario}'; "
            f"take-overs are scored with the model of '{SCENARIO}'"
        )
    recording.robot = recording.robot.removeprefix(f"{SCENARIO}_")
    return recording


def begins(steps: Sequence[Step]) -> list[Begin]:
    """Return where the recorded robot took over, in order."""
    found, subtasks, before = [], set(), None
    for index, step in enumerate(steps):
        if step.recorded == "grasp" and not step.final:
            first = step.decides_for not in subtasks
            begun = before != "grasp"
            subtasks.add(step.decides_for)
            if first or begun:
                found.append(Begin(index, first, begun))
        before = step.recorded or before
    return found


def answer(steps: Sequence[Step], index: int) -> Answer:
    """Return what followed on the take-over at step `index`; this is the outcome, not evidence."""
    accepted = True
    for step in steps[index + 1 :]:
        accepted = accepted and not warns(step)
        if step.placement:
            return Answer(accepted, _who(step))
    return Answer(accepted, "nobody")


def warns(step: Step) -> bool:
    """The person is seen to warn; a tray's report shows them only as they were before."""
    return step.observation.warning and step.seen


def _who(step: Step) -> str:
    o = step.observation
    who = "person" if o.subtask_success or o.subtask_failure else "robot"
    return f"{who} {'right' if o.subtask_success or o.robot_success else 'wrong'}"
