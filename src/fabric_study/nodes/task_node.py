#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""ROS node of the task manager: serves task/run and study/note, scores what the cell reports."""

import contextlib
import sys
import threading
from pathlib import Path
from typing import Any

import actionlib
import rospy
from std_msgs.msg import Header

from fabric_msgs.msg import (
    ContainerArray,
    ConveyorState,
    RunTaskAction,
    RunTaskFeedback,
    RunTaskGoal,
    RunTaskResult,
    TaskEvent,
    TaskState,
)
from fabric_msgs.srv import (
    AddNote,
    AddNoteResponse,
    Command,
    CommandResponse,
    SelectPolicy,
    SetConveyor,
    SetModel,
)
from fabric_msgs.traffic import Traffic
from fabric_study.event_journal import JOURNAL_FILE, EventJournal
from fabric_study.policies import ABPS, model_path
from fabric_study.results import TableWriter
from fabric_study.run_record import SHUT_DOWN
from fabric_study.task_manager import Counters, TaskManager
from fabric_study.tasks import TaskDefinition, load_definition

NOTE_COLUMNS = ("stamp", "task", "text")


class Refused(Exception):
    """Somebody whom the task needs does not answer or answers no."""


class TaskNode:
    """One task at a time; everything runs behind the lock of the traffic counter."""

    def __init__(self, policy: str, models: Path, out_dir: Path) -> None:
        """policy: of goals that name none. models: folder of the decision models.

        Raises FileExistsError when out_dir holds the journal of another run.
        """
        self._policy, self._models = policy, models
        self._notes = out_dir / "notes.csv"
        self._journal = EventJournal(out_dir / JOURNAL_FILE)
        self._unwritten = ""  # why the journal cannot go on
        self._counters = Counters()
        self._manager: TaskManager | None = None
        self._published = 0  # sequence of the last state sent
        self._reported = 0  # subtasks told as feedback
        self._newest = 0.0  # s, of all stamps so far
        self._problem = ""
        self._closing = False
        self._traffic = Traffic("task")
        self._changed = threading.Condition(self._traffic.lock)
        self._states = self._traffic.publisher("task/state", TaskState, latch=True)
        self._events = self._traffic.publisher("task/event", TaskEvent)
        self._server = actionlib.SimpleActionServer(
            "task/run", RunTaskAction, execute_cb=self._execute, auto_start=False
        )
        # In a thread of its own: actionlib holds its lock meanwhile, and feedback takes both.
        self._server.register_preempt_callback(lambda: threading.Thread(target=self._wake).start())
        rospy.on_shutdown(self._close)
        self._traffic.subscribe("conveyor/state", ConveyorState, self._on_conveyor)
        self._traffic.subscribe("cell/containers", ContainerArray, self._on_containers)
        self._traffic.subscribe("human/warning", Header, self._on_warning)
        rospy.Service("study/note", AddNote, self._traffic.serialised(self._on_note))
        rospy.Service("study/call", Command, self._traffic.serialised(self._on_call))
        self._server.start()

    def _execute(self, goal: RunTaskGoal) -> None:
        try:
            self._run(goal, load_definition(goal.definition))
        except (Refused, ValueError) as error:
            self._server.set_aborted(RunTaskResult(aborted=True, reason=str(error)), str(error))

    def _run(self, goal: RunTaskGoal, definition: TaskDefinition) -> None:
        policy = goal.policy or self._policy
        self._load_model(goal, policy, definition.scenario)
        with self._changed:
            self._problem, self._reported = self._unwritten, 0
            self._manager = TaskManager(definition, goal.task_id, goal.seed, self._counters, policy)
            self._manager.begin(self._newest)
            self._publish([])
            while not (self._manager.finished or self._problem or self._stopped()):
                self._changed.wait()
            if not self._closing:
                self._publish(self._manager.abort(self._newest))
            state, reason = self._manager.state, self._problem or self._reason()
            self._manager = None
        if self._closing:
            self._tell_end()
        else:
            self._finish(state, reason)

    def _tell_end(self) -> None:
        """Abort the goal while the node is shut down: no event, no row, and perhaps no topic."""
        with contextlib.suppress(rospy.ROSException):
            self._server.set_aborted(RunTaskResult(aborted=True, reason=SHUT_DOWN))

    def _finish(self, state: TaskState, reason: str) -> None:
        result = RunTaskResult(
            success=state.status == TaskState.SUCCEEDED,
            aborted=state.status == TaskState.ABORTED,
            reason=reason,
            score=state.score,
            duration=state.duration,
        )
        if not result.aborted:
            self._server.set_succeeded(result)
        elif self._server.is_preempt_requested():
            self._server.set_preempted(result, reason)
        else:
            self._server.set_aborted(result, reason)

    def _reason(self) -> str:
        return "stopped on request" if self._server.is_preempt_requested() else ""

    def _stopped(self) -> bool:
        return self._server.is_preempt_requested() or self._closing

    def _wake(self) -> None:
        with self._changed:
            self._changed.notify_all()

    def _close(self) -> None:
        """Let the waiting thread go; rospy calls this before it counts as shut down."""
        self._closing = True
        self._wake()

    def _load_model(self, goal: RunTaskGoal, policy: str, scenario: str) -> None:
        if policy == ABPS:
            path = call("abps/select", SelectPolicy, goal.task_id, goal.seed).path
        else:
            path = str(model_path(policy, scenario, self._models))
        call("planner/set_model", SetModel, path, False)

    def _on_conveyor(self, conveyor: ConveyorState) -> None:
        t = self._time_of(conveyor.header)
        if self._manager is not None:
            self._publish(self._manager.on_conveyor(t, conveyor))

    def _on_containers(self, containers: ContainerArray) -> None:
        t = self._time_of(containers.header)
        if self._manager is not None:
            self._publish(self._manager.on_containers(t, containers))

    def _on_warning(self, header: Header) -> None:
        t = self._time_of(header)
        if self._manager is not None:
            self._publish(self._manager.on_warning(t))

    def _on_call(self, _request: object) -> CommandResponse:
        if self._manager is None:
            return CommandResponse(accepted=False, reason="no task is running")
        objection = self._manager.objection_to_call
        if not objection:
            self._publish(self._manager.on_call(self._newest))
        return CommandResponse(accepted=not objection, reason=objection)

    def _time_of(self, header: Header) -> float:
        """The stamp (s), or the newest so far: real sensors do not deliver in order of time."""
        self._newest = max(self._newest, header.stamp.to_sec())
        return self._newest

    def _publish(self, events: list[TaskEvent]) -> None:
        """Command the belt, then send events, the state if it has changed, and feedback.

        The belt comes first: the state SHOWING_RULES lets the simulated cell go on. No event is
        sent before it is in the journal.
        """
        manager = self._manager
        assert manager is not None
        self._command_belt(manager.belt_command)
        for event in events:
            if self._written(event):
                self._events.publish(event)
        if self._counters.states != self._published:
            self._published = self._counters.states
            self._states.publish(manager.state)
        for result in manager.results[self._reported :]:
            self._server.publish_feedback(RunTaskFeedback(subtask=result))
        self._reported = len(manager.results)
        if manager.finished:
            self._changed.notify_all()

    def _written(self, event: TaskEvent) -> bool:
        """Write an event into the journal; when that fails no later one counts either."""
        if not self._unwritten:
            try:
                self._journal.append(event)
            except OSError as error:
                self._unwritten = self._problem = f"{JOURNAL_FILE} cannot be written: {error}"
                self._changed.notify_all()
        return not self._unwritten

    def _command_belt(self, command: tuple[float, bool] | None) -> None:
        if command is None:
            return
        try:
            call("conveyor/set_speed", SetConveyor, *command)
        except Refused as error:
            self._problem = str(error)
            self._changed.notify_all()

    def _on_note(self, request: Any) -> AddNoteResponse:
        task = self._manager.state.task_id if self._manager else 0
        try:
            writer = TableWriter(self._notes, NOTE_COLUMNS, append=True)
            values = (rospy.get_time(), task, request.text)
            writer.write(dict(zip(NOTE_COLUMNS, values, strict=True)))
            writer.close()
        except (OSError, ValueError) as error:
            return AddNoteResponse(False, str(error))
        return AddNoteResponse(True, f"noted in {self._notes}")


def call(name: str, service_class: Any, *values: Any) -> Any:
    """Call a service; raises Refused with its reason when it refuses or cannot be reached."""
    try:
        response = rospy.ServiceProxy(name, service_class)(*values)
    except rospy.ServiceException as error:
        raise Refused(f"service {name} failed: {error}") from error
    if not response.accepted:
        raise Refused(f"service {name} refused: {response.reason}")
    return response


def main() -> None:
    """Run until shutdown. Needs ~policy, ~models and ~out_dir."""
    rospy.init_node("task")
    out_dir = Path(rospy.get_param("~out_dir"))
    models = Path(rospy.get_param("~models"))
    if not models.is_dir():
        sys.exit(f"task: ~models is {str(models)!r}; there is no such folder")
    try:
        out_dir.mkdir(parents=True, exist_ok=True)
        TaskNode(str(rospy.get_param("~policy")), models, out_dir)
    except OSError as error:
        sys.exit(f"task: {error}")
    rospy.spin()


if __name__ == "__main__":
    main()
