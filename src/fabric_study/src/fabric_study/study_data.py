# SPDX-License-Identifier: BSD-3-Clause
"""A study as tables, for statistics and reports.

data = load_study(folder)
data.tasks      # one row a scored task: who, under which condition, columns of results.csv
data.answers    # one row an item that was asked
data.people     # one row a person: code, order of conditions, status, demographics
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from fabric_study.meter import COLUMNS
from fabric_study.protocol import Protocol
from fabric_study.results import INTEGERS, WORDS
from fabric_study.store import Record, StoreError, sound_records
from fabric_study.study_folder import StudyInfo, read_study
from fabric_study.visit_state import VisitError, VisitState

TASK_KEYS = ("person", "condition", "number", "in_condition", "definition")
ANSWER_KEYS = ("person", "condition", "number", "instrument", "item", "kind", "category", "value")
PERSON_KEYS = ("person", "index", "order", "status")
DEMOGRAPHICS = "demographics"  # instrument whose items become columns of people


@dataclass(frozen=True)
class StudyData:
    """A study as pandas tables; what is undefined or was not answered is missing in them.

    `people`: person, index, order (conditions in the order met, joined by spaces), status (open,
    finished, aborted), and one column for each demographic item.
    `tasks`: person, condition, number (of the scored task, from 1), in_condition, definition, and
    the columns of results.csv; practice is left out.
    `answers`: person, condition, number (0: not after a task), instrument, item, kind, category,
    value (as given; items with `reverse` are not turned round).
    """

    meta: Mapping[str, Any]  # study.json: protocol (name), hash, seed, simulated, content ...
    people: pd.DataFrame
    tasks: pd.DataFrame
    answers: pd.DataFrame

    @property
    def simulated(self) -> bool:
        """Whether people and answers are made up; whatever shows them must say so."""
        return bool(self.meta["simulated"])


def load_study(folder: Path | str) -> StudyData:
    """Return the study of a folder as its store knows it.

    Raises StoreError naming file and record of what is damaged or cannot follow.
    """
    folder = Path(folder)
    info = read_study(folder)
    states = _opened(replayed(info, sound_records(folder, info.genesis)))
    people = [_person(person, state, info.protocol) for person, state in states.items()]
    tasks = [row for person, state in states.items() for row in _tasks(person, state)]
    answers = [
        row for person, state in states.items() for row in _answers(person, state, info.protocol)
    ]
    frames = (_frame(tasks, (*TASK_KEYS, *COLUMNS)), _frame(answers, ANSWER_KEYS))
    demographics = _demographic_items(info.protocol)
    return StudyData(info.content, _frame(people, (*PERSON_KEYS, *demographics)), *frames)


def _opened(states: Mapping[str, VisitState]) -> dict[str, VisitState]:
    return {person: state for person, state in states.items() if state.index is not None}


def study_from_frames(
    meta: Mapping[str, Any], tasks: pd.DataFrame, answers: pd.DataFrame
) -> StudyData:
    """Return a study made of tables, with columns as those of `StudyData`.

    `meta` needs at least `protocol` (a name) and `simulated`; `people` are those in the tables.
    Raises ValueError naming a column or key that is missing.
    """
    for key in ("protocol", "simulated"):
        if key not in meta:
            raise ValueError(f"meta lacks {key}")
    for name, frame, keys in (("tasks", tasks, TASK_KEYS), ("answers", answers, ANSWER_KEYS)):
        missing = [key for key in keys if key not in frame.columns]
        if missing:
            raise ValueError(f"{name} lacks the columns {', '.join(missing)}")
    names = list(dict.fromkeys([*tasks["person"], *answers["person"]]))
    people = [
        {"person": name, "index": index, "order": _order_met(tasks, name), "status": "finished"}
        for index, name in enumerate(names)
    ]
    return StudyData(dict(meta), _frame(people, PERSON_KEYS), tasks, answers)


def _order_met(tasks: pd.DataFrame, person: str) -> str:
    met = tasks[tasks["person"] == person].sort_values("number")["condition"]
    return " ".join(dict.fromkeys(met))


def replayed(info: StudyInfo, records: Iterable[Record]) -> dict[str, VisitState]:
    """Return the state of each visit by the person's code, in the order of opening.

    Raises StoreError naming the record that cannot follow.
    """
    states: dict[str, VisitState] = {}
    for record in records:
        if not record.visit and record.kind == "note":
            continue
        state = states.setdefault(
            record.visit, VisitState(info.protocol, info.seed, info.simulated)
        )
        try:
            state.apply(record.kind, json.loads(record.data))
        except VisitError as error:
            raise StoreError(f"record {record.seq}, visit {record.visit}: {error}") from error
    return states


def _person(person: str, state: VisitState, protocol: Protocol) -> dict[str, Any]:
    met = dict.fromkeys(step.condition for step in state.steps if step.kind == "task")
    row: dict[str, Any] = {
        "person": person,
        "index": state.index,
        "order": " ".join(filter(None, met)),
        "status": state.status,
    }
    given = dict.fromkeys(_demographic_items(protocol))
    for step in state.steps:
        if step.instrument == DEMOGRAPHICS:
            given.update(state.answers.get(step.id, {}))
    return {**row, **given}


def _demographic_items(protocol: Protocol) -> tuple[str, ...]:
    instrument = protocol.instruments.get(DEMOGRAPHICS)
    return tuple(item.id for item in instrument.items) if instrument else ()


def _tasks(person: str, state: VisitState) -> Iterable[dict[str, Any]]:
    for attempt in state.attempts:
        step = attempt.step
        if attempt.row is not None and not step.practice:
            place = (person, step.condition, step.number, step.in_condition, step.definition)
            yield {**dict(zip(TASK_KEYS, place, strict=True)), **attempt.row}


def _answers(person: str, state: VisitState, protocol: Protocol) -> Iterable[dict[str, Any]]:
    for step in state.steps:
        given = state.answers.get(step.id, {})
        items = protocol.instruments[step.instrument].items if step.instrument else ()
        for item in items:
            if item.id in given:
                place = (person, step.condition, step.number, step.instrument)
                values = (*place, item.id, item.kind, item.category, given[item.id])
                yield dict(zip(ANSWER_KEYS, values, strict=True))


def _frame(rows: Sequence[Mapping[str, Any]], columns: Sequence[str]) -> pd.DataFrame:
    """Return rows as a table whose numbers are floats where any may be missing."""
    frame = pd.DataFrame(list(rows), columns=list(columns))
    for column in frame.columns:
        if column in COLUMNS and column not in WORDS:
            whole = column in INTEGERS and not frame[column].isna().any()
            frame[column] = frame[column].astype("int64" if whole else "float64")
    if "value" in frame.columns:
        frame["value"] = frame["value"].astype(object)
    return frame
