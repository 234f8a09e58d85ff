# SPDX-License-Identifier: BSD-3-Clause
"""The server's side of the action `arm/move`, whatever arm is behind it."""

from abc import ABC, abstractmethod

import actionlib
from actionlib import GoalStatus, ServerGoalHandle
from actionlib_msgs.msg import GoalID

from fabric_msgs.msg import MoveArmAction, MoveArmResult

REFUSED = (MoveArmResult.INVALID, MoveArmResult.UNREACHABLE)


class MoveArmServer(actionlib.ActionServer, ABC):
    """Call `start` when ready. To be written: `on_goal` and `on_cancel`, which never wait.

    A cancellation that overtakes its goal is kept until the goal is there; the action library would
    answer at once, with a result that nobody filled in.
    """

    def __init__(self) -> None:
        self._early: set[str] = set()  # ids of goals whose cancellation overtook them
        super().__init__("arm/move", MoveArmAction, self._on_goal, self.on_cancel, False)

    @abstractmethod
    def on_goal(self, handle: ServerGoalHandle) -> bool:
        """Take a goal; return False when it was refused."""

    @abstractmethod
    def on_cancel(self, handle: ServerGoalHandle) -> None:
        """Stop a goal that was taken; its end is told later."""

    def internal_cancel_callback(self, goal_id: GoalID) -> None:
        """Called by the action library with every cancellation."""
        with self.lock:
            known = any(entry.status.goal_id.id == goal_id.id for entry in self.status_list)
            if goal_id.id and not known:
                self._early.add(goal_id.id)
                return
        super().internal_cancel_callback(goal_id)

    @staticmethod
    def accept(handle: ServerGoalHandle) -> None:
        """Say that it is under way."""
        if handle.get_goal_status().status == GoalStatus.PENDING:
            handle.set_accepted()

    @staticmethod
    def end(handle: ServerGoalHandle, outcome: int, reason: str) -> None:
        """Say how it ended: MoveArmResult.*, and words."""
        result = MoveArmResult(outcome, reason)
        if outcome in REFUSED:
            handle.set_rejected(result, reason)
            return
        MoveArmServer.accept(handle)
        if outcome == MoveArmResult.REACHED:
            handle.set_succeeded(result)
        elif outcome == MoveArmResult.PRE_EMPTED:
            handle.set_canceled(result, reason)
        else:
            handle.set_aborted(result, reason)

    def _on_goal(self, handle: ServerGoalHandle) -> None:
        taken = self.on_goal(handle)
        key = handle.get_goal_id().id
        if key in self._early:
            self._early.remove(key)
            if taken:
                handle.set_cancel_requested()
                self.on_cancel(handle)
