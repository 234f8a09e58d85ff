# SPDX-License-Identifier: BSD-3-Clause
"""A process beside the driver that tells the arm to hold when the driver is gone.

The arm carries out what is in its queue whether or not anybody is left at the other end of the
line, and its belt runs for ever. So whoever opens the port gives it to a guard, too, and has to be
heard from: a driver that is killed closes its end of a pipe, one that is frozen leaves it silent.
The guard then writes the frames that stop everything. It knows nothing else of the arm.

This file imports only what is quick to import; the guard runs it as a script.
"""

import os
import select
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress

AGAIN = 0.1  # s until the frames are written once more: a half frame may have eaten the first ones
LEAVING = 1.0  # s that a guard may take to leave


class GuardGone(Exception):
    """The guard has ended by itself; nobody would stop the arm."""


class Guard:
    """The driver's end: call `beat` at least every `silence` seconds until `close`.

    port: descriptor of the open port. frames: bytes that make the arm hold.
    """

    def __init__(self, port: int, silence: float, frames: bytes) -> None:
        read, self._pipe = os.pipe()
        os.set_blocking(self._pipe, False)  # a full pipe is word enough
        command = [sys.executable, "-I", "-S", __file__, str(port), str(silence), frames.hex()]
        # a session of its own: what is sent to the driver's group is not meant for the guard
        self._process = subprocess.Popen(
            command, stdin=read, pass_fds=(port,), start_new_session=True
        )
        os.close(read)

    @property
    def pid(self) -> int:
        """Of the guard's process."""
        return self._process.pid

    def beat(self) -> None:
        """The driver is alive. Raises GuardGone."""
        try:
            os.write(self._pipe, b".")
        except BlockingIOError:
            return
        except BrokenPipeError as error:
            raise GuardGone(f"the guard of the arm's port has ended: {error}") from error

    def close(self) -> None:
        """Let the guard tell the arm to hold, and leave."""
        os.close(self._pipe)
        try:
            self._process.wait(LEAVING)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def watch(pipe: int, silence: float, hold: Callable[[], None]) -> None:
    """Read beats until the pipe is closed; hold then, and once whenever no beat comes in time."""
    warned = False
    while True:
        heard, _, _ = select.select([pipe], [], [], None if warned else silence)
        if not heard:
            warned = True
            hold()
            continue
        if not os.read(pipe, 4096):
            hold()
            return
        warned = False


def main(port: int, silence: float, frames: bytes) -> None:
    """The guard's process: beats on stdin."""

    def hold() -> None:
        with suppress(OSError):  # a port that is gone moves no arm that we could stop
            os.write(port, frames)
            time.sleep(AGAIN)
            os.write(port, frames)

    watch(sys.stdin.fileno(), silence, hold)


if __name__ == "__main__":
    main(int(sys.argv[1]), float(sys.argv[2]), bytes.fromhex(sys.argv[3]))
