# SPDX-License-Identifier: BSD-3-Clause
"""What a watched worker can be at: the pieces of behaviour of the worker MDP, and how each looks.

A mode is a pair of state and action of Fig. 6.28, or a part of an action that looks or ends
differently (reaching, carrying, walking off). In a mode a person stays for a time from Table 6.7,
so the modes are the states of a hidden semi-Markov model.
"""

from __future__ import annotations

from dataclasses import dataclass

from fabric_sim.experiments.trials import ABSENT, GRASP, IDLE, LOOK, WALK, WARN

#: Steps of distraction that are told apart: help is welcome the longer it lasts.
STAGES = 7
#: States after a failed attempt; the hands return before anything else begins.
LET_GO_TO = ("failed_to_grasp", "tired", "evaluating")
GRASPED_FROM = ("evaluating", "failed_to_grasp", "tired")


@dataclass(frozen=True)
class Mode:
    """One piece of behaviour.

    state: of the worker MDP. looks: symbol an ideal camera sees. span: name of the duration in
    worker.yaml, "" for a mode that lasts until something else ends it. slowed: by weariness and
    inexperience. origin: where the robot interrupts it (4.3.2), "" when it cannot. fresh: a gesture
    of its own, even after an equal one.
    """

    name: str
    state: str
    looks: int
    span: str
    slowed: bool = True
    origin: str = ""
    fresh: bool = False
    stage: int = 0

    @property
    def hesitates(self) -> bool:
        """Whether it lasts longer for somebody who does not know the tray."""
        return bool(self.span) and (self.name.endswith(".idle") or self.name == "warned")


def _thinking(state: str, name: str, stage: int = 0) -> list[Mode]:
    seen = ("task_assigned", "evaluating", "no_attention", "failed_to_grasp")
    lost = state == "no_attention"  # in thought: the eyes are elsewhere
    looks, span = (LOOK, "look_around") if lost else (IDLE, "idle")
    modes = [Mode(f"{name}.idle", state, looks, span, origin=state, stage=stage)]
    if state in seen:
        modes.append(
            Mode(f"{name}.look_around", state, LOOK, "look_around", origin=state, stage=stage)
        )
    return modes


def _modes() -> tuple[Mode, ...]:
    modes = [Mode("waits", "task_assigned", IDLE, "")]
    for state in ("task_assigned", "evaluating", "failed_to_grasp", "tired"):
        modes += _thinking(state, state)
    for stage in range(1, STAGES + 1):
        modes += _thinking("no_attention", f"no_attention{stage}", stage)
    for state in GRASPED_FROM:
        again = "trying_again" if state == "failed_to_grasp" else "grasping"
        modes.append(Mode(f"{state}.reach", state, GRASP, "reach", origin=again, fresh=True))
        modes.append(
            Mode(f"{state}.fail", state, GRASP, "failed_attempt", origin=again, fresh=True)
        )
    for state in LET_GO_TO:
        modes.append(Mode(f"let_go.{state}", state, IDLE, "retreat", origin=state))
    modes += [
        Mode("carry", "evaluating", GRASP, "carry"),
        Mode("placed", "evaluating", GRASP, "retreat"),
        Mode("placed.idle", "evaluating", IDLE, ""),
        # the next cube has come before the tray reported this one
        Mode("early.idle", "task_assigned", IDLE, "idle", origin="task_assigned"),
        Mode("early.look_around", "task_assigned", LOOK, "look_around", origin="task_assigned"),
        Mode("retreat", "task_assigned", GRASP, "retreat"),
        Mode("leave", "tired", WALK, "leave", slowed=False),
        Mode("rest", "recovery", ABSENT, "rest", slowed=False),
        Mode("come_back", "recovery", ABSENT, "come_back", slowed=False),
        Mode("watch", "robot_interfered", IDLE, ""),
        Mode("settle", "robot_interfered", IDLE, "settle", slowed=False),
        Mode("warn", "warns_the_robot", WARN, "warn", slowed=False, fresh=True),
        Mode(
            "warned", "robot_receives_the_warning", IDLE, "idle",
            origin="robot_receives_the_warning",
        ),
    ]  # fmt: skip
    return tuple(modes)


MODES = _modes()

#: What a mode becomes when the tray reports the cube.
REPORTED = {
    "placed": "retreat",
    "early.idle": "task_assigned.idle",
    "early.look_around": "task_assigned.look_around",
}
INDEX = {mode.name: index for index, mode in enumerate(MODES)}


@dataclass(frozen=True)
class Appearance:
    """A mode as the recogniser takes it: `mode` an index of MODES, `shown` a symbol."""

    mode: int
    shown: int
    chance: float
    variant: int


def appearances(confusion: float, swap_share: float) -> list[Appearance]:
    """Return every mode with each of the ways it may be recognised, as sensing.py confuses them."""
    swapped = {GRASP: WARN, WARN: GRASP}
    turned = {IDLE: LOOK, LOOK: IDLE, WALK: LOOK}
    found = []
    for index, mode in enumerate(MODES):
        ways = [(mode.looks, 1.0)]
        if mode.looks in swapped:
            swap = confusion * swap_share
            ways = [
                (mode.looks, 1.0 - confusion),
                (swapped[mode.looks], swap),
                (IDLE, confusion - swap),
            ]
        elif mode.looks in turned:
            ways = [(mode.looks, 1.0 - confusion), (turned[mode.looks], confusion)]
        found += [Appearance(index, shown, p, v) for v, (shown, p) in enumerate(ways)]
    return found


def same_stretch(before: Mode, after: Mode) -> bool:
    """Whether a recogniser sees both modes as one stretch, right or wrong as a whole."""
    return before.looks == after.looks and not after.fresh
