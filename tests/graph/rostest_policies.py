#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Goals that name their policy: the model is loaded for that task, and the record says so."""

from __future__ import annotations

import csv
import shutil
import sys
import threading
import unittest
from pathlib import Path

import actionlib
import rospkg
import rospy
import rostest

from fabric_msgs.msg import Heartbeat, RunTaskAction, RunTaskGoal, RunTaskResult, TaskState
from fabric_msgs.srv import Command
from fabric_study.event_journal import JOURNAL_FILE, read_journal

DEADLINE = 100.0  # s, wall time for any one condition
NODES = {"cell", "task", "observation", "decision", "motion", "recorder"}
MODELS = Path(rospkg.RosPack().get_path("fabric_planner")) / "models"
ASKED = ("none", "", str(MODELS / "inspection_eager.pomdpx"))
RECORDED = ["none", "patient", "inspection_eager"]


class Policies(unittest.TestCase):
    """One graph, all cases look at the same tasks."""

    @classmethod
    def setUpClass(cls) -> None:
        cls.folder = Path(rospy.get_param("~out_dir"))
        cls.beats: dict[str, Heartbeat] = {}
        cls.states: list[TaskState] = []
        cls.heard = threading.Condition()
        rospy.Subscriber("heartbeat", Heartbeat, cls.on_beat, tcp_nodelay=True)
        rospy.Subscriber("task/state", TaskState, cls.on_state, tcp_nodelay=True)
        cls.client = actionlib.ActionClient("task/run", RunTaskAction)
        ends = (cls.client.pub_goal, cls.client.result_sub)
        cls.wait(lambda: set(cls.beats) >= NODES, "not everybody is alive")
        for _ in range(int(DEADLINE / 0.1)):  # connections are told to nobody
            if all(end.get_num_connections() for end in ends):
                break
            threading.Event().wait(0.1)
        cls.results = [cls.run_task(n, policy) for n, policy in enumerate(ASKED, start=1)]
        cls.refused = [cls.run_task(9, policy) for policy in ("whim", "abps", "no.pomdpx")]
        cls.wait(lambda: cls.rows_written() >= len(ASKED), "the recorder wrote too little")

    @classmethod
    def tearDownClass(cls) -> None:
        shutil.rmtree(cls.folder)

    @classmethod
    def on_beat(cls, message: Heartbeat) -> None:
        with cls.heard:
            cls.beats[message.node] = message
            cls.heard.notify_all()

    @classmethod
    def on_state(cls, message: TaskState) -> None:
        with cls.heard:
            cls.states.append(message)

    @classmethod
    def wait(cls, condition, complaint: str) -> None:
        with cls.heard:
            assert cls.heard.wait_for(condition, DEADLINE), complaint

    @classmethod
    def rows_written(cls) -> int:
        sent = cls.beats["recorder"].sent
        return sum(entry.count for entry in sent if entry.topic == "results")

    @classmethod
    def run_task(cls, number: int, policy: str) -> RunTaskResult:
        ended = threading.Event()

        def on_transition(handle: actionlib.ClientGoalHandle) -> None:
            if handle.get_comm_state() == actionlib.CommState.DONE:
                ended.set()

        goal = RunTaskGoal(task_id=number, definition="inspection", seed=100, policy=policy)
        handle = cls.client.send_goal(goal, transition_cb=on_transition)
        assert ended.wait(DEADLINE), f"task {number} under {policy!r} did not come to its end"
        return handle.get_result()

    def test_every_task_ran_under_the_policy_it_asked_for(self) -> None:
        for result in self.results:
            self.assertFalse(result.aborted, result.reason)
        with (self.folder / "results.csv").open(newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual([row["policy"] for row in rows], RECORDED)
        self.assertEqual([row["model"] for row in rows], RECORDED)

    def test_the_state_of_a_task_tells_its_policy(self) -> None:
        told = {state.task_id: state.policy for state in self.states if state.task_id}
        self.assertEqual([told[number] for number in (1, 2, 3)], ["none", "patient", ASKED[2]])

    def test_a_policy_that_is_not_there_is_refused_with_a_reason(self) -> None:
        whim, abps, file = (result.reason for result in self.refused)
        self.assertTrue(all(result.aborted for result in self.refused))
        self.assertIn("policy 'whim' is none of abps, eager, on_call, patient", whim)
        self.assertIn("abps/select failed", abps)
        self.assertIn("no.pomdpx: there is no such model file", file)
        self.assertNotIn(9, {state.task_id for state in self.states})

    def test_the_button_is_refused_without_a_task(self) -> None:
        answer = rospy.ServiceProxy("study/call", Command)()
        self.assertEqual((answer.accepted, answer.reason), (False, "no task is running"))

    def test_every_event_is_in_the_journal(self) -> None:
        entries = read_journal(self.folder / JOURNAL_FILE).entries
        self.assertEqual([e["task"] for e in entries if e["what"] == "task_started"], [1, 2, 3])


if __name__ == "__main__":
    rospy.init_node("rostest_policies")
    rostest.rosrun("fabric_tests", "policies", Policies, sys.argv)
