# SPDX-License-Identifier: BSD-3-Clause
"""Which port a ROS master can have."""

from __future__ import annotations

import socket

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


def choose() -> int:
    """The usual port of a ROS master if it is free, else any free one."""
    return USUAL if is_free(USUAL) else any_free()


def any_free() -> int:
    """A free port that is nobody's first choice: for graphs that may start side by side."""
    with socket.socket() as other:
        other.bind(("", 0))
        return other.getsockname()[1]


if __name__ == "__main__":
    print(choose())
