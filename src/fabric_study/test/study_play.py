# SPDX-License-Identifier: BSD-3-Clause
"""Plays visits without ROS: what console, task node and recorder do, in the order they do it."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path
from unittest import mock

import yaml

from fabric_msgs.clock import header_of
from fabric_msgs.msg import TaskEvent
from fabric_study.event_journal import JOURNAL_FILE, EventJournal, entry_of
from fabric_study.meter import COLUMNS
from fabric_study.protocol import Protocol, load_protocol
from fabric_study.results import ResultsWriter
from fabric_study.study_folder import Study, open_study
from fabric_study.task_record import catch_up
from fabric_study.visit import Visit

SEED = 101
Report = Callable[..., None]


def words(text: str) -> dict[str, str]:
    return {"en": text, "de": f"{text} (deutsch)"}


def instrument(when: str, items: dict, **more) -> dict:
    return {"title": words("Title"), "when": when, "shuffle": True, "items": items, **more}


def likert(name: str) -> dict:
    labels = {n: {"en": f"step {n}", "de": f"Stufe {n}"} for n in range(1, 6)}
    return {"kind": "likert", "category": "load", "text": words(name), "labels": labels}


INSTRUMENTS = {
    "demographics": instrument(
        "start",
        {
            "age": {"kind": "number", "category": "person", "low": 16, "high": 99,
                    "text": words("Age?")},
            "hand": {"kind": "choice", "category": "person", "text": words("Hand?"),
                     "labels": {"left": words("left"), "right": words("right")}},
        },
    ),
    "after": instrument("task", {name: likert(name) for name in ("trust", "tired", "bored")}),
    "load": instrument(
        "general",
        {
            "effort": {"kind": "tlx", "category": "load", "text": words("Effort?"),
                       "labels": {0: words("none"), 100: words("much")}},
            "pick": {"kind": "pair", "category": "load", "text": words("Which?"),
                     "labels": {"effort": words("effort"), "pace": words("pace")}},
            "remark": {"kind": "text", "category": "remarks", "text": words("Anything?")},
        },
    ),
}  # fmt: skip
PLAN = {
    "title": words("A small study"),
    "people": 4,
    "order": {"kind": "balanced", "first": ["alone"]},
    "start": [
        {"text": words("Welcome")},
        {"instrument": "demographics"},
        {"practice": {"definition": "sorting", "policy": "none"}},
    ],
    "conditions": {
        "alone": {
            "shown_as": words("alone"), "definition": "sorting", "policy": "none", "tasks": 1,
            "after_condition": [],
        },
        "slow": {
            "shown_as": words("Robot 1"), "definition": "sorting", "policy": "reactive",
            "tasks": 1, "text": words("Now robot 1"),
        },
        "quick": {
            "shown_as": words("Robot 2"), "definition": "sorting", "policy": "proactive",
            "tasks": 2,
        },
    },
    "after_task": ["after"],
    "after_condition": ["load"],
    "end": [{"text": words("Thank you")}],
}  # fmt: skip


def write_plan(folder: Path, plan: dict = PLAN, instruments: dict = INSTRUMENTS) -> Path:
    """Write a protocol with its instruments beside it; return the path of the protocol."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in {**instruments, "small": plan}.items():
        text = yaml.safe_dump(content, sort_keys=False, allow_unicode=True)
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    return folder / "small.yaml"


def small_protocol(folder: Path) -> Protocol:
    return load_protocol(str(write_plan(folder)))


def small_study(folder: Path, seed: int = SEED) -> Study:
    """Open or begin the small study in a folder; to ask for versions would take long."""
    with mock.patch("fabric_study.study_folder.versions", dict):
        return open_study(folder / "study", small_protocol(folder / "plan"), seed, simulated=False)


def answer_of(person: str, step: str, item) -> object:
    """What this person answers, the same whenever asked; some items stay without an answer."""
    rng = random.Random(f"{person}/{step}/{item.id}")
    if rng.random() < 0.2:
        return None
    if item.kind == "text":
        return rng.choice(["=1+1", "gut, weiter so", '"Zeile"\nzwei; drei', "ok"])
    if item.labels and item.kind in ("choice", "pair"):
        return rng.choice(list(item.labels))
    return rng.randrange(int(item.low), int(item.high) + 1, 5 if item.kind == "tlx" else 1)


class RunFolder:
    """A run folder as task node and recorder write it."""

    def __init__(self, path: Path) -> None:
        self.path = path
        path.mkdir(parents=True)
        self._journal = EventJournal(path / JOURNAL_FILE)
        self._results = ResultsWriter(path / "results.csv")
        self._sequence = self.tasks = 0

    def events(self, seed: int):
        """Play a task; yield each event when it stands in the journal, then the row."""
        self.tasks += 1
        rng = random.Random(seed)
        row = dict.fromkeys(COLUMNS)
        row.update(task=self.tasks, seed=seed, scenario="sorting", human="", policy="", model="")
        row.update(human_succeeded=0, human_failed=0, robot_succeeded=0, robot_failed=0)
        yield self._event(TaskEvent.TASK_STARTED)
        for cube in range(1, 4):
            by = rng.choice([TaskEvent.BY_PERSON, TaskEvent.BY_ROBOT])
            good = rng.random() < 0.7
            who = "human" if by == TaskEvent.BY_PERSON else "robot"
            row[f"{who}_{'succeeded' if good else 'failed'}"] += 1
            kind = TaskEvent.SUBTASK_SUCCEEDED if good else TaskEvent.SUBTASK_FAILED
            yield self._event(kind, by=by, cube_id=cube, container="red", score=10)
        yield self._event(TaskEvent.TASK_SUCCEEDED)
        row.update(success=1, warnings=0, duration_s=12.5, efficiency=1 / 3)
        self._results.write(row)

    def _event(self, kind: int, **fields) -> TaskEvent:
        self._sequence += 1
        event = TaskEvent(
            header=header_of(100.0 + self._sequence, ""), sequence=self._sequence,
            task_id=self.tasks, kind=kind, **fields,
        )  # fmt: skip
        self._journal.append(event)
        return event


def play(study: Study, visit: Visit, run: RunFolder, report: Report = lambda *told: None) -> None:
    """Go through what is left of a visit; `report` hears of everything once it is committed."""
    t = 1000.0
    while visit.step is not None:
        step = visit.step
        for item in visit.items():
            value = answer_of(visit.person, step.id, item)
            if value is not None and item.id in visit.missing():
                visit.answer(t, item.id, value)
                report("answer", step.id, item.id, value)
        if step.kind == "task":
            play_task(study, visit, run, report)
        visit.finish_step(t, step.id)
        report("done", step.id)


def play_task(study: Study, visit: Visit, run: RunFolder, report: Report) -> None:
    """Play the task of a step, or what is left to write down of it."""
    t = 1000.0
    if catch_up(visit, t, study.folder):
        return
    if visit.task_running:
        visit.task_aborted(t, "killed")
    visit.task_begun(t, run.path.name, run.tasks + 1)
    for event in run.events(visit.attempt.seed):
        report("scored", run.path.name, event.sequence)
        visit.task_event(t, entry_of(event))
        report("event", run.path.name, event.sequence)
    assert catch_up(visit, t, study.folder)
