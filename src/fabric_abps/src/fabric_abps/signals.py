# SPDX-License-Identifier: BSD-3-Clause
"""The type observation vector sigma (5.2.2.2): six booleans, packed into a code 0..63.

Bit 0 detected, 1 looking around, 2 grasp succeeded, 3 grasp failed, 4 warning, 5 idle.
"""

from typing import Any

N_CODES = 64
BITS = ("detected", "looking around", "grasp succeeded", "grasp failed", "warning", "idle")


def pack(
    detected: bool, looking: bool, succeeded: bool, failed: bool, warning: bool, idle: bool
) -> int:
    """The code of the six booleans, 0..63."""
    seen = bool(detected) | bool(looking) << 1 | bool(succeeded) << 2
    return seen | bool(failed) << 3 | bool(warning) << 4 | bool(idle) << 5


def code_name(code: int) -> str:
    """The code in words, e.g. 'detected, idle'."""
    if not 0 <= code < N_CODES:
        raise ValueError(f"code {code} is outside 0..{N_CODES - 1}")
    return ", ".join(name for bit, name in enumerate(BITS) if code >> bit & 1) or "nobody there"


class SignalEncoder:
    """Turns Observation messages of one task into codes.

    A grasp has failed when the person misplaced a cube (O9) or when the count of attempts without
    a placement has gone up since the observation before.
    """

    def __init__(self) -> None:
        self._failed_attempts = 0

    def encode(self, observation: Any) -> int:
        """The code of the next observation; anything with the fields of fabric_msgs/Observation."""
        attempts = int(observation.failed_attempts)
        failed = observation.subtask_failure or attempts > self._failed_attempts
        self._failed_attempts = attempts
        return pack(
            observation.detected,
            observation.looking_around,
            observation.subtask_success,
            failed,
            observation.warning,
            observation.idle,
        )
