#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The arm's node on the emulator: moves, stops, a pulled plug, alarms, the belt and its sensor."""

import json
import math
import sys
import threading
import time
import unittest
from pathlib import Path

import actionlib
import numpy as np
import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import JointState

from fabric_dobot_driver import Joints, forward
from fabric_dobot_driver.emulator import tell
from fabric_msgs.msg import ConveyorState, MoveArmAction, MoveArmGoal, MoveArmResult
from fabric_msgs.srv import Command, SetConveyor, SetSuction
from fabric_msgs.traffic import Traffic

LIMIT = 30.0  # s, wall time
BACK_AND_FORTH = ((0.20, -0.20, 0.06), (0.20, 0.10, 0.06))


class ArmTest(unittest.TestCase):
    """This node is the motion node: it beats, and sends goals."""

    @classmethod
    def setUpClass(cls):
        cls.link = Path(rospy.get_param("link"))
        cls.changed = threading.Condition()
        cls.health = cls.tool = cls.joints = cls.belt = None
        cls.number = 0
        cls.subscribers = [
            rospy.Subscriber("/diagnostics", DiagnosticArray, cls.on("health")),
            rospy.Subscriber("arm/tcp", PoseStamped, cls.on("tool")),
            rospy.Subscriber("arm/joint_states", JointState, cls.on("joints")),
            rospy.Subscriber("conveyor/state", ConveyorState, cls.on("belt")),
        ]
        cls.client = actionlib.SimpleActionClient("arm/move", MoveArmAction)
        assert cls.client.wait_for_server(rospy.Duration(LIMIT))
        cls.traffic = Traffic("motion")

    @classmethod
    def on(cls, name):
        def keep(message):
            with cls.changed:
                setattr(cls, name, message)
                cls.changed.notify_all()

        return keep

    def until(self, condition, what):
        with self.changed:
            self.assertTrue(self.changed.wait_for(condition, LIMIT), f"{what}: {self.said()}")

    def said(self):
        return "" if self.health is None else self.health.status[0].message

    def ready(self):
        """Homed, whatever was before."""
        self.until(lambda: self.said() == "ready" or "not homed" in self.said(), "not there")
        if self.said() != "ready":
            answer = rospy.ServiceProxy("arm/home", Command)()
            self.assertTrue(answer.accepted, answer.reason)
            self.until(lambda: self.said() == "ready", "not homed")

    def send(self, x, y, z, speed=0.1):
        type(self).number += 1
        goal = MoveArmGoal(number=self.number, speed=speed)
        goal.pose.position.x, goal.pose.position.y, goal.pose.position.z = x, y, z
        goal.pose.orientation.w = 1.0
        self.client.send_goal(goal)

    def result(self):
        self.assertTrue(self.client.wait_for_result(rospy.Duration(LIMIT)))
        return self.client.get_result()

    def under_way(self):
        """A long move that has begun."""
        here = self.tool.pose.position
        goal = max(BACK_AND_FORTH, key=lambda place: abs(place[1] - here.y))
        self.send(*goal)
        start = here.y
        self.until(lambda: abs(self.tool.pose.position.y - start) > 0.01, "it does not move")

    def state(self):
        return json.loads(tell(self.link, "state"))

    def test_it_goes_where_it_is_sent(self):
        self.ready()
        self.send(0.22, 0.05, 0.08)
        self.assertEqual(self.result().outcome, MoveArmResult.REACHED)
        self.assertLess(math.dist(self.state()["pose"][:3], (220.0, 50.0, 80.0)), 0.01)

    def test_it_goes_to_joint_angles_too(self):
        self.ready()
        type(self).number += 1
        angles = (0.3, 0.5, 0.6, -0.2)
        self.client.send_goal(MoveArmGoal(number=self.number, speed=0.1, joints=angles))
        self.assertEqual(self.result().outcome, MoveArmResult.REACHED)
        there = 1e3 * np.array(forward(Joints(*angles))[:3])
        self.assertLess(math.dist(self.state()["pose"][:3], there), 0.01)

    def test_joints_and_tool_tell_the_same_place(self):
        self.ready()
        with self.changed:
            stamp = self.joints.header.stamp
        self.until(
            lambda: self.joints.header.stamp == self.tool.header.stamp > stamp, "no fresh look"
        )
        with self.changed:
            self.assertEqual(self.joints.name, ["j1", "j2", "j3", "j4"])
            pose, tool = forward(Joints(*self.joints.position)), self.tool.pose.position
        self.assertLess(math.dist(pose[:3], (tool.x, tool.y, tool.z)), 1e-5)

    def test_a_cancelled_goal_stops_in_mid_motion(self):
        self.ready()
        self.under_way()
        self.client.cancel_goal()
        self.assertEqual(self.result().outcome, MoveArmResult.PRE_EMPTED)
        stands = self.state()
        self.assertFalse(stands["moving"])
        goals = [math.dist(stands["pose"][:2], (1e3 * x, 1e3 * y)) for x, y, _ in BACK_AND_FORTH]
        self.assertGreater(min(goals), 1.0)

    def test_a_bad_goal_is_refused_with_a_reason(self):
        self.ready()
        issued = self.state()["queue"]["issued"]
        self.send(0.9, 0.0, 0.1)
        self.assertEqual(self.result().outcome, MoveArmResult.INVALID)
        self.assertIn("allowed box", self.result().reason)
        self.send(math.nan, 0.0, 0.1)
        self.assertEqual(self.result().outcome, MoveArmResult.INVALID)
        self.assertEqual(self.state()["queue"]["issued"], issued)

    def test_an_unplugged_arm_is_told_within_a_second_and_stands_after_replugging(self):
        self.ready()
        self.under_way()
        begun = time.monotonic()
        tell(self.link, "unplug 2")
        self.assertEqual(self.result().outcome, MoveArmResult.ARM_FAULT)
        self.assertLess(time.monotonic() - begun, 1.0)
        self.until(lambda: "not homed" in self.said(), "not back")
        stands = self.state()["pose"]
        self.send(*BACK_AND_FORTH[0])
        self.assertIn("call arm/home", self.result().reason)
        self.assertEqual(self.state()["pose"], stands)
        self.assertFalse(self.state()["moving"])
        self.ready()
        self.send(0.22, 0.05, 0.08)
        self.assertEqual(self.result().outcome, MoveArmResult.REACHED)

    def test_an_alarm_is_told_by_name_and_cleared(self):
        self.ready()
        self.under_way()
        tell(self.link, "alarm 0x30")
        self.assertEqual(self.result().reason, "alarm OVERSPEED_J1")
        self.until(lambda: self.said() == "alarm OVERSPEED_J1", "not in the diagnostics")
        self.assertTrue(rospy.ServiceProxy("arm/clear_alarms", Command)().accepted)
        self.until(lambda: self.said() == "ready", "not cleared")
        self.send(0.22, 0.05, 0.08)
        self.assertEqual(self.result().outcome, MoveArmResult.REACHED)

    def test_the_suction_acts(self):
        self.ready()
        suction = rospy.ServiceProxy("arm/set_suction", SetSuction)
        for on in (True, False):
            self.assertTrue(suction(on).accepted)
            self.assertEqual(self.state()["suction"], on)

    def test_a_cube_stops_the_belt(self):
        self.ready()
        run = rospy.ServiceProxy("conveyor/set_speed", SetConveyor)
        self.assertFalse(run(math.nan, False).accepted)
        tell(self.link, "infrared off")
        self.assertTrue(run(0.05, False).accepted)
        self.until(lambda: self.belt.speed > 0.04, "the belt does not run")
        tell(self.link, "infrared on")
        self.until(lambda: self.belt.cube_at_pick_point and self.belt.speed == 0.0, "it runs on")
        self.assertEqual(self.state()["belt_speed"][0], 0.0)
        tell(self.link, "infrared off")
        self.until(lambda: self.belt.speed > 0.04, "it does not go on")
        run(0.0, False)


if __name__ == "__main__":
    rospy.init_node("motion")
    rostest.rosrun("fabric_dobot_driver", "arm_on_emulator", ArmTest, sys.argv)
