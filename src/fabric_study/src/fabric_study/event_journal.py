# SPDX-License-Identifier: BSD-3-Clause
"""events.jsonl: every scored event of a run, on the disk before anybody hears of it.

    with EventJournal(folder / JOURNAL_FILE) as journal:
        journal.append(event)            # a fabric_msgs/TaskEvent; on the disk when this returns

    journal = read_journal(folder / JOURNAL_FILE)
    journal.entries                      # dicts as of `entry_of`, sequence 1, 2, 3 ...
    journal.torn                         # what a power cut left of the last line, or nothing

One line an event, one JSON object a line. Whatever process is killed and whenever, what was
published can be read here.
"""

import json
import math
import os
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

from fabric_msgs.msg import TaskEvent
from fabric_study.event_rows import KINDS, WHO
from fabric_study.stamps import to_seconds

JOURNAL_FILE = "events.jsonl"
Entry = dict[str, Any]
FIELDS: dict[str, type | tuple[type, ...]] = {
    "sequence": int,
    "task": int,
    "stamp": (int, float),  # s
    "what": str,  # a word of KINDS
    "by": str,  # a word of WHO
    "cube": int,  # id, 0 when none is meant
    "colour": int,  # Cube.COLOUR_*
    "container": str,
    "score": int,
}


class JournalError(ValueError):
    """A journal says something that cannot be; the text names file and line."""


@dataclass(frozen=True)
class Journal:
    """What a journal holds: entries with sequence 1, 2, 3 ..., and a torn last line if any."""

    entries: list[Entry]
    torn: str


def entry_of(event: TaskEvent) -> Entry:
    """Return the fields of a TaskEvent under the names of FIELDS."""
    values = (
        event.sequence,
        event.task_id,
        to_seconds(event),
        KINDS[event.kind],
        WHO[event.by],
        event.cube_id,
        event.cube_colour,
        event.container,
        event.score,
    )
    return dict(zip(FIELDS, values, strict=True))


class EventJournal:
    """Appends events in order, each on the disk when `append` returns."""

    def __init__(self, path: Path) -> None:
        """Begin the journal of a run; one that exists is refused (FileExistsError)."""
        self._path = path
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o644)
        _sync_folder(path.parent)
        self._size = 0
        self._last = 0

    def __enter__(self) -> "EventJournal":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def append(self, event: TaskEvent) -> None:
        """Write one event through to the disk.

        Raises JournalError when its sequence does not follow the last one, and OSError when the
        disk refuses; then the event has not happened and the journal is as before.
        """
        if event.sequence != self._last + 1:
            raise JournalError(f"{self._path}: event {event.sequence} follows {self._last}")
        line = (json.dumps(entry_of(event), separators=(",", ":")) + "\n").encode()
        try:
            self._write(line)
            os.fsync(self._file)
        except OSError:
            os.ftruncate(self._file, self._size)
            raise
        self._size += len(line)
        self._last = event.sequence

    def _write(self, line: bytes) -> None:
        while line:
            line = line[os.write(self._file, line) :]

    def close(self) -> None:
        """Close the file; closing twice does nothing."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1


def read_journal(path: Path) -> Journal:
    """Read a journal, also while it is being written.

    Raises JournalError naming file and line for one that is no event or breaks the sequence.
    Only the last line may be torn.
    """
    lines = path.read_bytes().split(b"\n")
    torn = lines.pop()  # whole lines end with a newline
    if lines and not torn and not _is_json(lines[-1]):  # blocks that a power cut left unwritten
        torn = lines.pop()
    entries: list[Entry] = []
    for number, line in enumerate(lines, start=1):
        entries.append(_checked(line, number, path))
    return Journal(entries, torn.decode("utf-8", "backslashreplace"))


def _is_json(line: bytes) -> bool:
    try:
        json.loads(line)
    except ValueError:
        return False
    return True


def _checked(line: bytes, number: int, path: Path) -> Entry:
    place = f"{path}: line {number}"
    try:
        entry = json.loads(line)
    except ValueError as error:
        raise JournalError(f"{place}: is no JSON: {error}") from error
    if not isinstance(entry, dict) or set(entry) != set(FIELDS):
        raise JournalError(f"{place}: must have the fields {', '.join(FIELDS)}")
    for name, kind in FIELDS.items():
        if isinstance(entry[name], bool) or not isinstance(entry[name], kind):
            raise JournalError(f"{place}: {name} is {entry[name]!r}")
    if not math.isfinite(entry["stamp"]):
        raise JournalError(f"{place}: stamp is {entry['stamp']}")
    if entry["sequence"] != number:
        raise JournalError(f"{place}: sequence is {entry['sequence']}, not {number}")
    return entry


def _sync_folder(folder: Path) -> None:
    """Make the name of a new file last as its content does."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
