# SPDX-License-Identifier: BSD-3-Clause
"""Which port a ROS master can have."""

from __future__ import annotations

import errno
import itertools
import socket
from collections.abc import Iterator
from contextlib import contextmanager

USUAL = 11311


def is_free(port: int) -> bool:
    """True if nobody listens on this TCP port of any of our addresses."""
    with socket.socket() as trial:
        trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            trial.bind(("", port))
        except OSError:
            return False
    return True


@contextmanager
def claimed() -> Iterator[int]:
    """The usual port of a ROS master if it is free, else any free one.

    Until the block ends nobody else gets it here, whether a master listens already or not: two
    graphs may start at once. The claim is a name in Linux' abstract namespace of sockets, which
    has one owner on the machine and goes with its process.
    """
    for port in itertools.chain([USUAL], iter(any_free, None)):
        with socket.socket(socket.AF_UNIX) as claim:
            try:
                claim.bind(f"\0fabric-ros-master-{port}")
            except OSError as error:
                if error.errno != errno.EADDRINUSE:
                    raise
                continue
            if is_free(port):
                yield port
                return


def any_free() -> int:
    """A free port that is nobody's first choice: for graphs that may start side by side."""
    with socket.socket() as other:
        other.bind(("", 0))
        return other.getsockname()[1]
