#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""First motions of a real arm, in place of the motion node: up, down, and a stop between."""

import sys
import threading

import actionlib
import rospy
from geometry_msgs.msg import Pose, PoseStamped

from fabric_msgs.msg import MoveArmAction, MoveArmGoal, MoveArmResult
from fabric_msgs.traffic import Traffic

SPEED = 0.05  # m/s, a tenth of the fastest
RISE = 0.03  # m
PATIENCE = rospy.Duration(20.0)
OUTCOMES = {
    getattr(MoveArmResult, name): name
    for name in ("REACHED", "PRE_EMPTED", "UNREACHABLE", "INVALID", "ARM_FAULT")
}


class FirstMotion:
    """Sends one goal after the other and says what became of it."""

    def __init__(self) -> None:
        self._traffic = Traffic("motion")
        self._client = actionlib.SimpleActionClient("arm/move", MoveArmAction)
        self._number = 0
        self._halfway = threading.Event()

    def run(self) -> bool:
        """True when everything went as it should."""
        if not self._client.wait_for_server(PATIENCE):
            rospy.logerr("nobody serves arm/move")
            return False
        start = self._tool()
        height = start.position.z
        done = self._go(start, height + RISE) and self._go(start, height)
        return done and self._stop_between(start, height + RISE) and self._go(start, height)

    def _tool(self) -> Pose:
        return rospy.wait_for_message("arm/tcp", PoseStamped, PATIENCE.to_sec()).pose

    def _send(self, start: Pose, height: float) -> None:
        self._number += 1
        goal = MoveArmGoal(number=self._number, speed=SPEED, pose=start)
        goal.pose.position.z = height
        self._client.send_goal(goal, feedback_cb=self._on_feedback)

    def _on_feedback(self, feedback: object) -> None:
        if feedback.remaining < RISE / 2:
            self._halfway.set()

    def _go(self, start: Pose, height: float) -> bool:
        self._send(start, height)
        if not self._client.wait_for_result(PATIENCE):
            rospy.logerr("no result")
            return False
        result, off = self._client.get_result(), 1e3 * abs(self._tool().position.z - height)
        rospy.loginfo("%s %s, %.2f mm off", OUTCOMES[result.outcome], result.reason, off)
        return result.outcome == MoveArmResult.REACHED

    def _stop_between(self, start: Pose, height: float) -> bool:
        self._send(start, height)
        self._halfway.clear()
        self._halfway.wait(PATIENCE.to_sec())
        self._client.cancel_goal()
        self._client.wait_for_result(PATIENCE)
        result, left = self._client.get_result(), 1e3 * (height - self._tool().position.z)
        rospy.loginfo("%s halfway, %.1f mm left", OUTCOMES[result.outcome], left)
        return result.outcome == MoveArmResult.PRE_EMPTED and left > 0.0


if __name__ == "__main__":
    rospy.init_node("motion")
    sys.exit(0 if FirstMotion().run() else 1)
