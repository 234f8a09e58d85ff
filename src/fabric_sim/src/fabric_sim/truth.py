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
    any other, in this order     grasping, failed before                   by acceptance
                                 grasping                                  the person is at work
                                 failed, again or long ago                 by acceptance
                                 failed                                    may_not_be_capable
    tired                        steps tired <= stage_one                  may_be_tired
                                 else                                      by acceptance
    no_attention, or looking     steps distracted <= stage_one             may_be_distracted
    around                       steps distracted <= reminders             needs_to_be_reminded
                                 else                                      by acceptance
    task_assigned, evaluating                                              the person is at work

    by acceptance: needs_help if the person would accept help now, else does_not_need_help.
    the person is at work: inspection task_assigned_to_human; sorting may_not_be_capable after
    `failures` wrong trays in a row, human_doing_ok if the person's last cube went right, else
    task_assigned_to_human.
    failed, again or long ago: `failures` times, or more than stage_one steps without a new attempt.
    failed: attempts in this subtask that came to nothing, a wrong tray when sorting. A warning
    wipes all counters: who says stop wants to begin again.
"""

from __future__ import annotations

from collections.abc import Callable
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


@dataclass
class Counters:
    """Steps of trouble with this cube (a step is one action), and how the last cubes went."""

    failed: int = 0
    gave_up: int = 0  # since the last failure
    distracted: int = 0
    tired: int = 0
    wrong_in_a_row: int = 0
    last_was_right: bool = False

    def begin_again(self) -> None:
        """Forget trouble, with the next cube or after a warning; the last cubes are remembered."""
        self.failed = self.gave_up = self.distracted = self.tired = 0

    def placed(self, correct: bool) -> None:
        """Take note of a cube that the person put into a tray."""
        self.last_was_right = correct
        self.wrong_in_a_row = 0 if correct else self.wrong_in_a_row + 1
        self.failed += not correct

    def step(self, state: str, action: str) -> None:
        """Count a step that begins now; who reaches for the cube is at work again."""
        if action == "grasp":
            self.gave_up = self.distracted = self.tired = 0
            return
        self.gave_up += self.failed > 0
        if state == "no_attention" or action == "look_around":
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
    accepts: Callable[[], float],
    sorting: bool,
    p: TruthParameters,
) -> str:
    """Return one of ANTICIPATED by the table above.

    accepts: the probability that the person would accept help now, asked for where it decides.
    """
    word = _plain_word(state, action, counters, sorting, p)
    if word is None:
        word = "needs_help" if accepts() >= p.wants_help else "does_not_need_help"
    return word


def _plain_word(
    state: str, action: str, counters: Counters, sorting: bool, p: TruthParameters
) -> str | None:
    """Return the word by the table above, or None where it depends on the acceptance of help."""
    fixed = _FIXED.get(state)
    if fixed or action == "walk_away":
        return fixed or "needs_help"
    if action == "grasp":
        return None if counters.failed else _at_work(counters, sorting, p)
    if counters.failed:
        lasts = counters.failed >= p.failures or counters.gave_up > p.stage_one
        return None if lasts else "may_not_be_capable"
    if state == "tired":
        return "may_be_tired" if counters.tired <= p.stage_one else None
    if state == "no_attention" or action == "look_around":
        if counters.distracted <= p.stage_one:
            return "may_be_distracted"
        return "needs_to_be_reminded" if counters.distracted <= p.reminders else None
    return _at_work(counters, sorting, p)


def _at_work(c: Counters, sorting: bool, p: TruthParameters) -> str:
    """Return the word for somebody who works or is about to."""
    if not sorting:
        return "task_assigned_to_human"
    if c.wrong_in_a_row >= p.failures:
        return "may_not_be_capable"
    return "human_doing_ok" if c.last_was_right else "task_assigned_to_human"
