# SPDX-License-Identifier: BSD-3-Clause
"""Proves that nothing of a study is missing or changed, or names every place where something is."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fabric_study.bag_index import BagError, check_bag
from fabric_study.codes import CODE
from fabric_study.event_journal import JOURNAL_FILE, JournalError, read_journal
from fabric_study.results import format_value
from fabric_study.run_record import read_run
from fabric_study.store import STORE_FILE, Record, StoreError, faults_in, read_head, read_records
from fabric_study.study_folder import RUNS, STUDY_FILE, StudyInfo, read_study
from fabric_study.task_record import RESULTS_FILE, cells_of
from fabric_study.visit_state import Attempt, VisitError, VisitState

COUNTS = {  # column of results.csv: event, by whom; what nobody placed counts as the robot's
    "human_succeeded": ("subtask_succeeded", ("person",)),
    "human_failed": ("subtask_failed", ("person",)),
    "robot_succeeded": ("subtask_succeeded", ("robot",)),
    "robot_failed": ("subtask_failed", ("robot", "nobody")),
}


@dataclass
class Verdict:
    """What was checked, and every fault with its place."""

    checked: list[str] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)


def verify(folder: Path) -> Verdict:
    """Check a study folder against itself; nothing is changed."""
    verdict = Verdict()
    try:
        info = read_study(folder)
        head = read_head(folder)
        records = read_records(folder)
    except StoreError as error:
        verdict.faults.append(str(error))
        return verdict
    told = f"{info.protocol.name}, seed {info.seed}, hash of the protocol {info.protocol.hash[:16]}"
    verdict.checked.append(f"{STUDY_FILE}: {told}" + (", simulated people" * info.simulated))
    verdict.faults += [f"{STORE_FILE}: {fault}" for fault in faults_in(records, info.genesis, head)]
    verdict.checked.append(f"{STORE_FILE}: {len(records)} records, numbers and digests")
    states = _visits(info, records, verdict)
    _tasks(folder, states, verdict)
    return verdict


def _visits(info: StudyInfo, records: Sequence[Record], verdict: Verdict) -> dict[str, VisitState]:
    """Return the visits whose records follow from each other; faults of the others are noted."""
    states: dict[str, VisitState] = {}
    broken: set[str] = set()
    for record in records:
        if record.visit in broken or (not record.visit and record.kind == "note"):
            continue
        fresh = VisitState(info.protocol, info.seed, info.simulated)
        state = states.setdefault(record.visit, fresh)
        try:
            state.apply(record.kind, record.content)
        except (VisitError, ValueError, KeyError, TypeError) as error:
            broken.add(record.visit)
            place = f"{STORE_FILE}: record {record.seq}, visit {record.visit or '(none)'}"
            verdict.faults.append(f"{place}: {error}")
    sound = {person: state for person, state in states.items() if person not in broken}
    verdict.faults += _faults_in_people(sound)
    statuses = Counter(state.status for state in sound.values())
    counted = ", ".join(f"{count} {status}" for status, count in sorted(statuses.items()))
    answers = sum(len(given) for state in sound.values() for given in state.answers.values())
    verdict.checked.append(f"visits: {counted or 'none'}; every step in its order")
    verdict.checked.append(f"answers: {answers}, each one that its item offers, or missing")
    return sound


def _faults_in_people(states: dict[str, VisitState]) -> Iterator[str]:
    holders: dict[int | None, str] = {}
    for person, state in states.items():
        if state.index is None or not CODE.fullmatch(person):
            yield f"{STORE_FILE}: {person!r} is no code of a person whose visit was opened"
            continue
        if state.status == "aborted":
            continue
        if state.index in holders:
            yield f"{STORE_FILE}: {person} and {holders[state.index]} both have index {state.index}"
        holders[state.index] = person


def _tasks(folder: Path, states: dict[str, VisitState], verdict: Verdict) -> None:
    attempts = [attempt for state in states.values() for attempt in state.attempts]
    by_run: dict[str, dict[int, Attempt]] = {}
    for attempt in attempts:
        place = f"{RUNS}/{attempt.run} task {attempt.task_id}"
        if by_run.setdefault(attempt.run, {}).setdefault(attempt.task_id, attempt) is not attempt:
            verdict.faults.append(f"{place}: {attempt.step.id} is not the only step that it is for")
    bags = 0
    for run, tasks in by_run.items():
        path = folder / RUNS / run
        if not path.is_dir():
            verdict.faults.append(f"{RUNS}/{run}: there is no such folder")
            continue
        verdict.faults += [f"{RUNS}/{run}/{fault}" for fault in _faults_in_run(path, tasks)]
        if _recorded(path):
            bags += sum(attempt.row is not None for attempt in tasks.values())
            verdict.faults += [f"{RUNS}/{run}/{fault}" for fault in _faults_in_bags(path, tasks)]
    done = [attempt for attempt in attempts if attempt.row is not None]
    events = sum(len(attempt.events) for attempt in attempts)
    told = f"tasks: {len(done)} done, each with its row as in {RESULTS_FILE}"
    verdict.checked.append(f"{told}; {events} events as in {JOURNAL_FILE}, without gaps")
    told = f"{bags} closed, with an index that can be read" if bags else "none was to be recorded"
    verdict.checked.append(f"bags: {told}")


def _faults_in_run(run: Path, tasks: dict[int, Attempt]) -> Iterator[str]:
    try:
        cells = cells_of(run)
        path = run / JOURNAL_FILE
        entries = read_journal(path).entries if path.exists() else []
    except (JournalError, OSError, ValueError, KeyError, TypeError) as error:
        yield f"{RESULTS_FILE} or {JOURNAL_FILE}: {error}"
        return
    for task_id, attempt in tasks.items():
        happened = [entry for entry in entries if entry["task"] == task_id]
        yield from _faults_in_events(attempt, happened)
        if attempt.row is not None:
            yield from _faults_in_row(attempt, attempt.row, cells.get(task_id))
    for task_id in sorted({entry["task"] for entry in entries} | set(cells)):
        if task_id not in tasks:
            yield f"task {task_id}: is in no visit"


def _faults_in_events(attempt: Attempt, happened: list[dict[str, Any]]) -> Iterator[str]:
    place = f"{JOURNAL_FILE} task {attempt.task_id}"
    stored = attempt.events
    for entry, event in zip(happened, stored, strict=False):
        if entry != event:
            yield f"{place}: event {entry['sequence']} is not what the store has"
            return
    if len(happened) < len(stored):
        yield f"{place}: has {len(happened)} events, the store has {len(stored)}"
    elif len(happened) > len(stored) and attempt.row is not None:
        yield f"{place}: has {len(happened)} events, the store has only {len(stored)}"


def _faults_in_row(
    attempt: Attempt, row: dict[str, Any], cells: dict[str, str] | None
) -> Iterator[str]:
    place = f"{RESULTS_FILE} task {attempt.task_id}"
    if cells is None:
        yield f"{place}: has no row"
        return
    for column in dict.fromkeys([*row, *cells]):
        have, want = cells.get(column), format_value(row.get(column))
        if column not in row or column not in cells or have != want:
            yield f"{place}: {column} is {have!r}, in the store {want!r}"
    for column, (what, who) in COUNTS.items():
        counted = sum(event["what"] == what and event["by"] in who for event in attempt.events)
        if row.get(column) is not None and row[column] != counted:
            yield f"{place}: {column} is {row[column]}, but there are {counted} such events"


def _recorded(run: Path) -> bool:
    """Whether bags were to be written, by what the run says or by one that is there."""
    parameters = read_run(run).get("parameters", {})
    asked = isinstance(parameters, dict) and parameters.get("record") in (True, "true")
    return asked or any(run.glob("task_*.bag*"))


def _faults_in_bags(run: Path, tasks: dict[int, Attempt]) -> Iterator[str]:
    for task_id, attempt in tasks.items():
        if attempt.row is None:
            continue
        name = f"task_{task_id:03d}.bag"
        if (run / f"{name}.active").exists() and not (run / name).exists():
            yield f"{name}.active: was not closed"
            continue
        try:
            check_bag(run / name)
        except BagError as error:
            yield f"{name}: {str(error).removeprefix(f'{run / name}: ')}"
