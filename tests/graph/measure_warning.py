#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""How long a warning takes from `human/warning` to `arm/move/cancel`, in wall time.

    ./fabric shell -c "python3 tests/graph/measure_warning.py"

A motion node under a master of its own; this script is its arm and its person. Each round the arm
is on its way to the planning pose when the warning comes.
"""

import argparse
import json
import os
import subprocess
import sys
import threading
import time
from contextlib import ExitStack

import numpy as np
import rosgraph
import rospkg
import rospy
from actionlib_msgs.msg import GoalID, GoalStatus
from std_msgs.msg import Header

from fabric_bringup import ports
from fabric_msgs.msg import Decision, MoveArmActionGoal, MoveArmActionResult, MoveArmResult

PATIENCE = 10.0  # s


class Cell:
    """The arm and the person of a motion node."""

    def __init__(self) -> None:
        self._heard = threading.Condition()
        self._goals: list[GoalID] = []
        self._cancelled: float | None = None
        self._ears = [
            rospy.Subscriber("arm/move/goal", MoveArmActionGoal, self._on_goal, tcp_nodelay=True),
            rospy.Subscriber("arm/move/cancel", GoalID, self._on_cancel, tcp_nodelay=True),
        ]
        tell = {"queue_size": 10, "tcp_nodelay": True}
        self._decisions = rospy.Publisher("decision", Decision, **tell)
        self._warnings = rospy.Publisher("human/warning", Header, **tell)
        self._results = rospy.Publisher("arm/move/result", MoveArmActionResult, **tell)

    def connected(self) -> bool:
        """Whether the motion node is at the other end of everything."""
        ends = [*self._ears, self._decisions, self._warnings, self._results]
        return all(end.get_num_connections() for end in ends)

    def round(self, number: int) -> float:
        """A move, a warning in its middle; s from the warning to the cancellation."""
        goals = len(self._goals)
        action = Decision.PLANNING if number % 2 else Decision.CANCEL
        self._decisions.publish(Decision(sequence=number, action=action))
        self._wait(lambda: len(self._goals) > goals, "a goal")
        self._cancelled = None
        start = time.perf_counter()
        self._warnings.publish(Header())
        self._wait(lambda: self._cancelled is not None, "a cancellation")
        taken = self._cancelled - start
        result = MoveArmActionResult(result=MoveArmResult(MoveArmResult.PRE_EMPTED, "warned"))
        result.status = GoalStatus(goal_id=self._goals[-1], status=GoalStatus.PREEMPTED)
        self._results.publish(result)
        return taken

    def wait_for(self, condition, what: str) -> None:
        """For what nobody announces. Raises RuntimeError."""
        with self._heard:
            for _ in range(int(PATIENCE / 0.1)):
                if condition():
                    return
                self._heard.wait(0.1)
        raise RuntimeError(f"waited {PATIENCE} s for {what}")

    def _wait(self, condition, what: str) -> None:
        with self._heard:
            if not self._heard.wait_for(condition, PATIENCE):
                raise RuntimeError(f"waited {PATIENCE} s for {what}")

    def _on_goal(self, goal: MoveArmActionGoal) -> None:
        with self._heard:
            self._goals.append(goal.goal_id)
            self._heard.notify_all()

    def _on_cancel(self, _: GoalID) -> None:
        with self._heard:
            self._cancelled = time.perf_counter()
            self._heard.notify_all()


def measure(rounds: int) -> np.ndarray:
    """Latencies, (rounds,), ms. Raises RuntimeError when the node does not answer."""
    port = ports.any_free()
    os.environ |= {"ROS_MASTER_URI": f"http://localhost:{port}", "ROS_HOSTNAME": "localhost"}
    motion_file = rospkg.RosPack().get_path("fabric_planner") + "/config/motion.yaml"
    with ExitStack() as stack:
        master = _started(stack, "rosmaster", "--core", "-p", str(port))
        _await_master(master)
        parameters = {"motion_file": motion_file, "watched": ["decision"], "separation": False}
        rospy.set_param("/motion", parameters)
        _started(stack, "rosrun", "fabric_planner", "motion_node")
        rospy.init_node("measure_warning", disable_signals=True)
        cell = Cell()
        cell.wait_for(cell.connected, "the motion node")
        latencies = np.array([cell.round(number) for number in range(1, rounds + 1)])
        rospy.signal_shutdown("measured")
    return 1000.0 * latencies


def _started(stack: ExitStack, *command: str) -> subprocess.Popen:
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    stack.callback(process.wait)
    stack.callback(process.terminate)
    return process


def _await_master(process: subprocess.Popen) -> None:
    deadline = time.monotonic() + PATIENCE
    while not rosgraph.is_master_online():
        if process.poll() is not None or time.monotonic() > deadline:
            raise RuntimeError("no master")
        threading.Event().wait(0.05)


def main() -> int:
    """Print the figures; 1 when the node does not answer."""
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("--rounds", type=int, default=300)
    words.add_argument("--json", action="store_true")
    chosen = words.parse_args()
    try:
        taken = measure(chosen.rounds)
    except RuntimeError as error:
        print(error, file=sys.stderr)
        return 1
    p50, p99 = np.percentile(taken, [50, 99])
    if chosen.json:
        figures = {"p50_ms": p50, "p99_ms": p99, "max_ms": taken.max()}
        print(json.dumps({"warnings": len(taken)} | {k: round(v, 3) for k, v in figures.items()}))
    else:
        print(
            f"{len(taken)} warnings: p50 {p50:.2f} ms, p99 {p99:.2f} ms, max {taken.max():.2f} ms"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
