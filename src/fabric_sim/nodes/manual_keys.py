#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Keys of a terminal that drive the simulated person of human:=manual; q ends."""

import select
import sys
import termios
import tty

import rospy

from fabric_msgs.srv import HumanCommand
from fabric_sim.manual_commands import COMMANDS, NAMES
from fabric_sim.manual_view import TOPICS, ManualView

PERIOD = 0.2  # s between looks at the cell
WIDTH = 100  # columns of the status line


def line_of(news: dict) -> str:
    """What matters in one line."""
    task, cubes, person = news["task"], news["cubes"], news["person"]
    status = "press space to begin" if news["waiting"] else task["status"]
    waits = ", ".join(cubes["pick_point"]) or "nothing"
    trays = " ".join(f"{i}:{name}" for i, name in enumerate(news["trays"], start=1))
    return (
        f"task {task['number']} {status} {task['seconds']:.0f} s | you: {person['action']} | "
        f"robot: {news['robot']} | at the pick point: {waits} | trays {trays}"
    )


def run(view: ManualView, command: rospy.ServiceProxy) -> None:
    """Pass keys on until q or the end of ROS."""
    shown = ""
    while not rospy.is_shutdown():
        line = line_of(view.snapshot())
        if line != shown:
            shown = line
            print(f"\r{line[:WIDTH]:<{WIDTH}}", end="", flush=True)
        if not select.select([sys.stdin], [], [], PERIOD)[0]:
            continue
        key = sys.stdin.read(1)
        if key in ("q", ""):
            return
        wanted = view.command_of_key(key)
        if wanted:
            answer = command(NAMES.index(wanted[0]), wanted[1])
            if not answer.accepted:
                print(f"\r{answer.reason:<{WIDTH}}")
                shown = ""


def main() -> int:
    """Read keys until q (0); exit 1 without a cell that listens, 2 without a terminal."""
    if not sys.stdin.isatty():
        print("manual_keys: needs a terminal", file=sys.stderr)
        return 2
    rospy.init_node("manual_keys", anonymous=True)
    view = ManualView()
    for topic, kind in TOPICS.items():
        rospy.Subscriber(topic, kind, view.take, callback_args=topic, queue_size=1)
    print(", ".join(f"{'space' if c.key == ' ' else c.key}: {c.label}" for c in COMMANDS))
    print("1..9: place into that tray, q: end")
    before = termios.tcgetattr(sys.stdin)
    try:
        tty.setcbreak(sys.stdin)
        run(view, rospy.ServiceProxy("human/command", HumanCommand))
    except rospy.ServiceException as error:
        print(f"\nmanual_keys: the cell does not answer: {error}", file=sys.stderr)
        return 1
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)
    return 0


if __name__ == "__main__":
    sys.exit(main())
