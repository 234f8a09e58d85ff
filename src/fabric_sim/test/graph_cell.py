#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The cell node in a graph: plays the task manager and watches what the devices report."""

import sys
import threading
import unittest

import rospy
import rostest
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from fabric_msgs.msg import (
    ContainerArray,
    ConveyorState,
    MoveArmResult,
    SortingRule,
    TaskEvent,
    TaskState,
)
from fabric_msgs.srv import Command, SetConveyor
from fabric_msgs.traffic import Traffic

LIMIT = 60.0  # s, wall time
TRAYS = ("red", "green", "blue")


class Task:
    """Runs one task of one red cube until it lies somewhere."""

    def __init__(self) -> None:
        self.traffic = Traffic("task")
        self.changed = threading.Condition(self.traffic.lock)
        self.stamps: list[int] = []
        self.found: dict[str, list[int]] = {}
        self.joints: JointState | None = None
        self.tool: PoseStamped | None = None
        self._states = self.traffic.publisher("task/state", TaskState, latch=True)
        self.traffic.publisher("task/event", TaskEvent)
        self.traffic.subscribe("conveyor/state", ConveyorState, self._on_conveyor)
        self.traffic.subscribe("cell/containers", ContainerArray, self._on_containers)
        self.traffic.subscribe("human/warning", Header, lambda _: None)
        rospy.Subscriber("arm/joint_states", JointState, self._on_joints)
        rospy.Subscriber("arm/tcp", PoseStamped, self._on_tool)

    def publish(self, status: int) -> None:
        state = TaskState(task_id=1, scenario="sorting", status=status, cube_colours=[1])
        state.cube_rules = [0]
        state.rules = [SortingRule(colour=n, label=label) for n, label in enumerate(TRAYS, 1)]
        self._states.publish(state)

    def wait_for(self, condition) -> bool:
        with self.changed:
            return self.changed.wait_for(condition, LIMIT)

    def _on_conveyor(self, state: ConveyorState) -> None:
        self.stamps.append(state.header.stamp.to_nsec())
        self.changed.notify_all()

    def _on_containers(self, message: ContainerArray) -> None:
        for container in message.containers:
            if container.cube_ids:
                self.found[f"{container.owner} {container.label}"] = list(container.cube_ids)
                self.publish(TaskState.SUCCEEDED)
        self.changed.notify_all()

    def _on_joints(self, message: JointState) -> None:
        with self.changed:
            self.joints = message
            self.changed.notify_all()

    def _on_tool(self, message: PoseStamped) -> None:
        with self.changed:
            self.tool = message
            self.changed.notify_all()


class TestCell(unittest.TestCase):
    def test_a_task_runs_and_freezes(self):
        task = Task()
        belt = service("conveyor/set_speed", SetConveyor)
        self.assertFalse(belt(-1.0, False).accepted)
        self.assertIn("want a finite number", belt(float("nan"), False).reason)
        self.assertTrue(service("arm/clear_alarms", Command)().accepted)
        task.publish(TaskState.RUNNING)
        self.assertTrue(task.wait_for(lambda: task.stamps), "time does not run")
        self.assertTrue(task.wait_for(lambda: task.joints and task.tool), "the arm says nothing")
        self.assertTrue(belt(0.1, False).accepted)
        self.assertTrue(task.wait_for(lambda: task.found), "no cube in a container")
        self.check_outcomes()
        self.assertEqual(list(task.found), ["1 red"])
        self.assertEqual(task.joints.name, ["j1", "j2", "j3", "j4"])
        self.assertEqual(task.tool.header.frame_id, "arm_base_link")
        steps = {b - a for a, b in zip(task.stamps, task.stamps[1:], strict=False)}
        self.assertEqual(steps, {100_000_000})

    def check_outcomes(self):
        outcomes = rospy.get_param("outcomes")
        seen = [outcomes[f"n{i + 1}"] for i in range(len(outcomes))]
        self.assertEqual(seen[:2], [MoveArmResult.INVALID, MoveArmResult.PRE_EMPTED])
        self.assertEqual(set(seen[2:]), {MoveArmResult.REACHED})


def service(name, kind):
    rospy.wait_for_service(name, LIMIT)
    return rospy.ServiceProxy(name, kind)


if __name__ == "__main__":
    rospy.init_node("task")
    rostest.rosrun("fabric_sim", "cell_graph", TestCell, sys.argv)
