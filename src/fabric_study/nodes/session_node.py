#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""ROS node of a session: runs the tasks one by one, tells how it went, and ends the run."""

import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import actionlib
import rospy

from fabric_msgs.msg import Heartbeat, ModelInfo, RunTaskAction, RunTaskGoal, RunTaskResult
from fabric_study.event_log import digest_line
from fabric_study.progress import progress_line
from fabric_study.readiness import Readiness
from fabric_study.results import read_results, read_timing, summary_text
from fabric_study.run_record import SHUT_DOWN, RunRecord
from fabric_study.tasks import load_definition, task_seed

PARAMETERS = ("tasks", "seed", "definition", "policy", "human")
PATIENCE = 60.0  # s, wall time for the graph to come up and for a row to be written
LOOK = 0.2  # s, wall time after which a waiting thread looks whether ROS has been shut down


class SessionFailed(Exception):
    """The session cannot go on; the text says why."""


class Session:
    """Asks for tasks and waits for their rows; nothing here decides anything."""

    def __init__(self, folder: Path, parameters: dict[str, Any], nodes: list[str]) -> None:
        self._folder, self._parameters = folder, parameters
        self._total = int(parameters["tasks"])
        load_definition(parameters["definition"])  # refused here, before anything starts
        self._record = RunRecord(folder, parameters)
        self._readiness = Readiness(nodes)
        self._heard = threading.Condition()
        self._client = actionlib.ActionClient("task/run", RunTaskAction)
        self._result: RunTaskResult | None = None
        rospy.Subscriber("model_info", ModelInfo, self._on_model)

    def run(self) -> int:
        """Run all tasks; return the exit code."""
        try:
            self._wait(lambda: not self._missing(), lambda: "; ".join(self._missing()))
            for task_id in range(1, self._total + 1):
                self._run_task(task_id)
        except SessionFailed as error:
            return self._end("failed", str(error))
        except rospy.ROSInterruptException:
            return self._end("interrupted", "stopped before the last task")
        return self._end("finished")

    def _run_task(self, task_id: int) -> None:
        seed = task_seed(int(self._parameters["seed"]), task_id)
        result = self._ask(
            RunTaskGoal(task_id=task_id, definition=self._parameters["definition"], seed=seed)
        )
        if result.aborted and result.reason == SHUT_DOWN:
            raise rospy.ROSInterruptException()
        if result.aborted:
            raise SessionFailed(f"task {task_id}: {result.reason}")
        self._wait(
            lambda: self._readiness.sent("recorder", "results") >= task_id,
            lambda: f"the recorder has not written task {task_id}",
        )
        self._record.task_done()
        say(progress_line(read_results(self._folder / "results.csv")[-1], self._total))

    def _ask(self, goal: RunTaskGoal) -> RunTaskResult:
        """Have a task run; return its result."""
        self._result = None
        handle = self._client.send_goal(goal, transition_cb=self._on_transition)
        with self._heard:
            while self._result is None and not rospy.is_shutdown():
                self._heard.wait(LOOK)
        del handle  # actionlib follows a goal as long as somebody holds its handle
        if self._result is None:
            raise rospy.ROSInterruptException()
        return self._result

    def _on_transition(self, handle: actionlib.ClientGoalHandle) -> None:
        if handle.get_comm_state() == actionlib.CommState.DONE:
            with self._heard:
                lost = RunTaskResult(aborted=True, reason="the task node has lost the task")
                self._result = handle.get_result() or lost
                self._heard.notify_all()

    def _missing(self) -> list[str]:
        missing = self._readiness.missing()
        client = self._client
        # wait_for_server needs a status message, and none comes while the clock stands still
        if not (client.pub_goal.get_num_connections() and client.result_sub.get_num_connections()):
            missing.append("nobody serves task/run")
        return missing

    def _wait(self, condition: Callable[[], bool], complaint: Callable[[], str]) -> None:
        """Wait on heartbeats until `condition` holds; listen only meanwhile, they are many."""
        subscriber = rospy.Subscriber("heartbeat", Heartbeat, self._on_heartbeat)
        deadline = threading.Event()
        timer = threading.Timer(PATIENCE, deadline.set)
        timer.daemon = True
        timer.start()
        with self._heard:
            while not condition() and not deadline.is_set() and not rospy.is_shutdown():
                self._heard.wait(LOOK)
            fulfilled = condition()
        timer.cancel()
        subscriber.unregister()
        if rospy.is_shutdown():
            raise rospy.ROSInterruptException()
        if not fulfilled:
            raise SessionFailed(f"waited {PATIENCE:.0f} s: {complaint()}")

    def _on_heartbeat(self, heartbeat: Heartbeat) -> None:
        with self._heard:
            self._readiness.heard(heartbeat)
            self._heard.notify_all()

    def _on_model(self, info: ModelInfo) -> None:
        with self._heard:
            self._record.model(info.name, info.hash)

    def _end(self, status: str, reason: str = "") -> int:
        with self._heard:
            self._record.end(status, reason)
        if reason:
            say(f"session {status}: {reason}")
        self._summarise()
        return 0 if status == "finished" else 1

    def _summarise(self) -> None:
        results, timing = self._folder / "results.csv", self._folder / "timing.csv"
        if results.exists() and read_results(results):
            text = summary_text(read_results(results), read_timing(timing))
            (self._folder / "summary.txt").write_text(text, encoding="utf-8")
            say("\n" + text)
            say(digest_line(self._folder))
        for path in sorted(self._folder.glob("*.bag")):
            say(f"bag      {path}")
        say(f"results  {results}")


def say(text: str) -> None:
    """Print for the person who started the run."""
    print(text, flush=True)


def main() -> int:
    """Run the session. Parameters: ~out_dir, ~nodes (to wait for) and those of PARAMETERS."""
    rospy.init_node("session")
    parameters = {name: rospy.get_param(f"~{name}") for name in PARAMETERS}
    try:
        folder = Path(rospy.get_param("~out_dir"))
        session = Session(folder, parameters, list(rospy.get_param("~nodes")))
    except (OSError, ValueError) as error:
        say(f"session: {error}")
        return 2
    return session.run()


if __name__ == "__main__":
    sys.exit(main())
