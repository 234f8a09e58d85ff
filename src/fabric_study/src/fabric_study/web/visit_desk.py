# SPDX-License-Identifier: BSD-3-Clause
"""The desk of a study: one visit at a time, every answer on the disk before it counts as saved.

    desk = VisitDesk(study, run_folder, cell, time.time, auto_start=True)
    desk.tick()                                   # ten times a second
    desk.task.on_state(state)                     # whatever the graph tells

Knows no ROS: `cell` is the graph. Times are s since 1970.
"""

import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fabric_study.codes import new_code
from fabric_study.instruments import LANGUAGES, Answer
from fabric_study.study_folder import Study
from fabric_study.visit import Visit, next_index, open_person, people_of
from fabric_study.web import views
from fabric_study.web.cell import Cell
from fabric_study.web.desk import Refused
from fabric_study.web.task_desk import TaskDesk

LANGUAGE_NOTE = "pages shown in "  # begins the note that says so, with a word of LANGUAGES
NOTES = 30  # that the console shows
OPEN = {"open": "running"}  # the words of the pages for the status of a visit


class VisitDesk:
    """What the pages may do and see; see web.desk."""

    def __init__(
        self,
        study: Study,
        run_folder: Path,
        cell: Cell,
        clock: Callable[[], float],
        auto_start: bool,
    ) -> None:
        """auto_start: a task begins as soon as the participant is ready.

        A visit that was the last to be opened and is not closed is taken up at once.
        """
        self._study = study
        self._cell = cell
        self._clock = clock
        self._visit: Visit | None = None
        self._greeted = ""  # whom ABPS takes the person for
        self.task = TaskDesk(run_folder, cell, clock, self._tasks_begun(run_folder.name))
        self.task.auto_start = auto_start
        self.language = LANGUAGES[0]
        self.participant_url = ""
        self.pages: Callable[[], int] = int  # participants' pages that are open
        self._read: tuple[tuple[int, str], dict[str, Any]] = ((-1, ""), {})
        self._orders = self._first_orders()
        self._take_up_newest()

    def _take_up_newest(self) -> None:
        person = open_person(self._study.store.records)
        if person:
            self._greeted = person  # ABPS is started with the same person
            self._attend(Visit(self._study, person), self._noted_language(person))

    def _tasks_begun(self, run: str) -> int:
        begun = [
            record.content["task_id"]
            for record in self._study.store.records
            if record.kind == "task_begun" and record.content["run"] == run
        ]
        return max(begun, default=0)

    def _first_orders(self) -> list[tuple[str, ...]]:
        protocol, seed = self._study.protocol, self._study.info.seed
        return [protocol.condition_order(index, seed) for index in range(protocol.people)]

    def _noted_language(self, person: str) -> str:
        words = [text for _, who, text in self._notes() if who == person]
        found = [word.removeprefix(LANGUAGE_NOTE) for word in words if _tells_language(word)]
        return found[-1] if found and found[-1] in LANGUAGES else LANGUAGES[0]

    def _notes(self) -> list[tuple[float, str, str]]:
        return [
            (record.stamp, record.visit, record.content["text"])
            for record in self._study.store.records
            if record.kind == "note"
        ]

    def _attend(self, visit: Visit, language: str) -> None:
        self._visit, self.language = visit, language
        self.task.attend(visit)

    @property
    def visit_is_open(self) -> bool:
        """Whether somebody is in the middle of a visit."""
        return self._visit is not None and self._visit.status == "open"

    def _open_visit(self) -> Visit:
        visit = self._visit
        if visit is None or visit.status != "open":
            raise Refused("No visit is open.")
        return visit

    def _at(self, step: str, in_break: bool = False) -> Visit:
        """The open visit, if it is at this step and not paused, unless that does not matter."""
        visit = self._open_visit()
        if visit.step is None or visit.step.id != step:
            raise Refused("The visit has moved on from this step.")
        if visit.paused and not in_break:
            raise Refused("The visit is paused.")
        return visit

    # --- what participants may do ---------------------------------------------------------------

    def answer(self, person: str, step: str, item: str, value: Answer) -> None:
        """Record an answer; it is on the disk when this returns.

        It may have been on its way for long: a break does not keep it out, another person does.
        """
        if person != self._open_visit().person:
            raise Refused("The answer is of another visit.")
        self._at(step, in_break=True).answer(self._clock(), item, value, step)

    def finish_step(self, step: str, accept_missing: bool) -> dict[str, list[str]]:
        """Go on, unless items lack an answer that was not asked for again; return those."""
        visit = self._at(step)
        missing = views.unanswered(visit.items(), visit.answers)
        if missing and not accept_missing:
            return {"missing": missing}
        visit.finish_step(self._clock(), step)
        self.task.new_step()
        return {"missing": []}

    def ready(self, step: str) -> None:
        """The participant is ready for the task of the step."""
        visit = self._at(step)
        if visit.step is None or visit.step.kind != "task":
            raise Refused("This step is no task.")
        self.task.ready()

    async def call(self) -> None:
        """Call the robot for help."""
        if self.task.phase() != "running":
            raise Refused("No task runs.")
        await self._cell.command("call")

    # --- what the experimenter may do -----------------------------------------------------------

    async def open_visit(self, index: int, language: str) -> dict[str, str]:
        """Open the visit of somebody new under a new code; return it."""
        self._check_free(language)
        if index < 0:
            raise Refused("The order must be 0 or more.", 400)
        code = new_code(people_of(self._study.store.records), random.SystemRandom())
        await self._greet(code, language)
        visit = Visit(self._study, code, self._clock(), index)
        visit.note(self._clock(), LANGUAGE_NOTE + language)
        self._attend(visit, language)
        return {"person": code}

    async def continue_visit(self, person: str, language: str) -> None:
        """Take up a visit that is not closed."""
        self._check_free(language)
        if people_of(self._study.store.records).get(person, (0, ""))[1] != "open":
            raise Refused(f"There is no open visit of '{person:.20}'.")
        if person != self._greeted:
            await self._greet(person, language)
        self._attend(Visit(self._study, person), language)

    async def _greet(self, person: str, language: str) -> None:
        """Tell ABPS whose type it is to find out, or to remember."""
        await self._cell.command("person", person)
        self._check_free(language)  # nobody else was faster meanwhile
        self._greeted = person

    def _check_free(self, language: str) -> None:
        if language not in LANGUAGES:
            raise Refused(f"The language must be one of {', '.join(LANGUAGES)}.", 400)
        if self.visit_is_open:
            raise Refused(f"The visit of {self._visit.person} is open; finish or abort it first.")

    def begin_task(self, step: str) -> None:
        """Begin the task of the step."""
        self._at(step)
        self.task.begin()

    def abort_task(self, reason: str) -> None:
        """End the running task; its step can be tried again."""
        self.task.abort(_given(reason))

    def set_auto_start(self, on: bool) -> None:
        """Say whether a task begins as soon as the participant is ready."""
        self.task.auto_start = on

    def pause(self) -> None:
        """Begin a break; a running task goes on to its end."""
        self._open_visit().pause(self._clock())

    def resume(self) -> None:
        """End a break."""
        self._open_visit().resume(self._clock())

    def abort_visit(self, reason: str) -> None:
        """End the visit for good."""
        visit = self._open_visit()
        reason = _given(reason)
        if self.task.running:
            self._cell.cancel_task()
        visit.close(self._clock(), "aborted", reason)
        self.task.attend(visit)

    async def note(self, text: str) -> None:
        """Keep a note, with its time, in the store and in the run."""
        text = _given(text)
        if self._visit is not None:
            self._visit.note(self._clock(), text)
        else:
            self._study.store.append(self._clock(), "", [("note", {"text": text})])
        await self._cell.command("note", text)

    async def stop(self) -> None:
        """Stop robot and belt."""
        await self._cell.command("stop")

    async def release(self) -> None:
        """Let robot and belt go on."""
        await self._cell.command("release")

    # --- what the pages see ---------------------------------------------------------------------

    def tick(self) -> None:
        """Let time pass; call it ten times a second."""
        self.task.tick()

    def participant(self) -> dict[str, Any]:
        """Return the sections of the participant's page."""
        visit = self._visit
        step = visit.step if visit else None
        asked = visit is not None and step is not None and step.kind == "instrument"
        doing = step is not None and step.kind == "task"
        return {
            "visit": self._about(visit),
            "step": views.step_view(visit) if visit else None,
            "questions": views.questions_view(visit, self._title(step)) if asked else None,
            "task": self.task.participant() if doing else None,
        }

    def _about(self, visit: Visit | None) -> dict[str, Any] | None:
        if visit is None:
            return None
        return {
            "person": visit.person,
            "status": OPEN.get(visit.status, visit.status),
            "paused": visit.paused and not self.task.running,
            "language": self.language,
        }

    def _title(self, step: Any) -> dict[str, str]:
        return dict(self._study.protocol.instruments[step.instrument].title)

    def console(self) -> dict[str, Any]:
        """Return the sections of the console."""
        visit = self._visit
        return {
            "study": self._about_study(),
            "visit": self._course(visit) if visit else None,
            "task": self.task.console(),
            "notes": self._from_records()["notes"],
            **self._cell.sections(),
        }

    def _course(self, visit: Visit) -> dict[str, Any]:
        instruments = self._study.protocol.instruments
        titles = {name: instrument.title["en"] for name, instrument in instruments.items()}
        return {
            **(self._about(visit) or {}),
            "paused": visit.paused,
            "index": visit.index,
            "conditions": self._study.protocol.condition_order(visit.index, self._study.info.seed),
            "steps": views.steps_view(visit, titles),
            "at": visit.position,
        }

    def _about_study(self) -> dict[str, Any]:
        info = self._study.info
        return {
            "title": dict(info.title),
            "protocol": info.protocol.name,
            "simulated": info.simulated,
            "orders": self._orders,
            "next_index": self._from_records()["next_index"],
            "open_visits": self._from_records()["open_visits"],
            "participant_url": self.participant_url,
            "pages": self.pages(),
            "auto_start": self.task.auto_start,
        }

    def _from_records(self) -> dict[str, Any]:
        """Return next order, visits that can be continued and notes; read when records came."""
        records, here = self._study.store.records, self._visit.person if self._visit else ""
        if self._read[0] != (len(records), here):
            told = {
                "next_index": next_index(records),
                "open_visits": [
                    self._waiting(Visit(self._study, person))
                    for person, (_, status) in people_of(records).items()
                    if status == "open" and person != here
                ],
                "notes": [
                    {"stamp": stamp, "text": text}
                    for stamp, who, text in self._notes()[-NOTES:][::-1]
                    if who in ("", here) and not _tells_language(text)
                ],
            }
            self._read = (len(records), here), told
        return self._read[1]

    def _waiting(self, visit: Visit) -> dict[str, Any]:
        return {
            "person": visit.person,
            "at": visit.position + 1,
            "of": len(visit.steps),
            "language": self._noted_language(visit.person),
        }


def _given(text: str) -> str:
    """The text without blanks around it. Raises Refused when nothing is left."""
    if not text.strip():
        raise Refused("Say it in a word or two.", 400)
    return text.strip()


def _tells_language(text: str) -> bool:
    return text.startswith(LANGUAGE_NOTE)
