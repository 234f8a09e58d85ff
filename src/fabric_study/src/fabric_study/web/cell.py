# SPDX-License-Identifier: BSD-3-Clause
"""What the desk asks of the graph: the seam that the ROS node fills, and tests fake."""

from dataclasses import dataclass
from typing import Any, Protocol


@dataclass(frozen=True)
class TaskGoal:
    """One task as it is asked of the graph; the fields of the action RunTask."""

    task_id: int
    definition: str
    seed: int
    policy: str


class Cell(Protocol):
    """The graph. Nothing here waits; what is awaited does so in another thread."""

    def missing(self) -> list[str]:
        """Return what must still come before a task can begin, in words."""

    def run_task(self, goal: TaskGoal) -> None:
        """Ask for a task; what comes of it is told to the desk (`TaskDesk.on_...`)."""

    def cancel_task(self) -> None:
        """Ask for the end of the running task."""

    def can_call(self) -> bool:
        """Say whether the robot can be called for help."""

    def sections(self) -> dict[str, Any]:
        """Return what the console shows of the graph, by section."""

    async def command(self, name: str, text: str = "") -> None:
        """stop, release, call, note (its text) or person (whose code is told to ABPS).

        Raises Refused with the reason.
        """
