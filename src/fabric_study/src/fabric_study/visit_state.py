# SPDX-License-Identifier: BSD-3-Clause
"""Where a visit stands, computed from its records; whatever cannot follow is refused.

The same rules read a store back: to resume a visit, to verify a study, to analyse it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from fabric_study.event_journal import FIELDS
from fabric_study.instruments import Answer, Item
from fabric_study.protocol import Protocol, Step

STATUSES = ("finished", "aborted")
ENDS = ("task_succeeded", "task_failed")  # last event of a task that gets a row
KEYS = {
    "visit_opened": {"protocol", "index", "conditions", "simulated"},
    "step_entered": {"step"},
    "answer": {"step", "condition", "number", "instrument", "item", "value"},
    "step_done": {"step"},
    "task_begun": {"step", "number", "definition", "policy", "run", "task_id", "seed"},
    "task_event": {"step", "run", *FIELDS},
    "task_done": {"step", "number", "row"},
    "task_aborted": {"step", "number", "reason"},
    "note": {"text"},
    "paused": set(),
    "resumed": set(),
    "visit_closed": {"status", "reason"},
}
Data = Mapping[str, Any]


class VisitError(ValueError):
    """Something that cannot happen now; the text names the step and what is wrong."""


@dataclass
class Attempt:
    """One try at the task of a step."""

    step: Step
    run: str  # folder name in runs/
    task_id: int  # within that run
    seed: int
    events: list[dict[str, Any]] = field(default_factory=list)  # entries of the journal, in order
    row: dict[str, Any] | None = None  # of results.csv, when the task is done
    aborted: str | None = None  # why, when it was

    @property
    def ended(self) -> bool:
        """Whether the event of its end has been recorded, success or failure."""
        return bool(self.events) and self.events[-1]["what"] in ENDS


class VisitState:
    """One visit. `apply` takes its records in order and raises VisitError for what cannot follow.

    After an error the state is undefined: replay the records into a new one.
    """

    def __init__(self, protocol: Protocol, seed: int, simulated: bool) -> None:
        self._protocol = protocol
        self._seed = seed
        self._simulated = simulated
        self._entered = False
        self._position = 0
        self.steps: tuple[Step, ...] = ()
        self.index: int | None = None  # None: not opened
        self.paused = False
        self.status = "open"  # or one of STATUSES
        self.answers: dict[str, dict[str, Answer]] = {}  # by step and item, the last ones given
        self.attempts: list[Attempt] = []

    @property
    def step(self) -> Step | None:
        """The step that is being done; None before the visit is opened and after it is closed."""
        if self.status != "open" or self._position >= len(self.steps):
            return None
        return self.steps[self._position]

    @property
    def entered(self) -> bool:
        """Whether the step has been entered."""
        return self._entered

    @property
    def position(self) -> int:
        """How many steps are done."""
        return self._position

    @property
    def attempt(self) -> Attempt | None:
        """The newest try at the task of the step, None before the first."""
        last = self.attempts[-1] if self.attempts else None
        return last if last and last.step is self.step else None

    @property
    def task_running(self) -> bool:
        """Whether a task has begun and has neither been done nor aborted."""
        attempt = self.attempt
        return attempt is not None and attempt.row is None and attempt.aborted is None

    @property
    def next_event(self) -> int | None:
        """Sequence that the next event of the running task must have; None: any."""
        attempt = self.attempt
        return attempt.events[-1]["sequence"] + 1 if attempt and attempt.events else None

    def items(self) -> Sequence[Item]:
        """The items of the step in the order of the file; none when it asks nothing."""
        step = self.step
        return self._protocol.instruments[step.instrument].items if step and step.instrument else ()

    def missing(self) -> tuple[str, ...]:
        """Ids of the items of the step that have no answer yet."""
        step = self.step
        given = self.answers.get(step.id, {}) if step else {}
        return tuple(item.id for item in self.items() if item.id not in given)

    def apply(self, kind: str, data: Data) -> None:
        """Take one record. Raises VisitError naming what cannot be."""
        if kind not in KEYS:
            raise VisitError(f"{kind!r} is no kind of record")
        if set(data) != KEYS[kind]:
            expected = ", ".join(sorted(KEYS[kind])) or "nothing"
            raise VisitError(f"{kind} holds {', '.join(sorted(data))}; must hold {expected}")
        if kind not in ("visit_opened", "note"):
            self._check_open(kind)
        getattr(self, f"_on_{kind}")(data)

    def _check_open(self, kind: str) -> None:
        if self.index is None:
            raise VisitError(f"{kind}: the visit has not been opened")
        if self.status != "open":
            raise VisitError(f"{kind}: the visit is {self.status}")

    def _on_visit_opened(self, data: Data) -> None:
        if self.index is not None:
            raise VisitError("the visit is opened twice")
        index = data["index"]
        if isinstance(index, bool) or not isinstance(index, int) or index < 0:
            raise VisitError(f"index is {index!r}")
        expected = {
            "protocol": self._protocol.hash,
            "conditions": list(self._protocol.condition_order(index, self._seed)),
            "simulated": self._simulated,
        }
        for key, value in expected.items():
            if data[key] != value:
                raise VisitError(f"visit_opened: {key} is {data[key]!r}, not {value!r}")
        self.index = index
        self.steps = self._protocol.visit_steps(index, self._seed)

    def _current(self, kind: str, data: Data, wanted: str = "") -> Step:
        step = self.step
        if step is None or data["step"] != step.id:
            there = step.id if step else "the end"
            raise VisitError(f"{kind}: step is {data['step']!r}, but the visit stands at {there}")
        if wanted and step.kind != wanted:
            raise VisitError(f"{kind}: step {step.id} is no {wanted}")
        if kind != "step_entered" and not self._entered:
            raise VisitError(f"{kind}: step {step.id} has not been entered")
        return step

    def _on_step_entered(self, data: Data) -> None:
        step = self._current("step_entered", data)
        if self._entered:
            raise VisitError(f"step {step.id} is entered twice")
        self._entered = True

    def _on_answer(self, data: Data) -> None:
        step = self._current("answer", data, "instrument")
        for key in ("condition", "number", "instrument"):
            if data[key] != getattr(step, key):
                raise VisitError(f"answer in {step.id}: {key} is {data[key]!r}")
        try:
            value = self._protocol.instruments[step.instrument].item(data["item"])
            answer = value.checked(data["value"])
        except ValueError as error:
            raise VisitError(f"answer in {step.id}: {error}") from error
        self.answers.setdefault(step.id, {})[data["item"]] = answer

    def _on_step_done(self, data: Data) -> None:
        step = self._current("step_done", data)
        if self.missing():
            raise VisitError(f"step {step.id} is done without {', '.join(self.missing())}")
        if step.kind == "task" and (self.attempt is None or self.attempt.row is None):
            raise VisitError(f"step {step.id} is done, but its task is not")
        self._position += 1
        self._entered = False

    def _on_task_begun(self, data: Data) -> None:
        step = self._current("task_begun", data, "task")
        if self.paused:
            raise VisitError(f"task of {step.id}: the visit is paused")
        attempt = self.attempt
        if attempt is not None and attempt.aborted is None:
            raise VisitError(f"task of {step.id} has begun before and was not aborted")
        for key in ("number", "definition", "policy"):
            if data[key] != getattr(step, key):
                raise VisitError(f"task of {step.id}: {key} is {data[key]!r}")
        if not isinstance(data["run"], str) or not data["run"].isdecimal():
            raise VisitError(f"task of {step.id}: run is {data['run']!r}; it must be a number")
        for key in ("task_id", "seed"):
            if isinstance(data[key], bool) or not isinstance(data[key], int) or data[key] < 0:
                raise VisitError(f"task of {step.id}: {key} is {data[key]!r}")
        self.attempts.append(Attempt(step, data["run"], data["task_id"], data["seed"]))

    def _running(self, kind: str, data: Data) -> Attempt:
        step = self._current(kind, data, "task")
        attempt = self.attempt
        if attempt is None or not self.task_running:
            raise VisitError(f"{kind}: no task runs in {step.id}")
        return attempt

    def _on_task_event(self, data: Data) -> None:
        attempt = self._running("task_event", data)
        place = f"event {data['sequence']} of run {data['run']}"
        if (data["run"], data["task"]) != (attempt.run, attempt.task_id):
            raise VisitError(f"{place}: is of task {data['task']}, not of {attempt.task_id}")
        if self.next_event not in (None, data["sequence"]):
            raise VisitError(f"{place}: {self.next_event} must come next")
        attempt.events.append({key: data[key] for key in data if key not in ("step", "run")})

    def _on_task_done(self, data: Data) -> None:
        attempt = self._running("task_done", data)
        step, row = attempt.step, data["row"]
        if not isinstance(row, dict) or not {"task", "seed"} <= set(row):
            raise VisitError(f"task of {step.id}: its row is none of results.csv")
        expected = {"task": attempt.task_id, "seed": attempt.seed}
        for key, value in expected.items():
            if row[key] != value:
                raise VisitError(f"task of {step.id}: {key} of its row is {row[key]}, not {value}")
        if data["number"] != step.number:
            raise VisitError(f"task of {step.id}: number is {data['number']!r}")
        if not attempt.ended:
            raise VisitError(f"task of {step.id}: its row comes before the event of its end")
        attempt.row = dict(row)

    def _on_task_aborted(self, data: Data) -> None:
        attempt = self._running("task_aborted", data)
        attempt.aborted = str(data["reason"])

    def _on_note(self, data: Data) -> None:
        if not isinstance(data["text"], str):
            raise VisitError(f"note: {data['text']!r} is no text")

    def _on_paused(self, data: Data) -> None:
        if self.paused:
            raise VisitError("the visit is paused twice")
        self.paused = True

    def _on_resumed(self, data: Data) -> None:
        if not self.paused:
            raise VisitError("the visit is resumed, but was not paused")
        self.paused = False

    def _on_visit_closed(self, data: Data) -> None:
        if data["status"] not in STATUSES:
            raise VisitError(f"status is {data['status']!r}; allowed are {', '.join(STATUSES)}")
        if data["status"] == "finished" and self._position < len(self.steps):
            raise VisitError(f"the visit is finished before step {self.steps[self._position].id}")
        if self.task_running:
            raise VisitError("the visit is closed while a task runs")
        self.status = data["status"]
