# SPDX-License-Identifier: BSD-3-Clause
"""events.csv: everything that happened in the tasks of a run, one line each, and its hash.

It holds what both drivers see - scored events, observations, decisions - and nothing that depends
on the machine, so the same seed gives the same file through the ROS graph and through the headless
runner, and `digest` tells it in a word.
"""

import hashlib
from collections.abc import Iterable
from pathlib import Path

from fabric_study.event_rows import LOG_COLUMNS, LogRow
from fabric_study.results import TableWriter

LOG_FILE = "events.csv"
BLOCK = 1 << 20  # bytes read at once


class EventLogWriter(TableWriter):
    """events.csv of a run; an existing one is refused (FileExistsError)."""

    def __init__(self, path: Path) -> None:
        super().__init__(path, LOG_COLUMNS)

    def write_task(self, rows: Iterable[LogRow]) -> None:
        """Append the lines of a task."""
        for row in rows:
            self.write(dict(zip(LOG_COLUMNS, row, strict=True)))


def digest(path: Path) -> str:
    """Return the SHA-256 of an event log, in hexadecimal digits."""
    found = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(BLOCK):
            found.update(block)
    return found.hexdigest()


def digest_line(folder: Path) -> str:
    """Return the line that tells people the hash of the log of a run folder."""
    return f"event log {digest(folder / LOG_FILE)}"
