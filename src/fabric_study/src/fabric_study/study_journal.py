# SPDX-License-Identifier: BSD-3-Clause
"""What the store tells beyond tables: notes, how long visits took, what was tried again."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

from fabric_study.store import Record


@dataclass(frozen=True)
class VisitCourse:
    """How one visit went. Durations in s."""

    person: str
    duration: float  # from its first to its last record, pauses included
    paused: float
    tasks_aborted: int


def notes(records: Iterable[Record]) -> list[tuple[str, str, str]]:
    """Return time (UTC), person and text of the experimenter's notes."""
    return [
        (
            datetime.fromtimestamp(record.stamp, UTC).strftime("%Y-%m-%d %H:%M:%S"),
            record.visit,
            str(record.content["text"]),
        )
        for record in records
        if record.kind == "note"
    ]


def courses(records: Sequence[Record]) -> list[VisitCourse]:
    """Return the course of every visit, in the order of opening."""
    visits: dict[str, list[Record]] = {}
    for record in records:
        if record.visit:
            visits.setdefault(record.visit, []).append(record)
    return [
        VisitCourse(
            person=person,
            duration=told[-1].stamp - told[0].stamp,
            paused=_paused(told),
            tasks_aborted=sum(record.kind == "task_aborted" for record in told),
        )
        for person, told in visits.items()
    ]


def _paused(records: Sequence[Record]) -> float:
    total, since = 0.0, None
    for record in records:
        if record.kind == "paused" and since is None:
            since = record.stamp
        elif record.kind in ("resumed", "visit_closed") and since is not None:
            total, since = total + record.stamp - since, None
    return total
