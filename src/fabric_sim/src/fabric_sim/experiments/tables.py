# SPDX-License-Identifier: BSD-3-Clause
"""The worker MDPs of many characters as hidden semi-Markov models over modes and their looks.

Everything comes from WorkerModel (policy, T given that nobody interferes, refusal) and from
worker.yaml (durations, responses, memory); nothing is fitted here. Shapes: B characters, M modes,
V appearances (a mode with the way it is recognised), K flat states (an appearance with the number
of ticks that it goes on for).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from fabric_sim.character import Character
from fabric_sim.experiments.modes import (
    GRASPED_FROM,
    INDEX,
    LET_GO_TO,
    MODES,
    STAGES,
    Appearance,
    appearances,
    same_stretch,
)
from fabric_sim.experiments.trials import GRASP, IDLE, LOOK, SYMBOLS, TICK
from fabric_sim.experiments.watching import Watching, tick_distribution
from fabric_sim.worker_model import ACTION_INDEX, STATE_INDEX, ModelLibrary, WorkerModel
from fabric_sim.worker_parameters import STATES, WorkerParameters
from fabric_sim.worker_responses import refusal_probability

_THINKING = ("task_assigned", "evaluating", "failed_to_grasp", "tired")


class Layout:
    """Where the appearances of the modes lie among the flat states; common to all characters."""

    def __init__(self, parameters: WorkerParameters, watching: Watching, scenario: str) -> None:
        s = watching.sensing
        self.timing = getattr(parameters.timing, scenario)
        self.looks: list[Appearance] = appearances(s.confusion, s.swap_share)
        self.mode = np.array([look.mode for look in self.looks])
        self.shown = np.array([look.shown for look in self.looks])
        self.chance = np.array([look.chance for look in self.looks])
        slowest = 1.0 + sum(abs(w) for w in self.timing.slowness.values())
        pause = slowest * (1.0 + parameters.memory.hesitation * (scenario == "sorting"))
        self.ticks = np.array([self._ticks(mode, slowest, pause) for mode in self.mode])
        self.start = np.concatenate(([0], np.cumsum(self.ticks)))[:-1]
        self.of_state = np.repeat(np.arange(len(self.looks)), self.ticks)
        self.last = self.start + self.ticks - 1
        self.carry_on = self._carry_on(watching.hidden)

    def _ticks(self, mode: int, slowest: float, pause: float) -> int:
        m = MODES[mode]
        if not m.span:
            return 1
        factor = (pause if m.hesitates else slowest) if m.slowed else 1.0
        return math.ceil(getattr(self.timing, m.span).most * factor / TICK) + 1

    def _carry_on(self, hidden: float) -> np.ndarray:
        """(V, V): chance of an appearance of the next mode, given that mode and the last one."""
        table = np.zeros((len(self.looks), len(self.looks)))
        for i, before in enumerate(self.looks):
            for j, after in enumerate(self.looks):
                same = float(before.variant == after.variant)
                if not same_stretch(MODES[before.mode], MODES[after.mode]):
                    table[i, j] = after.chance
                elif MODES[after.mode].name == "carry":
                    table[i, j] = (1.0 - hidden) * same + hidden * (after.shown == IDLE)
                else:
                    table[i, j] = same
        return table

    def spread(self, by_mode: np.ndarray) -> np.ndarray:
        """Return (B, V, V) between appearances from (B, M, M) between modes."""
        return by_mode[:, self.mode[:, None], self.mode[None, :]] * self.carry_on

    def seen(self, symbol: int, slip: float) -> np.ndarray:
        """P(symbol | appearance), (V,)."""
        return (1.0 - slip) * (self.shown == symbol) + slip / len(SYMBOLS)

    def looking(self) -> np.ndarray:
        """(V,): whether the person really looks elsewhere, and so notices late."""
        return np.array([MODES[mode].looks == LOOK for mode in self.mode])


class Tables:
    """Everything the filter needs of B characters in one scenario.

    free, grasped: (B, V, V) where a mode leads when it ends, the second while the robot grasps.
    grasp, planning, point: (B, V, V) where noticing the robot leads, rows sum to the chance that it
    matters. start: (B, V) for a cube that is there.
    """

    def __init__(
        self,
        characters: Sequence[Character],
        parameters: WorkerParameters,
        library: ModelLibrary,
        watching: Watching,
        scenario: str,
    ) -> None:
        self.parameters, self.watching, self.scenario = parameters, watching, scenario
        self.sorting = scenario == "sorting"
        self.characters = list(characters)
        self.layout = Layout(parameters, watching, scenario)
        self.models: list[WorkerModel] = [library.build(c) for c in characters]
        self.policy = np.stack([model.policy for model in self.models])
        self.now = np.stack([model.now for model in self.models])
        self._decided = {key: self._decide(key) for key in self._keys()}
        spread = self.layout.spread
        self.free = spread(self._after(grasping=False))
        self.grasped = spread(self._after(grasping=True))
        self.grasp = spread(self._answer_to_grasp())
        self.planning = spread(self._answer_to_planning())
        self.point = spread(self._answer_to_pointing())
        self.start = self._decided["task_assigned"][:, self.layout.mode] * self.layout.chance
        self.waiting = self._only("waits")[self.layout.mode] * self.layout.chance

    @property
    def size(self) -> int:
        """B."""
        return len(self.characters)

    @cached_property
    def slowness(self) -> np.ndarray:
        """(B,): the factor on thinking and handling."""
        weights = self.layout.timing.slowness.items()
        return np.array(
            [1.0 + sum(w * c.influence(name) for name, w in weights) for c in self.characters]
        )

    def _influence(self, name: str) -> np.ndarray:
        return np.array([c.influence(name) for c in self.characters])

    # -- what comes after a mode ------------------------------------------------------------------

    @staticmethod
    def _only(name: str) -> np.ndarray:
        return np.eye(len(MODES))[INDEX[name]]

    @staticmethod
    def _keys() -> list[str]:
        return [*_THINKING, *(f"no_attention{n}" for n in range(1, STAGES + 1))]

    def _decide(self, key: str) -> np.ndarray:
        """(B, M): the mode that somebody begins who decides now; `key` names state and stage."""
        state = key.rstrip("0123456789")
        s = STATE_INDEX[state]
        chosen = np.zeros((self.size, len(MODES)))
        for action, index in ACTION_INDEX.items():
            p = self.policy[:, s, index]
            if action == "grasp" and state in GRASPED_FROM:
                lifts = self._lifts(s)
                chosen[:, INDEX[f"{state}.reach"]] += p * lifts
                chosen[:, INDEX[f"{state}.fail"]] += p * (1.0 - lifts)
            elif action == "walk_away":
                chosen[:, INDEX["leave"]] += p
            elif f"{key}.{action}" in INDEX:
                chosen[:, INDEX[f"{key}.{action}"]] += p
            else:
                chosen[:, INDEX[f"{key}.idle"]] += p
        return chosen

    def _lifts(self, s: int) -> np.ndarray:
        """(B,): a grasp lifts what is there; light cubes always."""
        if self.sorting:
            return np.ones(self.size)
        return self.now[:, ACTION_INDEX["grasp"], s, STATE_INDEX["success"]]

    def _arrive(self, row: np.ndarray, stage: int = 0) -> np.ndarray:
        """(B, M): the modes begun after a draw of the next state; row: (B, S), sums to anything.

        stage: of the distraction so far. States in which nobody decides count as evaluating.
        """
        begun = np.zeros((self.size, len(MODES)))
        for s, state in enumerate(STATES):
            weight = row[:, s : s + 1]
            if state == "no_attention":
                begun += weight * self._decided[f"no_attention{min(STAGES, stage + 1)}"]
            elif state == "recovery":
                begun += weight * self._only("rest")
            elif state == "robot_receives_the_warning":
                begun += weight * self._only("warned")
            else:
                begun += weight * self._decided[state if state in _THINKING else "evaluating"]
        return begun

    def _after(self, grasping: bool) -> np.ndarray:
        """(B, M, M): the next mode when one ends, beside a robot that grasps or does not."""
        P = np.zeros((self.size, len(MODES), len(MODES)))
        for index, mode in enumerate(MODES):
            P[:, index] = self._next(mode.name, mode.state, mode.stage, grasping)
        return P

    def _next(self, name: str, state: str, stage: int, grasping: bool) -> np.ndarray:
        only, again = self._only, self.watching.wait / TICK
        action = name.split(".")[-1]
        if name == "waits":
            return only("waits") * (1.0 - 1.0 / again) + self._decided["task_assigned"] / again
        if name == "placed.idle":
            return only(name) * (1.0 - 1.0 / again) + self._early() / again
        if name in ("placed", "retreat"):
            return self._hand_back(name, 1.0 - (1.0 - 1.0 / again) ** self._retreat_ticks)
        if action in ("idle", "look_around"):
            looked = max(stage, int(action == "look_around"))
            return self._arrive(self.now[:, ACTION_INDEX[action], STATE_INDEX[state]], looked)
        if name.startswith("let_go"):
            return self._decided[state]
        if action == "fail":
            return self._failed(STATE_INDEX[state])
        if name == "warned":
            return self._arrive(self.now[:, ACTION_INDEX["idle"], STATE_INDEX[state]])
        if name == "rest":
            row = self.now[:, ACTION_INDEX["idle"], STATE_INDEX["recovery"]]
            stays = row[:, STATE_INDEX["recovery"]][:, None]
            return stays * only("rest") + (1.0 - stays) * only("come_back")
        if name == "come_back":
            return self._back(grasping)
        if name == "watch":
            return np.broadcast_to(only("watch" if grasping else "settle"), self.free_shape)
        if name == "warn":
            return np.broadcast_to(only("warn" if grasping else "warned"), self.free_shape)
        if name == "settle":
            return self._decided["evaluating"]
        followed = {"reach": "carry", "carry": "placed", "leave": "rest"}
        key = name if name in followed else action
        return np.broadcast_to(only(followed[key]), self.free_shape)

    @property
    def free_shape(self) -> tuple[int, int]:
        """(B, M)."""
        return self.size, len(MODES)

    @property
    def _retreat_ticks(self) -> float:
        return self.layout.timing.retreat.mean / TICK

    def _hand_back(self, name: str, came: float) -> np.ndarray:
        """(B, M): after the retreat; `came`: chance that the next cube has come meanwhile."""
        if name == "placed":
            return (1.0 - came) * self._only("placed.idle") + came * self._early()
        return (1.0 - came) * self._only("waits") + came * self._decided["task_assigned"]

    def _early(self) -> np.ndarray:
        """(B, M): as who decides about a new cube, while the tray has not reported the last."""
        begun = self._decided["task_assigned"].copy()
        for action in ("idle", "look_around"):
            now, early = INDEX[f"task_assigned.{action}"], INDEX[f"early.{action}"]
            begun[:, early], begun[:, now] = begun[:, now], 0.0
        return begun

    def _failed(self, s: int) -> np.ndarray:
        row = self.now[:, ACTION_INDEX["grasp"], s].copy()
        row[:, STATE_INDEX["success"]] = 0.0
        sums = row.sum(axis=1, keepdims=True)
        row = np.divide(row, sums, out=np.zeros_like(row), where=sums > 0.0)
        return self._let_go(row)

    def _let_go(self, row: np.ndarray) -> np.ndarray:
        """(B, M): the hands return first; states that no attempt leads to count as evaluating."""
        begun = np.zeros((self.size, len(MODES)))
        for state in LET_GO_TO:
            begun[:, INDEX[f"let_go.{state}"]] = row[:, STATE_INDEX[state]]
        begun[:, INDEX["let_go.evaluating"]] += np.maximum(0.0, 1.0 - begun.sum(axis=1))
        return begun

    def _back(self, grasping: bool) -> np.ndarray:
        if grasping:  # the robot is at work meanwhile
            return self._answer("recovery")
        row = self.now[:, ACTION_INDEX["idle"], STATE_INDEX["recovery"]].copy()
        row[:, STATE_INDEX["recovery"]] = 0.0
        sums = row.sum(axis=1, keepdims=True)
        row = np.divide(row, sums, out=np.zeros_like(row), where=sums > 0.0)
        row[:, STATE_INDEX["evaluating"]] += sums[:, 0] <= 0.0
        return self._arrive(row)

    # -- answers to the robot ---------------------------------------------------------------------

    def refusal(self, origin: str, stage: int = 0) -> np.ndarray:
        """(B,): probability of refusing help at `origin`, at a stage of distraction."""
        p = self.parameters.responses
        looked = max(0.0, stage - 0.5) * self.layout.timing.look_around.mean * self.slowness
        return np.array(
            [
                refusal_probability(model.refusal, origin, float(time), self.scenario, p)
                for model, time in zip(self.models, looked, strict=True)
            ]
        )

    def _answer(self, origin: str, stage: int = 0) -> np.ndarray:
        refuses = self.refusal(origin, stage)[:, None]
        return refuses * self._only("warn") + (1.0 - refuses) * self._only("watch")

    def _answer_to_grasp(self) -> np.ndarray:
        J = np.zeros((self.size, len(MODES), len(MODES)))
        for index, mode in enumerate(MODES):
            if mode.origin:
                J[:, index] = self._answer(mode.origin, mode.stage)
        return J

    def _answer_to_pointing(self) -> np.ndarray:
        J = np.zeros((self.size, len(MODES), len(MODES)))
        pointing = self.parameters.responses.pointing
        for index, mode in enumerate(MODES):
            if mode.origin and mode.looks != GRASP:
                chance = pointing.get(mode.state, 0.0)
                J[:, index] = chance * self._decided["evaluating"]
        return J

    def _answer_to_planning(self) -> np.ndarray:
        p = self.parameters.responses
        J = np.zeros((self.size, len(MODES), len(MODES)))
        warned = (p.planning_warned * self._influence("reluctance"))[:, None]
        for index, mode in enumerate(MODES):
            if mode.state == "no_attention":
                J[:, index] = p.planning_wakes * self._decided["evaluating"]
            elif mode.state == "evaluating" and mode.origin:
                J[:, index] = warned * self._only("warn")
                if mode.looks != GRASP:
                    spurred = p.planning_spurs * self.refusal(mode.origin)[:, None]
                    spurred = np.minimum(spurred, 1.0 - warned)
                    J[:, index] += spurred * self._decided["evaluating"]
        return J

    # -- how long ---------------------------------------------------------------------------------

    def durations(self, knows: np.ndarray | None = None) -> np.ndarray:
        """(B, K): P(ticks left when a mode begins), flat by appearance.

        knows: (B,) probability of knowing the tray of a colour; who does not, hesitates.
        """
        layout = self.layout
        D = np.zeros((self.size, int(layout.ticks.sum())))
        for v, look in enumerate(layout.looks):
            at, n = layout.start[v], layout.ticks[v]
            D[:, at : at + n] = self._duration(look.mode, n, knows)
        return D

    def _duration(self, mode: int, n: int, knows: np.ndarray | None) -> np.ndarray:
        m = MODES[mode]
        if not m.span:
            return np.ones((self.size, 1))
        factor = self.slowness if m.slowed else np.ones(self.size)
        if m.hesitates and self.sorting and knows is not None:
            factor = factor * (1.0 + self.parameters.memory.hesitation * (1.0 - knows))
        return tick_distribution(getattr(self.layout.timing, m.span), factor, n)

    def hesitate(self, D: np.ndarray, knows: np.ndarray) -> None:
        """Replace the durations of thinking in D, as `durations` would give them."""
        layout = self.layout
        done: dict[tuple[str, int], np.ndarray] = {}
        for v, look in enumerate(layout.looks):
            m, n = MODES[look.mode], layout.ticks[v]
            if m.hesitates:
                if (m.span, n) not in done:
                    done[m.span, n] = self._duration(look.mode, n, knows)
                D[:, layout.start[v] : layout.start[v] + n] = done[m.span, n]

    def knows_at_first(self) -> np.ndarray:
        """(B,): mean probability of knowing a colour's tray before the first cube."""
        p = self.parameters.memory
        known = p.known - p.inexperience * self._influence("inexperience")
        return np.maximum(0.0, known - p.distraction * self._influence("distraction"))

    def knows_after(self, knows: np.ndarray, by_robot: bool, colours: int = 3) -> np.ndarray:
        """(B,): the same after a right placement: one colour is learnt, the others fade."""
        p = self.parameters.memory
        kept = 1.0 - p.forgets * self._influence("distraction")
        learnt = knows + (p.taught if by_robot else p.learns) * (1.0 - knows)
        return (learnt + (colours - 1) * knows * kept) / colours
