#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Plays a bag's pictures to the perception nodes, one at a time, and keeps what they perceive."""

import json
import os
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import rosbag
import roslib.message
import rospy
from rosgraph_msgs.msg import Clock

from fabric_msgs.msg import Heartbeat
from fabric_perception.picture_replay import (
    KEPT,
    LATCHED,
    OUTPUTS,
    PICTURES,
    Books,
    Percepts,
    PictureReplayError,
    agreement,
    inputs_of,
    parse_names,
    report,
)

POLL = 0.2  # s
JUMP = 0.2  # s, of the clock, that the nodes must have seen before a picture comes
INFOS = {  # by the pictures they belong to
    "cell/camera/rgb/image_raw": "cell/camera/rgb/camera_info",
    "head/camera/image_raw": "head/camera/camera_info",
}
FRAMES = "/tf_static"
UNPLACED = "neither the bag's tf_static nor camera_files say where the camera is, even"
PARAMETERS = ("file", "out_dir", "start_dir", "names", "nodes", "patience")


class ReplayFailed(RuntimeError):
    """The replay cannot go on; the message is a sentence."""


class Player:
    """Sends recorded messages and waits after each until everybody has dealt with it."""

    def __init__(self, nodes: list[str], patience: float, kept: Callable[..., None]) -> None:
        self._patience = patience  # s of wall time, to appear and for each picture
        self._kept = kept
        self._books = Books(nodes)
        self._changed = threading.Condition()
        self._clocks: dict[str, float] = {}  # s, of the nodes, as last heard
        self._frames: dict[str, Any] = {}  # static ones so far: only the last message is latched
        self._received = {topic: 0 for topic in OUTPUTS}
        self._last = 0.0  # s, of what was played last
        self._clock = rospy.Publisher("/clock", Clock, queue_size=10)
        self._publishers: dict[str, rospy.Publisher] = {}
        rospy.Subscriber("heartbeat", Heartbeat, self._on_heartbeat, tcp_nodelay=True)

    def advertise(self, kinds: dict[str, str]) -> None:
        """Announce the topics that are played, {topic: type}."""
        for topic, kind in kinds.items():
            cls = roslib.message.get_message_class(kind)
            if cls is None:
                raise ReplayFailed(f"messages of type {kind} are not known here")
            latch = topic in LATCHED or topic.endswith("camera_info")
            self._publishers[topic] = rospy.Publisher(topic, cls, latch=latch, queue_size=100)

    def listen(self, kinds: dict[str, Any]) -> None:
        """Take what is perceived, {topic: class}."""
        for topic, cls in kinds.items():
            rospy.Subscriber(topic, cls, self._taking(topic), tcp_nodelay=True)

    def begin(self, t: rospy.Time) -> None:
        """Wait until the nodes are there, connected, and their clocks stand at t."""
        self._wait(lambda: self._at(t) and not self._loose(), "not ready", lambda: self._tick(t))
        self._last = t.to_sec()

    def play(self, topic: str, message: Any, t: rospy.Time) -> None:
        """Send one message of the time t, and wait until all its effects are there."""
        self._tick(t)
        if t.to_sec() - self._last > JUMP:
            self._wait(lambda: self._at(t), "clocks stand", lambda: self._tick(t))
        self._last = t.to_sec()
        if topic == FRAMES:
            self._frames.update({f.child_frame_id: f for f in message.transforms})
            message.transforms = list(self._frames.values())
        with self._changed:
            self._books.sent(topic)
        self._publishers[topic].publish(message)
        if self._books.listeners(topic):
            complaint = UNPLACED if topic in INFOS.values() else "still at work"
            self._wait(lambda: not self._books.behind(), complaint)

    def finish(self) -> None:
        """Wait until the last that was perceived is here."""
        self._wait(lambda: not self._under_way(), "not received")

    def _loose(self) -> list[str]:
        unheard = [
            topic
            for topic, publisher in self._publishers.items()
            if publisher.get_num_connections() < self._needed(topic)
        ]
        return self._books.missing() or unheard

    def _needed(self, topic: str) -> int:
        """How many connections a topic of ours must have before anything is played."""
        listeners = len(self._books.listeners(topic))
        told_once = {info: image for image, info in INFOS.items()}
        if topic in told_once:
            return len(self._books.listeners(told_once[topic]))
        return max(listeners, topic == FRAMES)

    def _under_way(self) -> list[str]:
        return [t for t, count in self._received.items() if count < self._books.published(t)]

    def _at(self, t: rospy.Time) -> bool:
        return all(abs(clock - t.to_sec()) < JUMP for clock in self._clocks.values())

    def _tick(self, t: rospy.Time) -> None:
        self._clock.publish(Clock(t))

    def _wait(
        self,
        reached: Callable[[], bool],
        complaint: str,
        meanwhile: Callable[[], None] = lambda: None,
    ) -> None:
        end = time.monotonic() + self._patience
        with self._changed:
            while not reached():
                if rospy.is_shutdown():
                    raise ReplayFailed("stopped")
                if time.monotonic() > end:
                    left = self._loose() or self._books.behind() or self._under_way()
                    raise ReplayFailed(f"{complaint} after {self._patience:g} s: {'; '.join(left)}")
                meanwhile()
                self._changed.wait(POLL)

    def _on_heartbeat(self, message: Heartbeat) -> None:
        with self._changed:
            self._books.heard(message)
            self._clocks[message.node] = message.header.stamp.to_sec()
            self._changed.notify_all()

    def _taking(self, topic: str) -> Callable[[Any], None]:
        def take(message: Any) -> None:
            with self._changed:
                self._received[topic] += 1
                self._kept(topic, message)
                self._changed.notify_all()

        return take


class Replay:
    """One bag through the nodes."""

    def __init__(self, parameters: dict[str, Any]) -> None:
        start = Path(parameters["start_dir"])
        self._path = start / parameters["file"]
        self._out = start / parameters["out_dir"]
        self._names = parse_names(parameters["names"])
        self._percepts, self._recorded = Percepts(), Percepts()
        self._written: rosbag.Bag | None = None
        self._writing = threading.Lock()
        nodes = parameters["nodes"].replace(",", " ").split()
        self._player = Player(nodes, float(parameters["patience"]), self._keep)

    def run(self) -> dict[str, Any]:
        """Play everything; the summary, which is written last."""
        self._out.mkdir(parents=True, exist_ok=True)
        (self._out / "perceive.json").unlink(missing_ok=True)
        began = time.monotonic()
        with rosbag.Bag(str(self._path)) as bag, self._new_bag() as self._written:
            summary = self._play(bag)
        summary["wall_s"] = time.monotonic() - began
        partial = self._out / "perceive.json.part"
        partial.write_text(json.dumps(summary, indent=1) + "\n", encoding="utf-8")
        os.replace(partial, self._out / "perceive.json")
        return summary

    def _play(self, bag: rosbag.Bag) -> dict[str, Any]:
        topics = bag.get_type_and_topic_info().topics
        inputs = inputs_of(topics, self._names)
        self._player.advertise({own: topics[t].msg_type for t, own in inputs.items()})
        self._player.listen({t: roslib.message.get_message_class(k) for t, k in KINDS.items()})
        first = last = None
        pictures = 0
        fixed = [topic for topic, own in inputs.items() if own == FRAMES]
        for topic, message, t in bag.read_messages():
            self._remember(topic, message, t)
            own = inputs.get(topic)
            if own in (None, FRAMES):
                continue
            if first is None:
                first = t
                self._player.begin(t)
                for _, frames, _ in bag.read_messages(topics=fixed):  # cameras need them at once
                    self._player.play(FRAMES, frames, t)
            self._player.play(own, message, t)
            pictures, last = pictures + (own in PICTURES), t
        self._player.finish()
        return self._summary(pictures, (last - first).to_sec())

    def _summary(self, pictures: int, duration: float) -> dict[str, Any]:
        summary = {"file": str(self._path), "pictures": pictures, "duration_s": duration}
        summary["replayed"] = self._percepts.summary()
        if self._recorded.counts:
            summary["recorded"] = self._recorded.summary()
            summary["agreement"] = agreement(self._percepts, self._recorded)
        return summary

    def _remember(self, topic: str, message: Any, t: rospy.Time) -> None:
        """What the recording says of itself, and what a replay of decisions will want."""
        for name in OUTPUTS:
            if topic.strip("/") == name or topic.endswith("/" + name):
                self._recorded.take(name, message)
        for name in KEPT:
            if topic.strip("/") == name or topic.endswith("/" + name):
                self._write(name, message, t)

    def _keep(self, topic: str, message: Any) -> None:
        self._percepts.take(topic, message)
        self._write(topic, message, rospy.Time.now())

    def _write(self, topic: str, message: Any, t: rospy.Time) -> None:
        assert self._written is not None  # open while the bag is played
        with self._writing:
            self._written.write(topic, message, t)

    def _new_bag(self) -> rosbag.Bag:
        return rosbag.Bag(str(self._out / "percepts.bag"), "w")


KINDS = {
    "human/head": "fabric_msgs/HeadState",
    "human/hand": "fabric_msgs/HandState",
    "human/activity": "fabric_msgs/HumanActivity",
    "human/warning": "std_msgs/Header",
    "cell/cubes": "fabric_msgs/CubeArray",
    "cell/containers": "fabric_msgs/ContainerArray",
    "observation": "fabric_msgs/Observation",
}


def load_parameters() -> dict[str, Any]:
    """Private parameters, all required; raises ReplayFailed naming one that is missing."""
    for name in PARAMETERS:
        if not rospy.has_param("~" + name):
            raise ReplayFailed(f"parameter {rospy.resolve_name('~' + name)} is missing")
    return {name: rospy.get_param("~" + name) for name in PARAMETERS}


def main() -> None:
    """Play one bag and print what was perceived."""
    rospy.init_node("perceive")
    try:
        summary = Replay(load_parameters()).run()
    except (PictureReplayError, ReplayFailed, OSError, rosbag.ROSBagException) as error:
        sys.exit(f"replay: {error}")
    print(report(summary), flush=True)


if __name__ == "__main__":
    main()
