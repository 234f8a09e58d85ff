#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A task that is seen through cameras only, beside the truth that the pictures were drawn from."""

from __future__ import annotations

import shutil
import sys
import threading
import unittest
from typing import Any

import actionlib
import numpy as np
import rosgraph
import rospy
import rostest
from sensor_msgs.msg import CameraInfo

from fabric_msgs.msg import (
    ContainerArray,
    CubeArray,
    HeadState,
    Heartbeat,
    HumanActivity,
    Observation,
    RunTaskAction,
    RunTaskGoal,
    SimScene,
    TaskEvent,
)

DEADLINE = 200.0  # s, wall time for any one condition
NODES = {"cell", "cell_camera", "head_camera", "tracking", "gesture", "head", "observation"}
NODES |= {"decision", "motion", "task", "recorder"}
PICTURES = {  # by the camera_info of the same stamp, which is lighter to listen to
    "cell/camera/rgb/camera_info": "cell/camera/rgb/image_raw",
    "head/camera/camera_info": "head/camera/image_raw",
}
TOPICS = {
    **dict.fromkeys(PICTURES, CameraInfo),
    "sim/scene": SimScene,
    "cell/cubes": CubeArray,
    "cell/containers": ContainerArray,
    "human/activity": HumanActivity,
    "human/head": HeadState,
    "observation": Observation,
    "task/event": TaskEvent,
}
SEEING = {"/tracking", "/gesture", "/head", "/observation", "/decision", "/motion", "/task"}
HIDDEN = {"/truth", "/sim/scene"}  # what a real cell does not tell
PERIOD = 0.1  # s, between two pictures of a camera
PLACED = (TaskEvent.SUBTASK_SUCCEEDED, TaskEvent.SUBTASK_FAILED)
TRAY_AT = (0.470, 0.035)  # m, the person's tray of an inspection, cell.yaml
TRAY_HALF = (0.08, 0.10)  # m


class Film:
    """All that was said, and a way to wait for more."""

    def __init__(self) -> None:
        self.said: dict[str, list[Any]] = {topic: [] for topic in TOPICS}
        self.beats: dict[str, Heartbeat] = {}  # the newest of each node
        self._heard = threading.Condition()
        for topic, kind in TOPICS.items():
            rospy.Subscriber(topic, kind, self._take, callback_args=topic, tcp_nodelay=True)
        rospy.Subscriber("heartbeat", Heartbeat, self._beat, tcp_nodelay=True)

    def wait(self, condition) -> bool:
        """True as soon as the condition holds, False if it never does."""
        with self._heard:
            return self._heard.wait_for(condition, DEADLINE)

    def connected(self) -> bool:
        """Whether every counted topic reaches all who listen to it, us among them."""
        listeners = dict(rosgraph.Master("/rostest_camera").getSystemState()[1])
        sent = [entry for beat in self.beats.values() for entry in beat.sent]
        return all(
            entry.connections >= len(listeners.get(rospy.resolve_name(entry.topic), []))
            for entry in sent
        )

    def stamps(self, topic: str) -> list[int]:
        """Of all messages but those that were latched before time began, ns."""
        return [m.header.stamp.to_nsec() for m in self.said[topic] if m.header.stamp]

    def sent(self, topic: str) -> int:
        """How many messages of a topic all nodes say they have sent."""
        return sum(p.count for beat in self.beats.values() for p in beat.sent if p.topic == topic)

    def handled(self, node: str, topic: str) -> int:
        """How many messages of a topic a node says it has dealt with."""
        return sum(p.count for p in self.beats[node].handled if p.topic == topic)

    def _take(self, message: Any, topic: str) -> None:
        with self._heard:
            self.said[topic].append(message)
            self._heard.notify_all()

    def _beat(self, message: Heartbeat) -> None:
        with self._heard:
            self.beats[message.node] = message
            self._heard.notify_all()


def run_task() -> Any:
    """One task to its end; its result."""
    client = actionlib.SimpleActionClient("task/run", RunTaskAction)
    action = client.action_client
    connected = threading.Event()
    ends = (action.pub_goal, action.result_sub, action.feedback_sub)
    for _ in range(int(DEADLINE / 0.1)):  # wait_for_server needs a clock that runs
        if all(end.get_num_connections() for end in ends) or connected.wait(0.1):
            break
    client.send_goal(RunTaskGoal(task_id=1, definition="inspection", seed=111))
    assert client.wait_for_result(), "the task did not come to its end"
    return client.get_result()


def topics_heard_by(nodes: set[str]) -> set[str]:
    """Every topic that one of the nodes subscribes to, from the master's own books."""
    _, subscribers, _ = rosgraph.Master("/rostest_camera").getSystemState()
    return {topic for topic, names in subscribers if nodes.intersection(names)}


def in_tray(pose: Any) -> bool:
    """Whether a cube lies in the person's tray."""
    at, low = (pose.position.x, pose.position.y), pose.position.z < 0.05
    return low and all(abs(v - m) < h for v, m, h in zip(at, TRAY_AT, TRAY_HALF, strict=True))


class CameraLoop(unittest.TestCase):
    """One graph, all cases look at the same task."""

    @classmethod
    def setUpClass(cls) -> None:
        cls.film = Film()
        there = cls.film.wait(lambda: set(cls.film.beats) >= NODES)
        assert there, f"only {sorted(cls.film.beats)} are alive"
        assert cls.film.wait(cls.film.connected), "somebody is not heard here"
        cls.result = run_task()
        assert cls.film.wait(cls.complete), "not all that was sent has arrived"

    @classmethod
    def tearDownClass(cls) -> None:
        shutil.rmtree(rospy.get_param("~out_dir"))

    @classmethod
    def complete(cls) -> bool:
        """Whether the end was seen, and all that was sent was dealt with and has come here."""
        film = cls.film
        if not any(o.task_success or o.task_failure for o in film.said["observation"]):
            return False
        counted = [topic for topic in TOPICS if topic not in PICTURES]
        here = all(len(film.said[topic]) >= film.sent(topic) for topic in counted)
        shown = all(len(film.stamps(i)) >= film.sent(p) for i, p in PICTURES.items())
        return here and shown and not cls.lost()

    @classmethod
    def lost(cls) -> list[str]:
        """Pictures that were sent and not dealt with."""
        takers = {"cell/camera/rgb/image_raw": "tracking", "cell/camera/depth/image": "tracking"}
        takers["head/camera/image_raw"] = "head"
        sent, handled = cls.film.sent, cls.film.handled
        return [topic for topic, node in takers.items() if handled(node, topic) != sent(topic)]

    def said(self, topic: str) -> list[Any]:
        return self.film.said[topic]

    def test_the_task_comes_to_a_good_end(self) -> None:
        self.assertFalse(self.result.aborted, self.result.reason)
        self.assertTrue(self.result.success)

    def test_every_camera_sends_ten_pictures_a_second_from_beginning_to_end(self) -> None:
        for topic in PICTURES:
            stamps = self.film.stamps(topic)
            self.assertGreater(len(stamps) * PERIOD, self.result.duration - PERIOD, topic)
            gaps = np.diff(stamps) * 1e-9
            self.assertTrue(np.allclose(gaps, PERIOD), f"{topic}: {gaps.min()} to {gaps.max()} s")

    def test_every_picture_is_answered_with_percepts_of_its_stamp(self) -> None:
        taken = self.film.stamps("cell/camera/rgb/camera_info")
        for topic in ("cell/cubes", "human/activity", "human/head"):
            self.assertEqual(self.film.stamps(topic), taken, topic)
        heads = self.said("human/head")
        self.assertGreater(np.mean([head.visible for head in heads]), 0.9)

    def test_who_sees_and_decides_hears_nothing_that_a_real_cell_does_not_tell(self) -> None:
        self.assertFalse(topics_heard_by(SEEING) & HIDDEN)
        self.assertIn("/truth", topics_heard_by({"/recorder"}))
        self.assertIn(
            "/sim/scene", topics_heard_by({"/cell_camera"}) & topics_heard_by({"/head_camera"})
        )

    def test_the_container_holds_the_cube_that_truly_lies_there(self) -> None:
        scene = self.said("sim/scene")[-1]
        truth = [
            colour
            for colour, pose in zip(scene.cube_colours, scene.cubes, strict=True)
            if in_tray(pose)
        ]
        told = {
            row.id: list(row.cube_colours) for row in self.said("cell/containers")[-1].containers
        }
        self.assertEqual(told[1], truth)
        self.assertEqual(len(truth), 1)

    def test_the_deposit_is_told_once_and_by_whom(self) -> None:
        events = self.said("task/event")
        self.assertEqual([event.sequence for event in events], list(range(1, len(events) + 1)))
        placed = [(event.kind, event.by) for event in events if event.kind in PLACED]
        self.assertEqual(placed, [(TaskEvent.SUBTASK_SUCCEEDED, TaskEvent.BY_PERSON)])

    def test_observations_are_numbered_and_the_last_is_the_end_of_the_task(self) -> None:
        observed = self.said("observation")
        self.assertEqual([o.sequence for o in observed], list(range(1, len(observed) + 1)))
        ends = [o for o in observed if o.task_success or o.task_failure]
        self.assertEqual(ends, observed[-1:])
        self.assertTrue(ends[0].task_success and ends[0].subtask_success)

    def test_a_reach_for_the_cube_is_seen_as_a_grasp(self) -> None:
        self.assertTrue(any(o.grasp_attempt for o in self.said("observation")))
        seen = {m.header.stamp.to_nsec(): m for m in self.said("human/activity")}
        there = [s for s in self.said("sim/scene") if s.holding]
        sure = [seen[k].posterior for s in there if (k := s.header.stamp.to_nsec()) in seen]
        grasping = [int(np.argmax(p)) == HumanActivity.GRASP for p in sure]
        self.assertGreater(np.mean(grasping), 0.5)

    def test_nobody_warned_and_no_warning_was_seen(self) -> None:
        self.assertFalse([o for o in self.said("observation") if o.warning])


if __name__ == "__main__":
    rospy.init_node("rostest_camera")
    rostest.rosrun("fabric_tests", "seeing", CameraLoop, sys.argv)
