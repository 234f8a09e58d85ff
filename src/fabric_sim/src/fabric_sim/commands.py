# SPDX-License-Identifier: BSD-3-Clause
"""What the cell was told since its last tick, in an order that does not depend on the network.

Goals, cancellations and services arrive on different connections, so their order of arrival is
chance. They act together at the next tick: suction, then cancellations, then moves by number.
"""

from fabric_dobot_driver import Goal
from fabric_msgs.msg import MoveArmResult
from fabric_sim.arm import Arm, ArmResult
from fabric_sim.belt import Belt


class Commands:
    """Commands that wait for the next tick. conveyor: speed in m/s, ignore the sensor."""

    def __init__(self) -> None:
        self.suction: bool | None = None
        self.home = False
        self.conveyor: tuple[float, bool] | None = None
        self.moves: dict[int, Goal] = {}
        self.cancelled: set[int] = set()

    def apply(self, arm: Arm, belt: Belt) -> list[ArmResult]:
        """Carry out everything; return the moves that ended with it."""
        if self.suction is not None:
            arm.suction = self.suction
        if self.conveyor is not None:
            belt.command(*self.conveyor)
        results = arm.stop() if arm.number in self.cancelled else []
        if self.home:
            results += arm.home()
        for number in sorted(self.moves):
            if number in self.cancelled:
                results.append(ArmResult(number, MoveArmResult.PRE_EMPTED, "cancelled"))
            else:
                results += arm.start(number, self.moves[number])
        return results
