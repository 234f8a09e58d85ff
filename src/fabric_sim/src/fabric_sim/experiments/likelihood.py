# SPDX-License-Identifier: BSD-3-Clause
"""P(what was seen of a task | character): the forward filter over the worker's states.

The filter goes tick by tick over what the robot did and what the trays reported (thesis section
6.4.2). The belief is over modes, how they are recognised and how long they still last; summed over
these it is the belief over the states of Fig. 6.28. The robot's actions and its own placements are
given; everything the person does is predicted, then compared with what was seen.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fabric_sim.experiments.modes import INDEX, MODES, REPORTED
from fabric_sim.experiments.tables import Tables
from fabric_sim.experiments.trials import (
    NOTHING,
    PERSON_FAILED,
    PERSON_SUCCEEDED,
    ROBOT_FAILED,
    ROBOT_GRASP,
    ROBOT_IDLE,
    ROBOT_PLANNING,
    ROBOT_POINT,
    ROBOT_SUCCEEDED,
    TICK,
    UNSEEN,
    Trial,
)
from fabric_sim.experiments.watching import survival
from fabric_sim.worker_parameters import STATES

_AWAY = ("leave", "rest", "come_back")
_PLACED = (*REPORTED, "placed.idle")
_PREDICTED = (PERSON_SUCCEEDED, PERSON_FAILED)
_GIVEN = (ROBOT_SUCCEEDED, ROBOT_FAILED)
_LABELS = 3  # trays to guess from


@dataclass(frozen=True)
class Evidence:
    """Log-likelihood of a trial: total (B,) and of each tick (B, n)."""

    total: np.ndarray
    by_tick: np.ndarray


class Filter:
    """The forward filter of B characters at once."""

    def __init__(self, tables: Tables) -> None:
        self._t = tables
        layout = tables.layout
        self._of = layout.of_state
        self._begin = layout.start
        self._durations = tables.durations(tables.knows_at_first() if tables.sorting else None)
        self._answers = {
            ROBOT_GRASP: tables.grasp,
            ROBOT_PLANNING: tables.planning,
            ROBOT_POINT: tables.point,
        }
        self._matters = {key: J.sum(axis=2) for key, J in self._answers.items()}
        self._late = layout.looking()
        self._report = self._reporting()

    def _reporting(self) -> np.ndarray:
        """(V,): chance of a report of the person's cube in a tick."""
        names = [MODES[mode].name for mode in self._t.layout.mode]
        w = self._t.watching
        return np.array([w.reported if name in _PLACED else w.stray_event for name in names])

    def run(self, trial: Trial) -> Evidence:
        """Return the log-likelihood of what was seen in a trial, for each character.

        The sorting rules are new to everybody, as in every task.
        """
        t = self._t
        knows = t.knows_at_first()
        D = self._durations.copy() if t.sorting else self._durations
        enter = t.waiting[None, :] if trial.waits and t.sorting else t.start
        a = self._entered(np.broadcast_to(enter, (t.size, len(self._begin))), D)
        robot, ages = _noticeable(trial.robot, t.watching.delay)
        logs = np.zeros((t.size, len(trial)))
        for tick in range(len(trial)):
            event = int(trial.events[tick])
            if tick:
                a = self._advance(a, robot[tick] == ROBOT_GRASP, D)
            if robot[tick] != ROBOT_IDLE:
                a = self._notice(a, int(robot[tick]), int(ages[tick]), D)
            if event in _GIVEN:
                a = self._next_cube(a, by_person=False)
            a *= self._seen(
                int(trial.symbols[tick]), int(trial.symbols[tick - 1]) if tick else UNSEEN
            )
            a *= self._told(event, knows)
            total = a.sum(axis=1)
            logs[:, tick] = np.log(total)
            a /= total[:, None]
            if event in _PREDICTED:
                a = self._next_cube(a, by_person=True)
            if event not in (NOTHING, PERSON_FAILED) and t.sorting:
                knows = t.knows_after(knows, event == ROBOT_SUCCEEDED)
                t.hesitate(D, knows)
        self.belief = a
        return Evidence(logs.sum(axis=1), logs)

    def states(self) -> np.ndarray:
        """(B, S): the belief over the MDP's states after the last tick of the last run."""
        pooled = np.add.reduceat(self.belief, self._begin, axis=1)
        found = np.zeros((len(pooled), len(STATES)))
        for v, mode in enumerate(self._t.layout.mode):
            found[:, STATES.index(MODES[mode].state)] += pooled[:, v]
        return found

    # -- one tick ---------------------------------------------------------------------------------

    def _entered(self, enter: np.ndarray, D: np.ndarray) -> np.ndarray:
        """(B, K) of what begins: enter (B, V)."""
        return enter[:, self._of] * D

    def _advance(self, a: np.ndarray, grasping: bool, D: np.ndarray) -> np.ndarray:
        ended = a[:, self._begin]
        P = self._t.grasped if grasping else self._t.free
        went_on = np.empty_like(a)
        went_on[:, :-1] = a[:, 1:]
        went_on[:, self._t.layout.last] = 0.0
        went_on += self._entered(np.matmul(ended[:, None, :], P)[:, 0], D)
        return went_on

    def _notice(self, a: np.ndarray, robot: int, age: int, D: np.ndarray) -> np.ndarray:
        """The share of people who notice the robot in this tick answer it."""
        f = self._noticing(robot, age)
        if not f.any():
            return a
        pooled = np.add.reduceat(a, self._begin, axis=1)
        answered = np.matmul((pooled * f)[:, None, :], self._answers[robot])[:, 0]
        stay = 1.0 - f * self._matters[robot]
        return a * stay[:, self._of] + self._entered(answered, D)

    def _noticing(self, robot: int, age: int) -> np.ndarray:
        """(V,): chance of noticing now; a grasp is noticed once, and then answered for good."""
        timing = self._t.layout.timing
        spans = (timing.reaction, timing.late_reaction)
        shares = []
        for span in spans:
            before, now = (self._noticed(span, n) for n in (age - 1, age))
            if robot == ROBOT_GRASP:
                shares.append(1.0 if before > 0.999 else (now - before) / (1.0 - before))
            else:
                shares.append(now - before)
        return np.where(self._late, shares[1], shares[0])

    def _noticed(self, span, age: int) -> float:
        """P(noticed) by the end of tick `age`; the robot began within the tick before tick 0."""
        if age < 0:
            return 0.0
        return float(1.0 - survival(span, np.array((age + 1.5) * TICK), np.array(1.0)))

    def _seen(self, symbol: int, before: int) -> np.ndarray | float:
        """Likelihood of a symbol after another: looked at anew, or only repeated."""
        if symbol == UNSEEN:
            return 1.0
        w = self._t.watching
        held = w.held if before != UNSEEN else 0.0
        anew = self._t.layout.seen(symbol, w.slip)[self._of]
        return held * (symbol == before) + (1.0 - held) * anew

    def _told(self, event: int, knows: np.ndarray) -> np.ndarray | float:
        """Likelihood of a tray's report, or of none; what the robot places is given."""
        if event == NOTHING:
            return (1.0 - self._report)[self._of]
        if event in _GIVEN:
            return 1.0
        error = self._t.watching.misjudged
        right = knows + (1.0 - knows) / _LABELS if self._t.sorting else np.ones_like(knows)
        right = (1.0 - error) * right + error / 2.0
        chance = right if event == PERSON_SUCCEEDED else 1.0 - right
        return chance[:, None] * self._report[self._of]

    def _next_cube(self, a: np.ndarray, by_person: bool) -> np.ndarray:
        """What is begun for this cube ends with it, breaks and a hand on its way excepted."""
        layout, t = self._t.layout, self._t
        kept = np.zeros_like(a)
        for v, look in enumerate(layout.looks):
            name, at, n = MODES[look.mode].name, layout.start[v], layout.ticks[v]
            part = a[:, at : at + n]
            if name in _AWAY:
                kept[:, at : at + n] += part
            elif name in REPORTED and by_person:
                to = layout.start[self._like(v, REPORTED[name])]
                kept[:, to : to + n] += part
            else:
                kept[:, layout.start] += part.sum(axis=1, keepdims=True) * t.waiting
        return kept

    def _like(self, v: int, name: str) -> int:
        """The appearance of another mode that is recognised in the same way."""
        looks = self._t.layout.looks
        wanted = (INDEX[name], looks[v].variant)
        return next(i for i, look in enumerate(looks) if (look.mode, look.variant) == wanted)


def _noticeable(robot: np.ndarray, delay: float) -> tuple[np.ndarray, np.ndarray]:
    """(n,) the robot's action while what is seen at a tick came about, (n,) its age in ticks.

    What is seen at a tick was done `delay` s before, and answers the robot of the tick before that.
    """
    shift = 1 + round(delay / TICK)
    before = np.concatenate((np.full(shift, ROBOT_IDLE), robot))[: len(robot)]
    ages = np.zeros(len(robot), dtype=int)
    for tick in range(1, len(robot)):
        ages[tick] = ages[tick - 1] + 1 if before[tick] == before[tick - 1] else 0
    return before, ages
