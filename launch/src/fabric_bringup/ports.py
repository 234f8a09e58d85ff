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
    if is_free(USUAL):
        return USUAL
    with socket.socket() as other:
        other.bind(("", 0))
        return other.getsockname()[1]


if __name__ == "__main__":
    print(choose())
