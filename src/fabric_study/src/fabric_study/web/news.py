# SPDX-License-Identifier: BSD-3-Clause
"""The newest of what the graph tells, as the console shows it. No ROS, no threads, no clock."""

import math
from collections import deque
from collections.abc import Iterable
from typing import Any

from fabric_msgs.msg import (
    Decision,
    Heartbeat,
    ModelInfo,
    PolicyChoice,
    RobotActionState,
    SafetyState,
    TypeBelief,
)
from fabric_study.readiness import Readiness

DECISIONS = 6  # that are shown
SILENCE = 3.0  # s without a heartbeat, of which ten a second come
ACTIONS = {
    Decision.IDLE: "idle",
    Decision.PLANNING: "planning",
    Decision.POINT: "point",
    Decision.GRASP: "grasp",
    Decision.CANCEL: "cancel",
    RobotActionState.NONE: "none",
}
PHASES = ("rest", "approach", "contact", "carry", "retreat")
SAFETY = {SafetyState.RUN: "run", SafetyState.SLOW: "slow", SafetyState.STOP: "stop"}


class News:
    """Takes messages in, gives sections of the console out; times are s of one steady clock."""

    def __init__(self, nodes: Iterable[str]) -> None:
        """nodes: names in heartbeats that must be there before a task can begin."""
        self._nodes = tuple(nodes)
        self._readiness = Readiness(self._nodes)
        self._heard: dict[str, float] = {}
        self._models: dict[str, ModelInfo] = {}
        self._model: ModelInfo | None = None
        self._decisions: deque[Decision] = deque(maxlen=DECISIONS)
        self._choice: PolicyChoice | None = None
        self._types: TypeBelief | None = None
        self._safety: tuple[float, SafetyState] | None = None
        self._robot: RobotActionState | None = None

    def on_heartbeat(self, t: float, beat: Heartbeat) -> None:
        """A node is alive."""
        self._heard[beat.node] = t
        self._readiness.heard(beat)

    def on_model(self, info: ModelInfo) -> None:
        """The planner runs another model."""
        self._models[info.hash] = self._model = info

    def on_decision(self, decision: Decision) -> None:
        """The planner has decided."""
        self._decisions.appendleft(decision)

    def on_choice(self, choice: PolicyChoice) -> None:
        """ABPS has chosen."""
        self._choice = choice

    def on_types(self, belief: TypeBelief) -> None:
        """ABPS believes something else about the person."""
        self._types = belief

    def on_safety(self, t: float, state: SafetyState) -> None:
        """The motion node watches."""
        self._safety = t, state

    def on_robot(self, state: RobotActionState) -> None:
        """The robot does something."""
        self._robot = state

    def new_task(self) -> None:
        """Forget the decisions of the task before."""
        self._decisions.clear()

    def missing(self, t: float) -> list[str]:
        """Return what must still come before a task can begin, in words."""
        silent = [n for n in self._nodes if t - self._heard.get(n, t) > SILENCE]
        return self._readiness.missing() + [f"node {name} has fallen silent" for name in silent]

    def sections(self, t: float) -> dict[str, Any]:
        """Return the console's sections about the graph at time t."""
        return {
            "belief": self._belief(),
            "decisions": [self._shown(decision) for decision in self._decisions],
            "policy": self._policy(),
            "types": self._type_belief(),
            "safety": self._safety_state(t),
            "robot": self._robot_state(),
            "health": self._health(t),
        }

    def _belief(self) -> dict[str, Any] | None:
        """None before the first decision of a task, or while its model's names are not known."""
        if not self._decisions:
            return None
        newest = self._decisions[0]
        info = self._models.get(newest.model_hash)
        if info is None or len(info.states) != len(newest.belief):
            return None
        states = [[name, _rounded(p)] for name, p in zip(info.states, newest.belief, strict=True)]
        return {"model": info.name, "states": states}

    def _shown(self, decision: Decision) -> dict[str, Any]:
        flags = {
            "deadline missed": decision.deadline_missed,
            "fallback": decision.fallback_used,
            "belief recovered": decision.belief_recovered,
        }
        return {
            "sequence": decision.sequence,
            "action": ACTIONS.get(decision.action, str(decision.action)),
            "value": _rounded(decision.value),
            "gap": None if decision.runner_up < 0 else _rounded(decision.runner_up_gap),
            "planning_ms": _rounded(1000.0 * decision.planning_time),
            "flags": [name for name, raised in flags.items() if raised],
        }

    def _policy(self) -> dict[str, Any]:
        choice = self._choice
        scores = zip(choice.candidates, choice.score, strict=False) if choice else ()
        return {
            "model": self._model.name if self._model else "",
            "chosen": choice.policy if choice else "",
            "reason": choice.reason if choice else "",
            "unlike_anyone_known": bool(choice and choice.unlike_anyone_known),
            "candidates": sorted(
                ([name, _rounded(score)] for name, score in scores),
                key=lambda pair: -math.inf if pair[1] is None else pair[1],
                reverse=True,
            ),
        }

    def _type_belief(self) -> dict[str, Any] | None:
        if self._types is None:
            return None
        pairs = zip(self._types.types, self._types.probability, strict=False)
        types = sorted(([name, _rounded(p)] for name, p in pairs), key=lambda pair: -(pair[1] or 0))
        return {"entropy": _rounded(self._types.entropy), "types": types}

    def _safety_state(self, t: float) -> dict[str, Any] | None:
        if self._safety is None:
            return None
        heard, state = self._safety
        return {
            "state": SAFETY.get(state.state, "stop"),
            "cause": state.cause,
            "age": _tenths(t - heard),
            "watched": [
                [n, _tenths(age)] for n, age in zip(state.watched, state.age, strict=False)
            ],
            "separation": _rounded(state.separation),
        }

    def _robot_state(self) -> dict[str, Any] | None:
        if self._robot is None:
            return None
        phase = self._robot.phase
        return {
            "action": ACTIONS.get(self._robot.current, "none"),
            "phase": PHASES[phase] if phase < len(PHASES) else str(phase),
            "holding": bool(self._robot.holding),
        }

    def _health(self, t: float) -> dict[str, Any]:
        names = [*self._nodes, *sorted(set(self._heard) - set(self._nodes))]
        ages = [[n, _tenths(t - self._heard[n]) if n in self._heard else None] for n in names]
        return {"nodes": ages, "missing": self.missing(t)}


def _rounded(value: float) -> float | None:
    """To four digits behind the point; what is not finite is None."""
    return round(value, 4) if math.isfinite(value) else None


def _tenths(value: float) -> float | None:
    return round(max(value, 0.0), 1) if math.isfinite(value) else None
