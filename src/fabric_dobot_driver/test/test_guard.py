# SPDX-License-Identifier: BSD-3-Clause
"""The guard of the port, as processes: who beats, who dies, and what then is on the line."""

import os
import select
import signal
import subprocess
import sys
import tty

import pytest

from fabric_dobot_driver.emulator import commands
from fabric_dobot_driver.emulator.frames import Parser
from fabric_dobot_driver.guard import Guard, GuardGone
from fabric_dobot_driver.link import LinkLost, SerialLink
from fabric_dobot_driver.wire import hold_frames

LIMIT = 20.0  # s, for what comes at once unless the machine is very busy
NEVER = 1000.0  # s of silence that are allowed
HOLD = b"hold!"
POSE = commands.POSE
#: Opens the port, posts a guard, says that it is ready, and beats until it is killed.
DRIVER = """
import os, select, sys
from fabric_dobot_driver.guard import Guard
guard = Guard(os.open(sys.argv[1], os.O_RDWR | os.O_NOCTTY), float(sys.argv[2]), b"hold!")
print(guard.pid, flush=True)
while True:
    guard.beat()
    select.select([], [], [], 0.01)
"""


@pytest.fixture
def line():
    """Both ends of a port: what the arm hears, and the path that a driver opens."""
    arm, port = os.openpty()
    tty.setraw(port)
    yield arm, os.ttyname(port)
    os.close(arm)
    os.close(port)


def heard(arm: int, seconds: float = LIMIT) -> bytes:
    ready, _, _ = select.select([arm], [], [], seconds)
    return os.read(arm, 4096) if ready else b""


def driver(path: str, silence: float) -> subprocess.Popen:
    command = [sys.executable, "-c", DRIVER, path, str(silence)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert int(process.stdout.readline()) > 0
    return process


def end(process: subprocess.Popen) -> None:
    process.kill()
    process.communicate()


def test_when_the_driver_is_killed_the_arm_is_told_to_hold_twice(line):
    arm, path = line
    end(driver(path, NEVER))
    said = heard(arm)
    while len(said) < 2 * len(HOLD):
        said += heard(arm)
    assert said == 2 * HOLD


def test_when_the_driver_is_frozen_the_arm_is_told_to_hold_and_again_the_next_time(line):
    arm, path = line
    process = driver(path, 0.3)
    for _ in range(2):
        process.send_signal(signal.SIGSTOP)
        assert heard(arm).startswith(HOLD)
        process.send_signal(signal.SIGCONT)
        while heard(arm, 1.0):  # the second writing, and what a busy machine adds
            pass
    end(process)


def test_a_guard_that_has_ended_is_told(line):
    guard = Guard(os.open(line[1], os.O_RDWR | os.O_NOCTTY), NEVER, HOLD)
    os.kill(guard.pid, signal.SIGKILL)
    os.waitpid(guard.pid, 0)
    with pytest.raises(GuardGone, match="has ended"):
        guard.beat()
    guard.close()


def test_a_link_whose_guard_has_ended_is_lost(line):
    posts = []

    def post(port):
        posts.append(Guard(port, NEVER, HOLD))
        return posts[-1]

    link = SerialLink(line[1], 0.1, post=post)
    link.open()
    os.kill(posts[0].pid, signal.SIGKILL)
    os.waitpid(posts[0].pid, 0)
    with pytest.raises(LinkLost, match="guard"):
        link.exchange(POSE, b"", write=False, queued=False)
    link.close()
    link.open()  # the port is free, with another guard
    assert len(posts) == 2
    link.close()


def test_whoever_closes_the_link_leaves_an_arm_that_holds_and_a_free_port(line):
    arm, path = line
    link = SerialLink(path, 0.1, post=lambda port: Guard(port, NEVER, hold_frames(0)))
    link.open()
    link.close()
    frames = Parser().feed(heard(arm))
    names = [(frame.id, frame.params.hex()) for frame in frames][:3]
    assert names == [
        (commands.FORCE_STOP, ""),
        (commands.STEPPER, "000000000000"),
        (commands.CLEAR, ""),
    ]
    link.open()  # the port is free
    link.close()
