# SPDX-License-Identifier: BSD-3-Clause
"""What the run folders of a study know of its tasks: to catch up after a kill, and to compare."""

import csv
import io
from pathlib import Path

from fabric_study.event_journal import JOURNAL_FILE, Entry, read_journal
from fabric_study.meter import Value
from fabric_study.results import read_results
from fabric_study.study_folder import RUNS
from fabric_study.visit import Visit

RESULTS_FILE = "results.csv"


def journal_of(run: Path, task_id: int) -> list[Entry]:
    """Return the scored events of a task in the order in which they happened; none is fine.

    Raises JournalError naming file and line.
    """
    path = run / JOURNAL_FILE
    entries = read_journal(path).entries if path.exists() else []
    return [entry for entry in entries if entry["task"] == task_id]


def row_of(run: Path, task_id: int) -> dict[str, Value] | None:
    """Return the row of a task in the results.csv of its run, None when it is not whole.

    Raises ValueError naming file, line, column and value.
    """
    path = run / RESULTS_FILE
    if not path.exists() or not path.read_bytes().endswith(b"\n"):
        return None  # the row that a kill tore is the last one
    rows = [row for row in read_results(path) if row["task"] == task_id]
    return rows[-1] if rows else None


def cells_of(run: Path) -> dict[int, dict[str, str]]:
    """Return the rows of the results.csv of a run as they are written, by task."""
    path = run / RESULTS_FILE
    if not path.exists():
        return {}
    text = path.read_text(encoding="utf-8")
    whole = text[: text.rfind("\n") + 1]
    return {int(cells["task"]): cells for cells in csv.DictReader(io.StringIO(whole, newline=""))}


def catch_up(visit: Visit, t: float, folder: Path) -> bool:
    """Record what the run folder knows of the running task; say whether that task is done.

    For a console that begins anew: a task that is not done, and no longer runs, is to be aborted.
    """
    attempt = visit.attempt
    if attempt is None or not visit.task_running:
        return attempt is not None and attempt.row is not None
    run = folder / RUNS / attempt.run
    visit.task_events(t, journal_of(run, attempt.task_id))
    row = row_of(run, attempt.task_id)
    if row is None or not attempt.ended:
        return False
    visit.task_done(t, row)
    return True
