#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""ROS node of the console: the pages of a study, between people and the graph."""

import asyncio
import hashlib
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import actionlib
import rosgraph
import rospkg
import rospy
from tornado.ioloop import PeriodicCallback

from fabric_msgs.msg import (
    Decision,
    Heartbeat,
    ModelInfo,
    PolicyChoice,
    RobotActionState,
    RunTaskAction,
    RunTaskGoal,
    RunTaskResult,
    SafetyState,
    TaskEvent,
    TaskState,
    TypeBelief,
)
from fabric_msgs.srv import AddNote, Command, ResetTypes, Stop
from fabric_study.protocol import load_protocol
from fabric_study.run_record import RunRecord
from fabric_study.shipped import load_path
from fabric_study.strict_yaml import read
from fabric_study.study_folder import STUDY_FILE, Study, open_study, reopen_study
from fabric_study.web.access import Role, is_loopback, kept_keys
from fabric_study.web.cell import TaskGoal
from fabric_study.web.desk import Refused
from fabric_study.web.news import News
from fabric_study.web.server import PageServer
from fabric_study.web.visit_desk import VisitDesk

PARAMETERS = ("protocol", "seed", "simulated", "address", "port", "auto_start", "record", "nodes")
DEFAULT_PROTOCOL = "experiment-1"
TICK_MS = 100
ANSWER = 10.0  # s of wall time that a service may take
LOOK = 2.0  # s of wall time between looks whether the robot can be called
SERVICES: dict[str, tuple[str, Any, bool]] = {  # command: service, class, whether it takes the text
    "stop": ("safety/stop", Stop, True),
    "release": ("safety/release", Command, False),
    "call": ("study/call", Command, False),
    "note": ("study/note", AddNote, True),
    "person": ("abps/reset", ResetTypes, False),
}


class RosCell:
    """The graph behind the desk: what comes in the threads of rospy is done on the IOLoop."""

    def __init__(self, loop: asyncio.AbstractEventLoop, nodes: list[str]) -> None:
        self._loop = loop
        self._news = News(nodes)
        self._newest: dict[str, tuple[float, Any]] = {}  # what comes often, by topic or node
        self._callable = False
        self._client = actionlib.ActionClient("task/run", RunTaskAction)
        self._handle: actionlib.ClientGoalHandle | None = None
        self._desk: VisitDesk | None = None

    def listen(self, desk: VisitDesk, record: RunRecord) -> None:
        """Begin to hear from the graph."""
        self._desk = desk
        news = self._news
        for topic, kind, take in (
            ("task/state", TaskState, desk.task.on_state),
            ("task/event", TaskEvent, lambda _: desk.task.on_event()),
            ("decision", Decision, news.on_decision),
            ("model_info", ModelInfo, lambda info: self._on_model(info, record)),
            ("abps/policy", PolicyChoice, news.on_choice),
            ("abps/type_belief", TypeBelief, news.on_types),
        ):
            rospy.Subscriber(topic, kind, self._handed_over(take))
        for topic, kind in (("safety/state", SafetyState), ("robot/state", RobotActionState)):
            rospy.Subscriber(topic, kind, self._keep, callback_args=topic, queue_size=1)
        rospy.Subscriber("heartbeat", Heartbeat, lambda beat: self._keep(beat, beat.node))
        threading.Thread(target=self._look_for_call, daemon=True).start()

    def _handed_over(self, take: Callable[[Any], None]) -> Callable[[Any], None]:
        return lambda message: self._later(take, message)

    def _later(self, function: Callable[..., None], *values: Any) -> None:
        try:
            self._loop.call_soon_threadsafe(function, *values)
        except RuntimeError:  # the loop is closed: the node is shutting down
            return

    def _keep(self, message: Any, name: str) -> None:
        self._newest[name] = time.monotonic(), message

    def _on_model(self, info: ModelInfo, record: RunRecord) -> None:
        self._news.on_model(info)
        record.model(info.name, info.hash)

    def _look_for_call(self) -> None:
        """The service may come and go with the nodes that offer it."""
        name, master = rospy.resolve_name("study/call"), rosgraph.Master(rospy.get_name())
        closing = threading.Event()
        rospy.on_shutdown(closing.set)
        while not closing.is_set():
            try:
                self._callable = bool(master.lookupService(name))
            except (OSError, rosgraph.MasterException):
                self._callable = False
            closing.wait(LOOK)

    def read(self) -> None:
        """Take in what has come since the last time, the newest of each."""
        newest, self._newest = self._newest, {}
        for t, message in list(newest.values()):
            if isinstance(message, Heartbeat):
                self._news.on_heartbeat(t, message)
            elif isinstance(message, SafetyState):
                self._news.on_safety(t, message)
            else:
                self._news.on_robot(message)

    # --- what the desk asks ---------------------------------------------------------------------

    def missing(self) -> list[str]:
        """See web.cell."""
        missing, client = self._news.missing(time.monotonic()), self._client
        # wait_for_server needs a status message, and none comes while the clock stands still
        if not (client.pub_goal.get_num_connections() and client.result_sub.get_num_connections()):
            missing.append("nobody serves task/run")
        return missing

    def run_task(self, goal: TaskGoal) -> None:
        """See web.cell."""
        self._news.new_task()
        message = RunTaskGoal(**vars(goal))

        def on_transition(handle: actionlib.ClientGoalHandle) -> None:
            if handle.get_comm_state() == actionlib.CommState.DONE:
                self._later(self._on_result, goal.task_id, handle.get_result())

        self._handle = self._client.send_goal(message, transition_cb=on_transition)

    def _on_result(self, task_id: int, result: RunTaskResult | None) -> None:
        assert self._desk is not None
        if result is None:
            self._desk.task.on_refused(task_id, "the task node has lost the task")
        elif result.aborted:
            self._desk.task.on_refused(task_id, result.reason)

    def cancel_task(self) -> None:
        """See web.cell. All goals: one may be of a console before this one."""
        self._client.cancel_all_goals()

    def can_call(self) -> bool:
        """See web.cell."""
        return self._callable

    def sections(self) -> dict[str, Any]:
        """See web.cell."""
        return self._news.sections(time.monotonic())

    async def command(self, name: str, text: str = "") -> None:
        """See web.cell."""
        service, kind, takes_text = SERVICES[name]
        if name == "person":
            rospy.set_param("abps/person", text)
        words = (text or "stopped at the console",) if takes_text else ()
        answer = self._loop.create_future()

        def ask() -> None:
            try:
                response = rospy.ServiceProxy(service, kind)(*words)
                reason = "" if response.accepted else f"{service} refuses: {response.reason}."
            except (rospy.ServiceException, rospy.ROSException) as error:
                reason = f"{service} does not answer: {error}."
            self._later(lambda: answer.done() or answer.set_result(reason))

        # a thread that nobody waits for at the end, whatever the service does
        threading.Thread(target=ask, daemon=True).start()
        try:
            reason = await asyncio.wait_for(answer, ANSWER)
        except TimeoutError:
            reason = f"{service} has not answered for {ANSWER:.0f} s."
        if reason:
            raise Refused(reason)


def study_of(folder: Path, parameters: dict[str, Any]) -> Study:
    """The study in a folder, begun when there is none. Raises ValueError when it is another."""
    name, simulated = str(parameters["protocol"]), bool(parameters["simulated"])
    if not name and (folder / STUDY_FILE).exists():
        study = reopen_study(folder)
        if study.info.simulated != simulated:
            study.close()
            kind = "simulated" if study.info.simulated else "real"
            raise ValueError(f"{folder} holds a study with a {kind} cell; this is the other kind")
        check_definitions(study)
        return study
    if name.endswith(".yaml"):
        name = str(Path(rospy.get_param("~start_dir")) / name)
    return open_study(
        folder, load_protocol(name or DEFAULT_PROTOCOL), int(parameters["seed"]), simulated
    )


def check_definitions(study: Study) -> None:
    """Raise ValueError unless the tasks would still be those that the study began with."""
    for name, content in study.protocol.content["definitions"].items():
        if read(load_path("tasks", name)).content != content:
            study.close()
            raise ValueError(f"{study.folder}: task definition {name} has changed since it began")


async def serve(study: Study, run_folder: Path, parameters: dict[str, Any]) -> None:
    """Serve until ROS shuts down. Raises OSError when address or port cannot be had."""
    loop, closing = asyncio.get_running_loop(), asyncio.Event()
    cell = RosCell(loop, list(parameters["nodes"]))
    desk = VisitDesk(study, run_folder, cell, time.time, bool(parameters["auto_start"]))
    keys = hashlib.sha256(str(study.folder).encode()).hexdigest()[:16]
    home = Path(rospkg.get_ros_home()) / "fabric" / "console"
    server = PageServer(desk, kept_keys(home / f"{keys}.json"))
    server.listen(str(parameters["address"]), int(parameters["port"]))
    desk.participant_url = server.url(Role.PARTICIPANT)
    desk.pages = lambda: server.live.count(Role.PARTICIPANT)
    record = RunRecord(run_folder, parameters)
    cell.listen(desk, record)

    def tick() -> None:
        cell.read()
        desk.tick()

    timer = PeriodicCallback(tick, TICK_MS)
    timer.start()
    announce(server, str(parameters["address"]))
    rospy.on_shutdown(lambda: loop.call_soon_threadsafe(closing.set))
    await closing.wait()
    timer.stop()
    await server.close()
    record.end("interrupted" if desk.visit_is_open else "finished")


def announce(server: PageServer, address: str) -> None:
    """Say where the pages are; on the terminal only, parameters of ROS are everybody's."""
    print(f"experimenter's console: {server.url(Role.EXPERIMENTER)}", flush=True)
    print(f"participant's page:     {server.url(Role.PARTICIPANT)}", flush=True)
    if not is_loopback(address):
        print("the pages can be reached from other machines, unencrypted", flush=True)


def main() -> int:
    """Run until Ctrl-C (0) or refuse what cannot be meant (2).

    Parameters: ~out_dir (runs/K of the study), ~start_dir and those of PARAMETERS.
    """
    rospy.init_node("console")
    try:
        parameters = {name: rospy.get_param(f"~{name}") for name in PARAMETERS}
        run_folder = Path(rospy.get_param("~out_dir"))
        with study_of(run_folder.parents[1], parameters) as study:
            asyncio.run(serve(study, run_folder, parameters))
    except KeyError as error:
        rospy.logfatal("console: parameter %s is missing", error.args[0])
        return 2
    except (OSError, ValueError) as error:
        rospy.logfatal("console: %s", error)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
