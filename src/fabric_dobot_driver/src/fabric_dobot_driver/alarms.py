# SPDX-License-Identifier: BSD-3-Clause
"""What the arm's alarms mean for a goal and what cures them. Names are those of pydobotlab."""

from collections.abc import Iterable

from pydobotlab.alarms import Alarm, AlarmSet, decode_alarms, label_unmapped_alarm

__all__ = ["NONE", "Alarm", "AlarmSet", "cures", "decode_alarms", "names", "unhomes", "unreachable"]

NONE = decode_alarms(b"")
CURES = {  # by group, the upper half of the code
    0x00: "clear the alarms; if it comes again, switch the arm off and on, then home it",
    0x10: "the goal cannot be planned: clear the alarms, choose another goal",
    0x20: "the path cannot be followed: clear the alarms, choose another path",
    0x30: "a joint was too fast: clear the alarms, lower speed or acceleration",
    0x40: "a joint stands at its limit: hold the button on the forearm, move it back by hand",
    0x50: "a joint lost steps: remove what blocks it, then home the arm",
}
OTHER = "see the list of alarms of the manufacturer; switch the arm off and on if it comes again"
NOT_REACHED = (0x10, 0x20)  # groups that tell of the goal, not of the arm
POSITION_LOST = 0x50


def names(alarms: Iterable[int]) -> list[str]:
    """Names of the alarms, the code where there is none."""
    return [code.name if isinstance(code, Alarm) else label_unmapped_alarm(code) for code in alarms]


def cures(alarms: Iterable[int]) -> list[str]:
    """What to do about each alarm, in words."""
    return [CURES.get(code & 0xF0, OTHER) for code in alarms]


def unreachable(alarms: Iterable[int]) -> bool:
    """Whether all alarms say that the goal, not the arm, is at fault."""
    return all(code & 0xF0 in NOT_REACHED for code in alarms)


def unhomes(alarms: Iterable[int]) -> bool:
    """Whether the arm no longer knows where it is: it was reset, or lost steps."""
    return any(code == Alarm.PUBLIC_RESET or code & 0xF0 == POSITION_LOST for code in alarms)
