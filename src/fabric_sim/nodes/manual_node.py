#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The page of somebody at the keys: shows the cell, passes commands on to it."""

import asyncio
import secrets
import sys
from typing import Any

import rosgraph
import rospy
from aiohttp import web

from fabric_msgs.srv import HumanCommand
from fabric_sim.manual_commands import NAMES
from fabric_sim.manual_page import make_app
from fabric_sim.manual_view import TOPICS, ManualView

HOST = "127.0.0.1"
PATIENCE = 2.0  # s of wall time for pages to let go at the end


class RosDesk:
    """The graph behind the page."""

    def __init__(self) -> None:
        self._view = ManualView()
        self._service = rospy.ServiceProxy("human/command", HumanCommand)
        for topic, kind in TOPICS.items():
            rospy.Subscriber(topic, kind, self._view.take, callback_args=topic, queue_size=1)

    def snapshot(self) -> dict[str, Any]:
        """What there is to see."""
        return self._view.snapshot()

    async def command(self, name: str, container: str) -> tuple[bool, str]:
        """Ask the cell; a cell that is not there refuses."""
        if name not in NAMES:
            return False, f"unknown command '{name}'"
        try:
            answer = await asyncio.to_thread(self._service, NAMES.index(name), container)
        except rospy.ServiceException as error:
            return False, f"the cell does not answer: {error}"
        return answer.accepted, answer.reason


async def serve(port: int) -> None:
    """Serve until ROS shuts down. Raises OSError when the port is taken."""
    loop, closing = asyncio.get_running_loop(), asyncio.Event()
    token = secrets.token_urlsafe(16)
    runner = web.AppRunner(make_app(RosDesk(), token), access_log=None)
    await runner.setup()
    try:
        site = web.TCPSite(runner, HOST, port, shutdown_timeout=PATIENCE)
        await site.start()
        announce(runner.addresses[0][1], token)
        rospy.on_shutdown(lambda: loop.call_soon_threadsafe(closing.set))
        await closing.wait()
    finally:
        await runner.cleanup()


def announce(port: int, token: str) -> None:
    """Say where the page is, and how to do without one."""
    url = f"http://localhost:{port}/{token}/"
    rospy.set_param("~url", url)
    print(f"drive the person in a browser of this machine: {url}", flush=True)
    keys = f"ROS_MASTER_URI={rosgraph.get_master_uri()}"
    print(
        f"or in a terminal: ./fabric shell -c '{keys} rosrun fabric_sim manual_keys.py'", flush=True
    )


def main() -> int:
    """Run until Ctrl-C (0) or refuse a port (2). Parameter: ~port, 0 for any free one."""
    rospy.init_node("manual")
    port = rospy.get_param("~port", 0)
    try:
        if isinstance(port, bool) or not isinstance(port, int) or not 0 <= port <= 65535:
            raise ValueError(f"is {port!r}, want a whole number from 0 to 65535")
        asyncio.run(serve(port))
    except (OSError, ValueError) as error:
        rospy.logfatal("parameter %s: %s", rospy.resolve_name("~port"), error)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
