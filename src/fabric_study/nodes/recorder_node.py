#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""ROS node of the record: of each task a closed bag, a row of results.csv, lines of events.csv."""

import os
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import rosbag
import roslib.message
import rospy

from fabric_msgs.msg import (
    Decision,
    GroundTruth,
    ModelInfo,
    Observation,
    PolicyChoice,
    TaskEvent,
    TaskState,
    TypeBelief,
)
from fabric_msgs.traffic import Traffic
from fabric_study.event_log import LOG_FILE, EventLogWriter
from fabric_study.meter import TaskMeter, policy_name
from fabric_study.results import ResultsWriter, TimingWriter

WHOLE_PICTURES = 2**22  # bytes to read at once, so that a picture comes in one piece
PATIENCE = 10.0  # s, wall time to wait for the last messages of a task that has ended
ENDED = (TaskState.SUCCEEDED, TaskState.FAILED, TaskState.ABORTED)
COUNTED = (
    ("observation", Observation, TaskMeter.on_observation),
    ("decision", Decision, TaskMeter.on_decision),
    ("task/event", TaskEvent, TaskMeter.on_event),
    ("truth", GroundTruth, TaskMeter.on_truth),
)


class BagFile:
    """The bag of one task: `NAME.bag.active` until it is closed, then `NAME.bag`."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._active = path.with_name(path.name + ".active")
        self._bag = rosbag.Bag(str(self._active), "w")

    def write(self, topic: str, message: Any) -> None:
        """Append a message, stamped now."""
        self._bag.write(topic, message, rospy.Time.now())

    def write_raw(self, topic: str, message: rospy.AnyMsg) -> None:
        """Append a message of a type found out from its connection."""
        header = message._connection_header
        cls = roslib.message.get_message_class(header["type"])
        content = (header["type"], message._buff, header["md5sum"], cls)
        self._bag.write(topic, content, rospy.Time.now(), raw=True)

    def close(self) -> None:
        """Write the index and give the bag its final name."""
        self._bag.close()
        os.replace(self._active, self._path)


class RecorderNode:
    """Opens on SHOWING_RULES, closes when everything that belongs to the ended task is there."""

    def __init__(self, folder: Path, record: bool, human: str, policy: str) -> None:
        self._folder, self._record = folder, record
        self._human, self._policy = human, policy
        self._results = ResultsWriter(folder / "results.csv")
        self._timing = TimingWriter(folder / "timing.csv")
        self._log = EventLogWriter(folder / LOG_FILE)
        self._asked = ""  # policy of the task
        self._meter: TaskMeter | None = None
        self._bag: BagFile | None = None
        self._ended: TaskState | None = None
        self._guard: threading.Timer | None = None
        self._policy_choice: PolicyChoice | None = None  # it comes before the state of its task
        self._models: dict[str, ModelInfo] = {}
        self._latched: dict[tuple[str, str], Callable[[BagFile], None]] = {}  # by topic and node
        self._traffic = Traffic("recorder")
        self._traffic.declare_sent("results")
        rospy.on_shutdown(self._traffic.serialised(self._stop))
        self._listen()

    def _listen(self) -> None:
        for topic, message_class, take in COUNTED:
            self._traffic.subscribe(topic, message_class, self._counted(topic, take))
        self._traffic.subscribe("task/state", TaskState, self._on_state)
        self._traffic.subscribe("abps/policy", PolicyChoice, self._on_policy)
        locked = self._traffic.serialised
        rospy.Subscriber("model_info", ModelInfo, locked(self._on_model))
        rospy.Subscriber("abps/type_belief", TypeBelief, locked(self._on_type_belief))
        for topic in _topics() if self._record else ():
            rospy.Subscriber(
                topic,
                rospy.AnyMsg,
                locked(self._other(topic)),
                tcp_nodelay=True,
                buff_size=WHOLE_PICTURES,
            )

    def _counted(self, topic: str, take: Callable[[TaskMeter, Any], None]) -> Callable[..., None]:
        def callback(message: Any) -> None:
            self._write(topic, message)
            if self._meter is not None:
                take(self._meter, message)
                self._finish_if_complete()

        return callback

    def _other(self, topic: str) -> Callable[[rospy.AnyMsg], None]:
        def callback(message: rospy.AnyMsg) -> None:
            header = message._connection_header
            if header.get("latching") == "1":
                source = (topic, header.get("callerid", ""))
                self._latched[source] = lambda bag: bag.write_raw(topic, message)
            if self._bag is not None:
                self._bag.write_raw(topic, message)

        return callback

    def _on_state(self, state: TaskState) -> None:
        if state.status == TaskState.SHOWING_RULES:
            self._open(state)
        self._write("task/state", state)
        if self._meter is None:
            return
        self._meter.on_state(state)
        if state.status in ENDED:
            self._ended = state
            self._guard = threading.Timer(PATIENCE, self._traffic.serialised(self._give_up))
            self._guard.daemon = True
            self._guard.start()
            self._finish_if_complete()

    def _on_policy(self, choice: PolicyChoice) -> None:
        self._keep("abps/policy", choice)
        self._policy_choice = choice
        if self._meter is not None:
            self._meter.on_policy(choice)

    def _on_model(self, info: ModelInfo) -> None:
        self._keep("model_info", info)
        self._models[info.hash] = info
        if self._meter is not None:
            self._meter.on_model(info)
            self._finish_if_complete()

    def _on_type_belief(self, belief: TypeBelief) -> None:
        self._keep("abps/type_belief", belief)
        if self._meter is not None:
            self._meter.on_type_belief(belief)
            self._finish_if_complete()

    def _keep(self, topic: str, message: Any) -> None:
        """Write a latched message, now and at the start of every later bag."""
        self._latched[topic, ""] = lambda bag: bag.write(topic, message)
        self._write(topic, message)

    def _write(self, topic: str, message: Any) -> None:
        if self._bag is not None:
            self._bag.write(topic, message)

    def _open(self, state: TaskState) -> None:
        if self._ended is not None:
            self._give_up()
        self._close_bag()
        self._asked = policy_name(state.policy or self._policy)
        self._meter = TaskMeter(state, self._human, self._asked)
        for info in self._models.values():
            self._meter.on_model(info)
        if self._policy_choice is not None:
            self._meter.on_policy(self._policy_choice)
        if self._record:
            self._bag = BagFile(self._folder / f"task_{state.task_id:03d}.bag")
            for write in self._latched.values():
                write(self._bag)

    def _finish_if_complete(self) -> None:
        if self._ended is not None and self._meter is not None and self._meter.complete():
            self._finish()

    def _give_up(self) -> None:
        if self._ended is not None:
            rospy.logwarn(f"recorder: task {self._ended.task_id} is recorded incomplete")
            self._finish()

    def _finish(self) -> None:
        """Write the row, close the bag, say so in the heartbeat."""
        assert self._meter is not None
        if self._guard is not None:
            self._guard.cancel()
        self._results.write(self._meter.row())
        self._log.write_task(self._meter.log())
        self._timing.write_decisions(self._asked, self._meter.decisions())
        self._meter = self._ended = self._guard = None
        self._close_bag()
        self._traffic.sent("results")

    def _stop(self) -> None:
        """Close the bag; a task that begins during the shutdown opens no other."""
        self._record = False
        self._close_bag()

    def _close_bag(self) -> None:
        if self._bag is not None:
            bag, self._bag = self._bag, None
            bag.close()


def _topics() -> list[str]:
    """What is recorded besides what the meter reads; pictures when they are asked for."""
    pictures = rospy.get_param("~recorder/picture_topics") if rospy.get_param("~pictures") else []
    return rospy.get_param("~recorder/topics") + pictures


def main() -> None:
    """Run until shutdown; a folder that holds another run ends the node at once."""
    rospy.init_node("recorder")
    folder = Path(rospy.get_param("~out_dir"))
    folder.mkdir(parents=True, exist_ok=True)
    try:
        RecorderNode(
            folder,
            bool(rospy.get_param("~record")),
            str(rospy.get_param("~human")),
            str(rospy.get_param("~policy")),
        )
    except (OSError, ValueError) as error:
        sys.exit(f"recorder: {error}")
    rospy.spin()


if __name__ == "__main__":
    main()
