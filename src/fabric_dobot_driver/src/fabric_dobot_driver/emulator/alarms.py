# SPDX-License-Identifier: BSD-3-Clause
"""Alarms that the emulated arm raises, by their codes on the wire."""

from collections.abc import Iterable
from enum import IntEnum

BITS = 128


class Alarm(IntEnum):
    """Bits of the answer to id 20; the arm knows more than these."""

    RESET = 0x00
    UNDEFINED_INSTRUCTION = 0x01
    INVERSE_KINEMATICS = 0x11  # beyond reach
    OUT_OF_LIMIT = 0x12  # beyond a joint's limit
    ARC_PARAMETERS = 0x14
    JUMP_PARAMETERS = 0x15
    LINE_OUT_OF_SPACE = 0x17
    ARC_OUT_OF_SPACE = 0x18
    MOTION_TYPE = 0x19
    SPEED_PARAMETERS = 0x1A
    OVERSPEED = 0x30  # + axis, 0 to 3
    JOINT_LIMIT = 0x40  # + 2 axis, + 1 at the lower end; axis 4 is the parallelogram


def to_wire(codes: Iterable[int]) -> bytes:
    """16 bytes; alarm n is bit n % 8, lowest first, of byte n // 8."""
    return sum(1 << code for code in set(codes)).to_bytes(BITS // 8, "little")


def check(code: int) -> int:
    """The code.

    Raises ValueError when the arm has no such bit.
    """
    if not 0 <= code < BITS:
        raise ValueError(f"alarm {code:#x}, want 0 to {BITS - 1:#x}")
    return code
