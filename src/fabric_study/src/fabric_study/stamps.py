# SPDX-License-Identifier: BSD-3-Clause
"""Seconds and message stamps, both to the microsecond."""

import math
from typing import Any

import genpy

from fabric_msgs.clock import micro, seconds_of, stamp_of


def to_stamp(t: float) -> genpy.Time:
    """Return `t` s as a stamp; Time.from_sec would cut 12.35 s to 12.349999999 s."""
    return stamp_of(t)


def to_seconds(message: Any) -> float:
    """Return the stamp of a message with a header, s."""
    return seconds_of(message)


def checked(t: float) -> float:
    """Return `t` to the microsecond. Raises ValueError when it is not finite."""
    if not math.isfinite(t):
        raise ValueError(f"time is {t}")
    return micro(t)
