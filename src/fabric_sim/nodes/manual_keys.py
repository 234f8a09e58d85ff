#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Keys of a terminal that drive the simulated person of human:=manual; q ends."""

import os
import select
import shutil
import sys
import termios
import tty
from collections.abc import Iterator

import rospy

from fabric_msgs.srv import HumanCommand
from fabric_sim.manual_commands import COMMANDS, NAMES
from fabric_sim.manual_view import TOPICS, ManualView

PERIOD = 0.2  # s between looks at the cell
END = ("q", "\x04")


def line_of(news: dict) -> str:
    """What matters in one line."""
    task, cubes, person = news["task"], news["cubes"], news["person"]
    status = "press space to begin" if news["waiting"] else task["status"]
    waits = ", ".join(cubes["pick_point"]) or "nothing"
    trays = " ".join(f"{i}:{name}" for i, name in enumerate(news["trays"], start=1))
    return (
        f"{task['number']}: {status} {task['seconds']:.0f} s | waiting: {waits} | "
        f"you: {'away' if person['away'] else person['action']} | robot: {news['robot']} | {trays}"
    )


def keys() -> Iterator[str]:
    """Keys as they are pressed, an empty one whenever a while has passed."""
    while not rospy.is_shutdown():
        if select.select([sys.stdin], [], [], PERIOD)[0]:
            yield from os.read(sys.stdin.fileno(), 64).decode(errors="replace") or END[0]
        yield ""


def run(view: ManualView, command: rospy.ServiceProxy) -> None:
    """Pass keys on until q or the end of ROS."""
    width = shutil.get_terminal_size().columns - 1
    for key in keys():
        if key in END:
            return
        wanted = view.command_of_key(key)
        if wanted:
            answer = command(NAMES.index(wanted[0]), wanted[1])
            if not answer.accepted:
                print(f"\r{answer.reason[:width]:<{width}}")
        print(f"\r{line_of(view.snapshot())[:width]:<{width}}", end="", flush=True)


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
        print()
    return 0


if __name__ == "__main__":
    sys.exit(main())
