#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Plays the motion node for the cell's graph test: two moves that fail, then cube into tray."""

import rospy
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import Point, Pose, Quaternion
from std_msgs.msg import Header

from fabric_msgs.msg import (
    ConveyorState,
    CubeArray,
    Decision,
    MoveArmActionGoal,
    MoveArmActionResult,
    MoveArmGoal,
    RobotActionState,
    TaskState,
)
from fabric_msgs.srv import SetSuction
from fabric_msgs.traffic import Traffic

NOWHERE = (0.9, 0.0, 0.0)
MOVES = (  # (place, suction before the move)
    ((0.281, 0.035, 0.072), False),
    ((0.281, 0.035, 0.012), False),
    ((0.281, 0.035, 0.072), True),
    ((0.160, -0.285, 0.050), True),
    ((0.160, -0.285, -0.039), True),
    ((0.160, -0.285, 0.050), False),
)


class Motion:
    """Starts with a goal out of reach and one that it cancels, so that refusals are seen too."""

    def __init__(self) -> None:
        self._traffic = Traffic("motion")
        self._number = 0
        self._begun = False
        self._state = self._traffic.publisher("robot/state", RobotActionState)
        self._goals = self._traffic.publisher("arm/move/goal", MoveArmActionGoal)
        self._cancels = self._traffic.publisher("arm/move/cancel", GoalID)
        self._suction = rospy.ServiceProxy("arm/set_suction", SetSuction)
        subscribe = self._traffic.subscribe
        subscribe("arm/move/result", MoveArmActionResult, self._on_result)
        subscribe("conveyor/state", ConveyorState, self._on_conveyor)
        subscribe("cell/cubes", CubeArray, lambda _: None)
        subscribe("human/warning", Header, lambda _: None)
        subscribe("task/state", TaskState, lambda _: None)
        subscribe("decision", Decision, lambda _: None)

    def _on_conveyor(self, state: ConveyorState) -> None:
        if state.cube_at_pick_point and not self._begun:
            self._begun = True
            self._send(NOWHERE)
            self._send(MOVES[0][0])
            self._cancels.publish(GoalID(id=str(self._number)))
            self._tell()

    def _send(self, place: tuple[float, float, float]) -> None:
        self._number += 1
        pose = Pose(Point(*place), Quaternion(0.0, 0.0, 0.0, 1.0))
        goal = MoveArmGoal(number=self._number, pose=pose, speed=0.4)
        self._goals.publish(MoveArmActionGoal(Header(), GoalID(id=str(self._number)), goal))

    def _on_result(self, message: MoveArmActionResult) -> None:
        outcome = message.result.outcome
        rospy.set_param(f"outcomes/n{message.status.goal_id.id}", outcome)
        step = self._number - 2
        if len(rospy.get_param("outcomes")) < 2 or step == len(MOVES):
            return
        place, suction = MOVES[step]
        self._suction(suction)
        self._send(place)

    def _tell(self) -> None:
        self._state.publish(RobotActionState(sequence=1, current=RobotActionState.NONE), 1)


if __name__ == "__main__":
    rospy.init_node("motion")
    Motion()
    rospy.spin()
