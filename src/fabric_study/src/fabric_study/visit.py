# SPDX-License-Identifier: BSD-3-Clause
"""A person's visit: every step, answer and event on the disk before the next; resumes by itself.

    with open_study(folder, load_protocol("experiment-1"), seed=101, simulated=False) as study:
        visit = begin_visit(study, t, random.SystemRandom())   # or Visit(study, "K7QF2M")
        while visit.step:
            if visit.step.kind == "instrument":
                for item in visit.items():
                    visit.answer(t, item.id, 4)
            elif visit.step.kind == "task":
                visit.task_begun(t, run="1", task_id=1)
                ...                                            # visit.task_event for each event
                visit.task_done(t, row)
            visit.finish_step(t)

Times are seconds since 1970 and never run by themselves. Repeating what is already recorded does
nothing, so a caller that was killed before it heard of its success may simply say it again.
"""

import random
from collections.abc import Mapping, Sequence
from typing import Any

from fabric_study.codes import CODE, new_code
from fabric_study.instruments import Answer, Item
from fabric_study.meter import COLUMNS
from fabric_study.protocol import Step
from fabric_study.store import Entry, Record
from fabric_study.study_folder import Study
from fabric_study.visit_state import Attempt, VisitError, VisitState


def people_of(records: Sequence[Record]) -> dict[str, tuple[int, str]]:
    """Return index and status (open, finished, aborted) by code, in the order of opening."""
    people: dict[str, tuple[int, str]] = {}
    for record in records:
        if record.kind == "visit_opened":
            people[record.visit] = (record.content["index"], "open")
        elif record.kind == "visit_closed" and record.visit in people:
            people[record.visit] = (people[record.visit][0], record.content["status"])
    return people


def open_person(records: Sequence[Record]) -> str:
    """Return the code of whoever came last, when that visit is not closed; else nothing."""
    newest = list(people_of(records).items())[-1:]
    return "".join(person for person, (_, status) in newest if status == "open")


def next_index(records: Sequence[Record]) -> int:
    """Return the least index, from 0, that no visit has but aborted ones: it keeps the balance."""
    taken = {index for index, status in people_of(records).values() if status != "aborted"}
    return next(index for index in range(len(taken) + 1) if index not in taken)


def begin_visit(study: Study, t: float, rng: random.Random) -> "Visit":
    """Open the visit of somebody new, under a new code (see `codes.new_code` for `rng`)."""
    records = study.store.records
    code = new_code(people_of(records), rng)
    return Visit(study, code, t, next_index(records))


class Visit:
    """One visit of a study, as far as the store knows it. Not for several threads."""

    def __init__(
        self, study: Study, person: str, t: float | None = None, index: int | None = None
    ) -> None:
        """Resume the visit of a person, or open it when `t` and `index` are given.

        Raises VisitError for a person who is not known, or whose visit has another index.
        """
        self._study = study
        self.person = person
        self._state = self._replayed()
        if self._state.index is None:
            if t is None or index is None:
                raise VisitError(f"nobody is called {person!r}")
            self._open(t, index)
        elif index not in (None, self._state.index):
            raise VisitError(f"{person} has index {self._state.index}, not {index}")

    def _replayed(self) -> VisitState:
        info = self._study.info
        state = VisitState(info.protocol, info.seed, info.simulated)
        for record in self._study.store.records:
            if record.visit == self.person:
                state.apply(record.kind, record.content)
        return state

    def _open(self, t: float, index: int) -> None:
        if not CODE.fullmatch(self.person):
            raise VisitError(f"{self.person!r} is no code of a person")
        for other, (held, status) in people_of(self._study.store.records).items():
            if held == index and status != "aborted":
                raise VisitError(f"index {index} is that of {other}")
        protocol, seed = self._study.protocol, self._study.info.seed
        opened = {
            "protocol": protocol.hash,
            "index": index,
            "conditions": list(protocol.condition_order(index, seed)),
            "simulated": self._study.info.simulated,
        }
        first = protocol.visit_steps(index, seed)[0].id
        self._record(t, ("visit_opened", opened), ("step_entered", {"step": first}))

    def _record(self, t: float, *entries: Entry) -> None:
        """Check entries against the state, then write all or none of them."""
        try:
            for kind, data in entries:
                self._state.apply(kind, data)
            self._study.store.append(t, self.person, entries)
        except BaseException:
            self._state = self._replayed()
            raise

    @property
    def index(self) -> int:
        """Place of the visit in the study, from 0; it decides the order of conditions."""
        assert self._state.index is not None
        return self._state.index

    @property
    def step(self) -> Step | None:
        """The step to do now; None when the visit is closed."""
        return self._state.step

    @property
    def steps(self) -> tuple[Step, ...]:
        """All steps of the visit."""
        return self._state.steps

    @property
    def position(self) -> int:
        """How many steps are done."""
        return self._state.position

    @property
    def paused(self) -> bool:
        """Whether the visit is paused; no task begins then."""
        return self._state.paused

    @property
    def status(self) -> str:
        """open, finished or aborted."""
        return self._state.status

    @property
    def attempt(self) -> Attempt | None:
        """The newest try at the task of the step: its events, its row; None before the first."""
        return self._state.attempt

    @property
    def task_running(self) -> bool:
        """Whether a task has begun and has neither been done nor aborted."""
        return self._state.task_running

    @property
    def answers(self) -> Mapping[str, Answer]:
        """The answers given in this step, by item."""
        return dict(self._state.answers.get(self.step.id, {})) if self.step else {}

    @property
    def task_seed(self) -> int:
        """The seed for the next try at the task of the step; another one after each abort."""
        step = self._step("task")
        tries = sum(attempt.step.id == step.id for attempt in self._state.attempts)
        name = f"{step.id}/{tries}" if tries else step.id
        return self._study.protocol.task_seed(self.index, self._study.info.seed, name)

    def items(self) -> tuple[Item, ...]:
        """Return the items of the step in the order in which this person sees them."""
        step = self.step
        if step is None or not step.instrument:
            return ()
        return self._study.protocol.instruments[step.instrument].order(f"{self.person}/{step.id}")

    def missing(self) -> tuple[str, ...]:
        """Return the ids of the items of the step without an answer, as this person sees them."""
        missing = self._state.missing()
        return tuple(item.id for item in self.items() if item.id in missing)

    def _step(self, kind: str = "", named: str | None = None) -> Step:
        step = self.step
        if step is None:
            raise VisitError(f"the visit of {self.person} is {self.status}")
        if named not in (None, step.id):
            raise VisitError(f"step {named!r} is not what {self.person} is doing, but {step.id}")
        if kind and step.kind != kind:
            raise VisitError(f"step {step.id} is no {kind}")
        return step

    def answer(self, t: float, item: str, value: Any, step: str | None = None) -> bool:
        """Record an answer, None for none; say whether it is news. The last one given counts.

        Raises VisitError when the item does not offer the value, or `step` is another than now.
        """
        now = self._step("instrument", step)
        try:
            value = self._study.protocol.instruments[now.instrument].item(item).checked(value)
        except ValueError as error:
            raise VisitError(f"{now.id}: {error}") from error
        given = self.answers
        if item in given and given[item] == value:
            return False
        self._record(t, ("answer", self._answer(now, item, value)))
        return True

    def _answer(self, step: Step, item: str, value: Answer) -> dict[str, Any]:
        return {
            "step": step.id,
            "condition": step.condition,
            "number": step.number,
            "instrument": step.instrument,
            "item": item,
            "value": value,
        }

    def finish_step(self, t: float, step: str | None = None) -> None:
        """Go on; what has no answer is recorded as missing. The last step closes the visit.

        Raises VisitError when the task of the step is not done, or `step` is another than now.
        """
        now = self._step(named=step)
        entries: list[Entry] = [
            ("answer", self._answer(now, item, None)) for item in self._state.missing()
        ]
        entries.append(("step_done", {"step": now.id}))
        if self.position + 1 < len(self.steps):
            entries.append(("step_entered", {"step": self.steps[self.position + 1].id}))
        else:
            entries.append(("visit_closed", {"status": "finished", "reason": ""}))
        self._record(t, *entries)

    def task_begun(self, t: float, run: str, task_id: int, seed: int | None = None) -> None:
        """Record that the task of the step begins, in which run of the recorder, as which task."""
        step = self._step("task")
        data = {
            "step": step.id,
            "number": step.number,
            "definition": step.definition,
            "policy": step.policy,
            "run": run,
            "task_id": task_id,
            "seed": self.task_seed if seed is None else seed,
        }
        self._record(t, ("task_begun", data))

    def task_event(self, t: float, entry: Mapping[str, Any]) -> bool:
        """Record a scored event of the running task, an entry of the run's event journal.

        Returns whether it is news. Raises VisitError when one before it is missing.
        """
        step, attempt = self._step("task"), self.attempt
        if attempt is not None and dict(entry) in attempt.events:
            return False
        run = attempt.run if attempt else ""
        self._record(t, ("task_event", {"step": step.id, "run": run, **entry}))
        return True

    def task_events(self, t: float, entries: Sequence[Mapping[str, Any]]) -> int:
        """Record what a journal knows of the running task and the store does not; return how much.

        `entries` may be the whole journal of the run.
        """
        step, attempt = self._step("task"), self.attempt
        if attempt is None or not self.task_running:
            return 0
        news = [dict(entry) for entry in entries if entry["task"] == attempt.task_id]
        head = {"step": step.id, "run": attempt.run}
        new: list[Entry] = [
            ("task_event", {**head, **entry}) for entry in news if entry not in attempt.events
        ]
        if new:
            self._record(t, *new)
        return len(new)

    def task_done(self, t: float, row: Mapping[str, Any]) -> bool:
        """Record the row of results.csv of the task; say whether it is news.

        Raises VisitError when no task runs, the row is of another, or its last event is missing.
        """
        step, attempt = self._step("task"), self.attempt
        if attempt is not None and attempt.row == dict(row):
            return False
        if tuple(row) != COLUMNS:
            raise VisitError(f"task of {step.id}: its row must have the columns of results.csv")
        self._record(t, ("task_done", {"step": step.id, "number": step.number, "row": dict(row)}))
        return True

    def task_aborted(self, t: float, reason: str) -> None:
        """Record that the running task came to nothing; its step can be tried again."""
        step = self._step("task")
        data = {"step": step.id, "number": step.number, "reason": reason}
        self._record(t, ("task_aborted", data))

    def note(self, t: float, text: str) -> None:
        """Record a note of the experimenter; also after the visit is closed."""
        self._record(t, ("note", {"text": text}))

    def pause(self, t: float) -> None:
        """Begin a break: no task begins until `resume`."""
        self._record(t, ("paused", {}))

    def resume(self, t: float) -> None:
        """End a break."""
        self._record(t, ("resumed", {}))

    def close(self, t: float, status: str, reason: str) -> None:
        """End the visit early (`aborted`); a visit whose steps are all done is closed already."""
        entries: list[Entry] = []
        step = self.step
        if self.task_running and step is not None:
            aborted = {"step": step.id, "number": step.number, "reason": reason}
            entries.append(("task_aborted", aborted))
        self._record(t, *entries, ("visit_closed", {"status": status, "reason": reason}))
