#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs tasks through the whole graph and looks at what every part said."""

from __future__ import annotations

import csv
import shutil
import sys
import threading
import unittest
from pathlib import Path
from typing import Any

import actionlib
import rosbag
import rosgraph
import rospy
import rostest

from fabric_msgs.msg import (
    Decision,
    Heartbeat,
    Observation,
    RunTaskAction,
    RunTaskGoal,
    TaskEvent,
    TaskState,
)

TASKS = {"inspection": 2, "sorting": 1}
DEADLINE = 100.0  # s, wall time for any one condition
NODES = {"cell", "task", "observation", "decision", "motion", "recorder"}
DECIDING = {"/decision", "/motion", "/observation", "/abps", "/task"}
ENDED = (TaskState.SUCCEEDED, TaskState.FAILED)


class Log:
    """Every message of some topics, and a way to wait until they say something."""

    def __init__(self, topics: dict[str, type]) -> None:
        self.messages: dict[str, list[Any]] = {topic: [] for topic in topics}
        self.beats: dict[str, Heartbeat] = {}  # the newest of each node
        self._heard = threading.Condition()
        for topic, kind in topics.items():
            rospy.Subscriber(topic, kind, self._take, callback_args=topic, tcp_nodelay=True)
        rospy.Subscriber("heartbeat", Heartbeat, self._beat, tcp_nodelay=True)

    def _beat(self, message: Heartbeat) -> None:
        with self._heard:
            self.beats[message.node] = message
            self._heard.notify_all()

    def _take(self, message: Any, topic: str) -> None:
        with self._heard:
            self.messages[topic].append(message)
            self._heard.notify_all()

    def wait(self, condition) -> bool:
        """True as soon as the condition holds, False if it never does."""
        with self._heard:
            return self._heard.wait_for(condition, DEADLINE)


def topics_heard_by(nodes: set[str]) -> set[str]:
    """Every topic that one of the nodes subscribes to, from the master's own books."""
    _, subscribers, _ = rosgraph.Master("/rostest_loop").getSystemState()
    return {topic for topic, names in subscribers if nodes.intersection(names)}


class ClosedLoop(unittest.TestCase):
    """One graph, all cases look at the same tasks."""

    @classmethod
    def setUpClass(cls) -> None:
        cls.scenario = rospy.get_param("~scenario")
        cls.policy = rospy.get_param("~policy")
        cls.folder = Path(rospy.get_param("~out_dir"))
        cls.log = Log(
            {
                "observation": Observation,
                "decision": Decision,
                "task/event": TaskEvent,
                "task/state": TaskState,
            }
        )
        wanted = NODES | ({"abps"} if cls.policy == "abps" else set())
        assert cls.log.wait(lambda: wanted <= cls.alive()), f"only {cls.alive()} are alive"
        cls.numbers = list(range(1, TASKS[cls.scenario] + 1))
        cls.results = [cls.run_task(number) for number in cls.numbers]
        complete = cls.log.wait(lambda: cls.rows_written() >= len(cls.numbers))
        assert complete, "the recorder wrote too little"

    @classmethod
    def tearDownClass(cls) -> None:
        shutil.rmtree(cls.folder)

    @classmethod
    def alive(cls) -> set[str]:
        return set(cls.log.beats)

    @classmethod
    def rows_written(cls) -> int:
        sent = cls.log.beats["recorder"].sent
        return sum(entry.count for entry in sent if entry.topic == "results")

    @classmethod
    def run_task(cls, number: int) -> Any:
        client = actionlib.SimpleActionClient("task/run", RunTaskAction)
        action = client.action_client
        connected = threading.Event()
        for _ in range(int(DEADLINE / 0.1)):  # wait_for_server needs a clock that runs
            ends = (action.pub_goal, action.result_sub, action.feedback_sub)
            if all(end.get_num_connections() for end in ends) or connected.wait(0.1):
                break
        client.send_goal(RunTaskGoal(task_id=number, definition=cls.scenario, seed=100 + number))
        assert client.wait_for_result(), "the task did not come to its end"
        return client.get_result()

    def sent(self, topic: str) -> list[Any]:
        return self.log.messages[topic]

    def test_every_task_comes_to_its_end(self) -> None:
        for result in self.results:
            self.assertFalse(result.aborted, result.reason)
            self.assertGreater(result.duration, 0.0)
        ended = [state.task_id for state in self.sent("task/state") if state.status in ENDED]
        self.assertEqual(sorted(set(ended)), self.numbers)

    def test_every_observation_gets_one_decision(self) -> None:
        observed = [message.sequence for message in self.sent("observation")]
        self.assertTrue(self.log.wait(lambda: len(self.sent("decision")) >= len(observed)))
        decided = [message.observation_sequence for message in self.sent("decision")]
        self.assertEqual(observed, list(range(1, len(observed) + 1)))
        self.assertEqual(sorted(decided), observed)

    def test_decisions_carry_a_belief_and_ordered_bounds(self) -> None:
        for decision in self.sent("decision"):
            self.assertAlmostEqual(sum(decision.belief), 1.0, places=6)
            self.assertLessEqual(decision.lower_bound, decision.upper_bound + 1e-6)
            self.assertFalse(decision.fallback_used)

    def test_every_scored_thing_is_told_once(self) -> None:
        events = self.sent("task/event")
        self.assertEqual([event.sequence for event in events], list(range(1, len(events) + 1)))
        starts = [event for event in events if event.kind == TaskEvent.TASK_STARTED]
        self.assertEqual(len(starts), len(self.numbers))

    def test_no_deciding_node_hears_the_truth(self) -> None:
        self.assertFalse([t for t in topics_heard_by(DECIDING) if t.endswith("/truth")])
        self.assertIn("/truth", topics_heard_by({"/recorder"}))

    def test_none_never_moves_the_arm(self) -> None:
        actions = {decision.action for decision in self.sent("decision")}
        if self.policy == "none":
            self.assertEqual(actions, {Decision.IDLE})
        else:
            self.assertGreater(len(actions), 1)

    def test_every_task_leaves_a_row_and_a_closed_bag(self) -> None:
        with (self.folder / "results.csv").open(newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual([int(row["task"]) for row in rows], self.numbers)
        self.assertEqual({row["scenario"] for row in rows}, {self.scenario})
        self.assertFalse(list(self.folder.glob("*.active")))
        for path in sorted(self.folder.glob("*.bag")):
            with rosbag.Bag(str(path)) as bag:
                topics = bag.get_type_and_topic_info().topics
            self.assertLessEqual({"observation", "decision", "task/event", "truth"}, set(topics))


if __name__ == "__main__":
    rospy.init_node("rostest_loop")
    rostest.rosrun("fabric_tests", "loop", ClosedLoop, sys.argv)
