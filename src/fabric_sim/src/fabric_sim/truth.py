# SPDX-License-Identifier: BSD-3-Clause
"""The moment in the words of the robot's models (thesis Fig. 4.2 and 6.9).

A rule on the worker's state and on counters since the subtask started; the first row that applies
decides. Stage 1 says what may be wrong, stage 2 what the person would want, which is simply
whether help would be accepted at this moment.

    state                        condition                                 word
    success                                                                global_success
    failure                                                                global_fail
    task_assigned_to_robot                                                 task_assigned_to_robot
    warns_the_robot                                                        warning_received
    robot_receives_the_warning                                             does_not_need_help
    robot_interfered             (help was accepted)                       needs_help
    recovery, or walking away                                              needs_help
    tired                        steps tired < stage_two_after             may_be_tired
                                 else                                      by acceptance
    no_attention                 steps distracted < stage_two_after        may_be_distracted
                                 else                                      needs_to_be_reminded
    failed_to_grasp, or grasping failures < stage_two_after                may_not_be_capable
    again after a failure        else                                      by acceptance
    task_assigned, evaluating    a failure in this subtask                 may_not_be_capable
                                 grasping, or evaluated <= patience        the person is at work
                                 was tired in this subtask                 may_be_tired
                                 was distracted in this subtask            may_be_distracted
                                 else (stalls for no visible reason)       by the weakest dial

    by acceptance: needs_help if the person would accept help now, else does_not_need_help.
    the person is at work: inspection task_assigned_to_human; sorting may_not_be_capable after
    stage_two_after wrong trays in a row, human_doing_ok if the person's last cube went right,
    else task_assigned_to_human.
    failures: failed attempts in this subtask; in sorting a wrong tray is one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from .worker_parameters import TruthParameters

ANTICIPATED = (
    "task_assigned_to_human", "may_not_be_capable", "may_be_tired", "may_be_distracted",
    "needs_to_be_reminded", "needs_help", "does_not_need_help", "human_doing_ok",
    "warning_received", "task_assigned_to_robot", "global_success", "global_fail",
)  # fmt: skip

_FIXED = {
    "success": "global_success",
    "failure": "global_fail",
    "task_assigned_to_robot": "task_assigned_to_robot",
    "warns_the_robot": "warning_received",
    "robot_receives_the_warning": "does_not_need_help",
    "robot_interfered": "needs_help",
    "recovery": "needs_help",
}

_WEAKNESS = {
    "expertise": "may_not_be_capable",
    "stamina": "may_be_tired",
    "attention": "may_be_distracted",
}


@dataclass
class Counters:
    """Steps since the subtask started (a step is one action), and how the last cubes went."""

    evaluated: int = 0
    failed: int = 0
    distracted: int = 0
    tired: int = 0
    wrong_in_a_row: int = 0
    last_was_right: bool = False

    def next_subtask(self) -> None:
        """Reset what belongs to a subtask; how the last cubes went is kept until the task ends."""
        self.evaluated = self.failed = self.distracted = self.tired = 0

    def placed(self, correct: bool) -> None:
        """Take note of a cube that the person put into a tray."""
        self.last_was_right = correct
        self.wrong_in_a_row = 0 if correct else self.wrong_in_a_row + 1
        self.failed += not correct

    def step(self, state: str, action: str) -> None:
        """Count a step that begins now."""
        if state == "evaluating" and action != "grasp":
            self.evaluated += 1
        elif state == "no_attention":
            self.distracted += 1
        elif state == "tired":
            self.tired += 1


class Truth(NamedTuple):
    """The hidden state of a worker, in the fields of fabric_msgs/GroundTruth."""

    human_type: str
    state: str
    action: str
    anticipated_state: str
    expertise: float
    stamina: float
    attention: float
    collaborativeness: float
    interferences: int
    tasks_done: int


def anticipated_state(
    state: str,
    action: str,
    counters: Counters,
    accepts: float,
    weakest: str,
    sorting: bool,
    p: TruthParameters,
) -> str:
    """Return one of ANTICIPATED by the table above.

    accepts: probability that the person would accept help now. weakest: the lowest of the dials
    expertise, stamina, attention.
    """
    fixed = _FIXED.get(state)
    if fixed or action == "walk_away":
        return fixed or "needs_help"
    by_acceptance = "needs_help" if accepts >= p.wants_help else "does_not_need_help"
    if state == "tired":
        return "may_be_tired" if counters.tired < p.stage_two_after else by_acceptance
    if state == "no_attention":
        early = counters.distracted < p.stage_two_after
        return "may_be_distracted" if early else "needs_to_be_reminded"
    if state == "failed_to_grasp" or (action == "grasp" and counters.failed):
        return "may_not_be_capable" if counters.failed < p.stage_two_after else by_acceptance
    return _at_work(action, counters, weakest, sorting, p)


def _at_work(action: str, c: Counters, weakest: str, sorting: bool, p: TruthParameters) -> str:
    """Return the word for somebody who is assigned the task or evaluates it."""
    if c.failed:
        return "may_not_be_capable"
    if action == "grasp" or c.evaluated <= p.patience:
        if sorting and c.wrong_in_a_row >= p.stage_two_after:
            return "may_not_be_capable"
        return "human_doing_ok" if sorting and c.last_was_right else "task_assigned_to_human"
    if c.tired:
        return "may_be_tired"
    if c.distracted:
        return "may_be_distracted"
    return _WEAKNESS[weakest]
