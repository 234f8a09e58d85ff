#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Plays a gesture on the running robot: rosrun fabric_planner play_gesture.py NAME.

It asks the motion node through `robot/execute`, so that Table 6.5 holds for it as for decisions
and a cancel, a warning or a stop beats it. Ctrl-C takes the gesture back, which cancels. Without a
name, tells which gestures there are.
"""

import argparse
import sys
import threading

import actionlib
import rospy

import fabric_planner as fp
from fabric_msgs.msg import (
    ExecuteRobotActionAction,
    ExecuteRobotActionGoal,
    ExecuteRobotActionResult,
)

PATIENCE = 10.0  # s, to find the robot
POLL = 0.2  # s of wall time between looks at whether to end
OUTCOMES = {
    getattr(ExecuteRobotActionResult, name): name.lower().replace("_", " ")
    for name in "DONE PRE_EMPTED REFUSED NOTHING_TO_GRASP ARM_FAILED STOPPED CUBE_LOST".split()
}


def listed(node):
    """A line for each gesture of the running motion node. Raises KeyError, ModelError."""
    gestures = fp.MotionConfig.load(rospy.get_param(f"{node}/motion_file")).gestures
    return [f"{name:16} {action}" for name, action in sorted(gestures.items())]


def play(name):
    """Play it to its end; the exit code: 0 when it was done, else 1 with the reason on stderr."""
    client = actionlib.ActionClient("robot/execute", ExecuteRobotActionAction)
    if not client.wait_for_server(rospy.Duration(PATIENCE)):
        print("nobody serves robot/execute: is the robot running?", file=sys.stderr)
        return 1
    ended = threading.Event()

    def on_transition(handle):
        if handle.get_comm_state() == actionlib.CommState.DONE:
            ended.set()

    handle = client.send_goal(ExecuteRobotActionGoal(gesture=name), on_transition)
    rospy.on_shutdown(handle.cancel)
    while not ended.wait(POLL):
        if rospy.is_shutdown():
            return 1
    result = handle.get_result()
    print(f"{name}: {OUTCOMES[result.outcome]}" + (f": {result.reason}" if result.reason else ""))
    return 0 if result.outcome == ExecuteRobotActionResult.DONE else 1


def main():
    """Exit codes: 0 done, 1 not done, 2 bad words."""
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("gesture", nargs="?", help="its name in the motion file")
    words.add_argument("--motion-node", default="motion", help="for the list; its name")
    chosen = words.parse_args(rospy.myargv()[1:])
    rospy.init_node("play_gesture", anonymous=True, disable_signals=False)
    if chosen.gesture:
        return play(chosen.gesture)
    try:
        print("\n".join(listed(chosen.motion_node)))
    except (KeyError, fp.ModelError) as error:
        print(f"no motion file: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
