# SPDX-License-Identifier: BSD-3-Clause
"""The task of a visit's step: begun in the graph, followed, recorded. No ROS, no threads.

What is scored reaches the store by the run's event journal, which holds each event before anybody
hears of it: a message that was missed, or a console that was away, loses nothing.
"""

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

from fabric_msgs.msg import TaskState
from fabric_study.policies import ON_CALL
from fabric_study.task_record import catch_up
from fabric_study.tasks import load_definition
from fabric_study.visit import Visit
from fabric_study.visit_state import Attempt
from fabric_study.web import views
from fabric_study.web.cell import Cell, TaskGoal
from fabric_study.web.desk import Refused

PATIENCE = 5.0  # s for the graph to end a task it was told to end
ROW_PATIENCE = 20.0  # s for the recorder to write a row
PHASES = {
    TaskState.WAITING: "waiting",
    TaskState.SHOWING_RULES: "rules",
    TaskState.RUNNING: "running",
    TaskState.SUCCEEDED: "ended",
    TaskState.FAILED: "ended",
    TaskState.ABORTED: "waiting",  # until the record says so
}
BUSY = (TaskState.SHOWING_RULES, TaskState.RUNNING)


class TaskDesk:
    """Runs the tasks of one visit after another; give it time with `tick`."""

    def __init__(
        self, run_folder: Path, cell: Cell, clock: Callable[[], float], last_id: int
    ) -> None:
        """run_folder: of this launch, `runs/K` of the study; clock: s since 1970; last_id: the
        highest id of the tasks that have begun in this run."""
        self._folder, self._run = run_folder.parents[1], run_folder.name
        self._cell = cell
        self._clock = clock
        self._visit: Visit | None = None
        self._state: TaskState | None = None
        self._last_id = last_id
        self._abort: tuple[float, str] | None = None  # deadline, reason
        self._ended: float | None = None  # when the task was seen to have ended
        self.said_ready = False
        self.stopped = False  # the last try came to nothing
        self.auto_start = False
        self.problem = ""

    def attend(self, visit: Visit | None) -> None:
        """Turn to a visit; what a try that was cut off has left is recorded."""
        self._visit = visit
        self.new_step()
        attempt = visit.attempt if visit else None
        if attempt is not None and visit.task_running:
            self._take_up(attempt)

    def new_step(self) -> None:
        """Forget what was said in the step before."""
        self.said_ready = self.stopped = False
        self.problem = ""
        self._abort = self._ended = None

    def _take_up(self, attempt: Attempt) -> None:
        if not self._catch_up() and attempt.run != self._run:
            self._note_abort("the run ended during the task")

    def _catch_up(self) -> bool:
        """Record what the run's files tell of the running task; whether it is done."""
        assert self._visit is not None
        try:
            done = catch_up(self._visit, self._clock(), self._folder)
        except (OSError, ValueError) as error:
            self.problem = f"The task cannot be recorded: {error}"
            return False
        if done:
            self.problem = ""
        return done

    @property
    def attempt(self) -> Attempt | None:
        """The running try, or the one that is done."""
        attempt = self._visit.attempt if self._visit else None
        return attempt if attempt is not None and attempt.aborted is None else None

    @property
    def running(self) -> bool:
        """Whether a task has begun and has neither been done nor aborted."""
        return self._visit is not None and self._visit.task_running

    def phase(self) -> str:
        """Return ready, waiting, rules, running or ended."""
        attempt = self.attempt
        if attempt is None:
            return "ready"
        if attempt.row is not None or attempt.ended:
            return "ended"
        return PHASES[self._state.status] if self._mine(attempt) else "waiting"

    def _mine(self, attempt: Attempt) -> bool:
        """Whether the newest state is of this try."""
        return (
            self._state is not None
            and attempt.run == self._run
            and self._state.task_id == attempt.task_id
        )

    def ready(self) -> None:
        """The participant is ready."""
        if self.attempt is not None:
            raise Refused("The task has begun.")
        self.said_ready = True

    def begin(self) -> None:
        """Begin the task. Raises Refused when something is missing."""
        visit = self._visit
        if visit is None or visit.step is None or visit.step.kind != "task":
            raise Refused("The visit is at no task.")
        if self.attempt is not None:
            raise Refused("The task has begun.")
        if visit.paused:
            raise Refused("The visit is paused.")
        missing = self._cell.missing()
        if self._state is not None and self._state.status in BUSY:
            missing.append("the task before has not ended")
        if missing:
            raise Refused(f"Not ready: {'; '.join(missing)}.")
        self._begin(visit)

    def _begin(self, visit: Visit) -> None:
        step, seed, task_id = visit.step, visit.task_seed, self._last_id + 1
        assert step is not None
        visit.task_begun(self._clock(), self._run, task_id, seed)
        self._last_id = task_id
        self.problem, self.stopped = "", False
        self._abort = self._ended = None
        self._cell.run_task(TaskGoal(task_id, step.definition, seed, step.policy))

    def abort(self, reason: str) -> None:
        """End the running task; it is recorded as aborted when the graph has ended it."""
        if not self.running:
            raise Refused("No task runs.")
        self._abort = self._clock() + PATIENCE, reason
        self._cell.cancel_task()

    def on_state(self, state: TaskState) -> None:
        """The task manager has told its state."""
        self._state = state
        attempt = self.attempt
        if attempt is not None and self._mine(attempt):
            self._catch_up()
            if state.status == TaskState.ABORTED:
                self._note_abort("the task was aborted")

    def on_event(self) -> None:
        """Something was scored; it is in the journal."""
        if self.running:
            self._catch_up()

    def on_refused(self, task_id: int, reason: str) -> None:
        """The graph would not begin a task, or has given it up."""
        attempt = self.attempt
        if self.running and attempt is not None and attempt.task_id == task_id:
            self._catch_up()
            self._note_abort(reason or "the task was refused")

    def _note_abort(self, reason: str) -> None:
        if self._visit is None or not self.running:
            return
        if self._abort is not None:
            reason = self._abort[1]
        self._visit.task_aborted(self._clock(), reason)
        self.new_step()
        self.stopped, self.problem = True, f"The last try was aborted: {reason}"

    def tick(self) -> None:
        """Begin when all is ready; look for the row of a task that has ended."""
        attempt = self.attempt
        if attempt is None:
            self._auto_begin()
        elif attempt.row is None:
            self._look(attempt)

    def _auto_begin(self) -> None:
        visit = self._visit
        if not (self.auto_start and self.said_ready and visit and not visit.paused):
            return
        try:
            self.begin()
        except Refused as error:
            self.problem = str(error)

    def _look(self, attempt: Attempt) -> None:
        now = self._clock()
        if self._abort is not None and now > self._abort[0]:
            self._note_abort("the task was aborted")
        elif attempt.ended:
            self._ended = self._ended or now
            if not self._catch_up() and now - self._ended > ROW_PATIENCE:
                self.problem = "The recorder has not written the row of this task."

    def participant(self) -> dict[str, Any]:
        """Return what the participant sees of the task: rules only while they are shown."""
        attempt, phase = self.attempt, self.phase()
        if phase == "ready" and self.said_ready:
            phase = "waiting"
        view: dict[str, Any] = {"phase": phase, "stopped": self.stopped}
        if attempt is None:
            return view
        state = self._state if self._mine(attempt) else None
        if phase == "rules" and state is not None:
            view["items"] = views.rules_view(state.rules)
        elif phase == "running" and state is not None:
            view["placements"] = views.placements_view(attempt.events)
            view["total"] = state.subtasks_total
            view["can_call"] = self._can_call(attempt)
        elif phase == "ended":
            view["placements"] = views.placements_view(attempt.events)
            view["result"] = views.result_view(attempt.events, attempt.row, state)
        return view

    def _can_call(self, attempt: Attempt) -> bool:
        """Whether this is a task in which the robot waits for a call."""
        return attempt.step.policy == ON_CALL and self._cell.can_call()

    def console(self) -> dict[str, Any] | None:
        """Return what the experimenter sees of the task; None when the step is no task."""
        visit = self._visit
        step = visit.step if visit else None
        if visit is None or step is None or step.kind != "task":
            return None
        attempt = self.attempt
        events = attempt.events if attempt else []
        place = (
            f", run {attempt.run}, task {attempt.task_id}, seed {attempt.seed}" if attempt else ""
        )
        condition = f"condition {step.condition}, " if step.condition else ""
        return {
            **self.participant(),
            "phase": self.phase(),
            "step": step.id,
            "name": f"{views.task_name(step)}: {Path(step.definition).stem}",
            "facts": f"{condition}policy {Path(step.policy).stem}{place}",
            "cubes": cube_order(step.definition, attempt.seed if attempt else visit.task_seed),
            "said_ready": self.said_ready,
            "problem": self.problem,
            "events": views.events_view(events),
            "score": sum(entry["score"] for entry in events),
        }


@lru_cache(maxsize=4)
def cube_order(definition: str, seed: int) -> tuple[str, ...]:
    """Return the colours of the cubes in the order in which they must come on the belt."""
    return tuple(views.COLOURS[colour] for colour in load_definition(definition).cube_colours(seed))
