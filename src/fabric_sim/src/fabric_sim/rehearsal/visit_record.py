# SPDX-License-Identifier: BSD-3-Clause
"""Played visits written down as real ones are: through the classes of the console, step by step.

Time is simulated, too: every visit begins at nine o'clock on a day of its own, from the first of
January 2000 on, so that nobody takes it for a visit that took place.
"""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator
from copy import deepcopy
from pathlib import Path

from tqdm import tqdm

from fabric_msgs.msg import TaskEvent
from fabric_sim.rehearsal.shift import PlayedTask
from fabric_sim.rehearsal.visit_play import PlayedStep, PlayedVisit
from fabric_study.event_journal import JOURNAL_FILE, EventJournal, entry_of
from fabric_study.protocol import Protocol
from fabric_study.results import ResultsWriter
from fabric_study.run_record import RunRecord
from fabric_study.stamps import to_seconds, to_stamp
from fabric_study.store import StoreError
from fabric_study.study_folder import Study, open_study
from fabric_study.visit import begin_visit

NINE = 946717200.0  # s since 1970: 2000-01-01, 09:00 UTC
DAY = 86400.0  # s
TO_READ = 45.0  # s for a text
TO_ANSWER = 4.0  # s for an item
OWNER = "rehearsal"


def write_study(folder: Path, protocol: Protocol, seed: int, visits: Iterable[PlayedVisit]) -> None:
    """Write a study of simulated visits. Raises StoreError when the folder holds something."""
    rng = random.Random(f"{seed}/rehearsal/codes")
    with open_study(folder, protocol, seed, simulated=True, owner=OWNER) as study:
        if study.store.records:
            raise StoreError(f"{folder}: holds visits already")
        for played in tqdm(visits, desc="writing", leave=False, unit="visit"):
            VisitRecorder(study, played, rng).write()


class VisitRecorder:
    """Writes one visit: the store, and the run folder of its tasks."""

    def __init__(self, study: Study, played: PlayedVisit, rng: random.Random) -> None:
        self._played = played
        self._t = NINE + DAY * played.index
        self._visit = begin_visit(study, self._t, rng)
        self._run = study.new_run()
        self._events = 0  # of the run so far

    def write(self) -> None:
        """Write every step. Raises VisitError when it is not the one that the protocol has."""
        record = RunRecord(self._run, {"human": self._played.person.name, "visit": OWNER})
        results = ResultsWriter(self._run / "results.csv")
        with EventJournal(self._run / JOURNAL_FILE) as journal:
            for played in self._played.steps:
                self._write_step(played, journal)
                if played.task is not None:
                    results.write(played.task.row)
                    record.task_done()
        results.close()
        record.end("finished")

    def _write_step(self, played: PlayedStep, journal: EventJournal) -> None:
        if played.task is not None:
            self._write_task(played.task, journal)
        elif played.answers is not None:
            for item in self._visit.items():
                self._t += TO_ANSWER
                if played.answers[item.id] is not None:
                    self._visit.answer(self._t, item.id, played.answers[item.id])
        else:
            self._t += TO_READ
        self._visit.finish_step(self._t, played.step.id)

    def _write_task(self, task: PlayedTask, journal: EventJournal) -> None:
        row = task.row
        self._visit.task_begun(self._t, self._run.name, row["task"], row["seed"])
        entries = []
        for event in self._of_the_run(task):
            journal.append(event)
            entries.append(entry_of(event))
        self._t = entries[-1]["stamp"]
        self._visit.task_events(self._t, entries)
        self._visit.task_done(self._t, row)

    def _of_the_run(self, task: PlayedTask) -> Iterator[TaskEvent]:
        """The events of a task with the numbers of this run and by the clock of the visit."""
        late = self._t - to_seconds(task.events[0])
        for event in task.events:
            self._events += 1
            own = deepcopy(event)
            own.sequence, own.task_id = self._events, task.row["task"]
            own.header.stamp = to_stamp(to_seconds(event) + late)
            yield own
