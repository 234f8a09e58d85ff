#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Python's Traffic with a master: counts, order and serialised callbacks."""

import threading
import time
import unittest

import rospy
import rostest
from std_msgs.msg import UInt32

from fabric_msgs.msg import Heartbeat
from fabric_msgs.traffic import Traffic, introduce

DEADLINE = 30.0  # s


class TrafficTest(unittest.TestCase):
    """One node that answers every message of `question` with one of `answer`."""

    @classmethod
    def setUpClass(cls):
        cls.traffic = Traffic("echo")
        cls.changed = threading.Condition()
        cls.beats = []
        cls.busy = 0
        cls.overlaps = 0
        cls.answer = cls.traffic.publisher("answer", UInt32)
        cls.watch = rospy.Subscriber("heartbeat", Heartbeat, cls.on_beat)
        cls.sink = rospy.Subscriber("answer", UInt32, lambda message: None)
        cls.questions = [rospy.Publisher(name, UInt32, queue_size=100) for name in ("q1", "q2")]
        cls.inputs = [cls.traffic.subscribe(name, UInt32, cls.on_question) for name in ("q1", "q2")]

    @classmethod
    def on_question(cls, message):
        cls.busy += 1
        cls.overlaps += cls.busy > 1
        cls.answer.publish(message)
        cls.busy -= 1
        if message.data == 13:
            raise ValueError("an unlucky message")

    @classmethod
    def on_beat(cls, message):
        with cls.changed:
            cls.beats.append(message)
            cls.changed.notify_all()

    def wait(self, condition):
        with self.changed:
            self.assertTrue(self.changed.wait_for(condition, DEADLINE))

    def test_a_lost_connection_comes_back_after_an_introduction(self):
        publisher = rospy.Publisher("lost", UInt32, queue_size=1, latch=True)
        arrived = threading.Event()
        subscriber = rospy.Subscriber("lost", UInt32, lambda message: arrived.set())
        publisher.publish(1)
        self.assertTrue(arrived.wait(DEADLINE))
        arrived.clear()
        for connection in list(subscriber.impl.connections):
            subscriber.impl.remove_connection(connection)
            connection.close()
        self.assertEqual(subscriber.get_num_connections(), 0)
        introduce(["lost"])
        self.assertTrue(arrived.wait(DEADLINE))

    @staticmethod
    def total(entries):
        return sum(entry.count for entry in entries)

    def test_every_beat_has_at_least_one_answer_for_each_question_handled(self):
        self.wait(lambda: self.beats and self.beats[-1].sent[0].connections == 1)
        deadline = time.monotonic() + DEADLINE
        while any(publisher.get_num_connections() < 1 for publisher in self.questions):
            self.assertLess(time.monotonic(), deadline)
            with self.changed:
                self.changed.wait(0.1)
        for number in range(50):
            for publisher in self.questions:
                publisher.publish(number)
        self.wait(lambda: self.total(self.beats[-1].handled) == 100)
        self.assertEqual(self.total(self.beats[-1].sent), 100)
        for beat in self.beats:
            self.assertGreaterEqual(self.total(beat.sent), self.total(beat.handled))
        self.assertEqual(self.overlaps, 0)

    def test_the_heart_beats_without_messages(self):
        seen = len(self.beats)
        self.wait(lambda: len(self.beats) >= seen + 2)
        self.assertEqual(self.beats[-1].node, "echo")

    def test_bad_arguments_are_refused(self):
        with self.assertRaisesRegex(ValueError, "node_name"):
            Traffic("")
        with self.assertRaisesRegex(ValueError, "period"):
            Traffic("x", 0.0)


if __name__ == "__main__":
    rospy.init_node("rostest_traffic")
    rostest.rosrun("fabric_msgs", "traffic_py", TrafficTest)
