# SPDX-License-Identifier: BSD-3-Clause
"""Our belief beside plain baselines: what each says of every take-over, and how well it tells.

Everything that is learnt from recorded people is learnt from the other people only: the base rate,
and the two weights of WEIGHED. All else comes from simulated people.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import log_expit, logit

from fabric_planner import AlphaVectors
from fabric_sim.experiments.paired import Interval
from fabric_sim.experiments.take_overs_belief import Habits, History, TypeStateModel
from fabric_sim.experiments.take_overs_score import (
    Groups,
    auc,
    interval,
    resampled_auc,
    resamples,
    within_people,
)
from fabric_sim.experiments.take_overs_watch import Models, TakeOver

TOGETHER = "state and type belief together"
STATE, TYPE = "state belief alone", "type belief alone"
KNOWN = "known types, by looks alone"
WEIGHED = "together, weights from the others"
NEEDS_HELP = "belief in needs_help"
WARNINGS_TASK, WARNINGS_PERSON = "warnings so far, task", "warnings so far, person"
IDLE, BASE_RATE = "idle time", "base rate of the others"
OURS = (TOGETHER, STATE, TYPE, KNOWN, WEIGHED)
BASELINES = (NEEDS_HELP, WARNINGS_TASK, WARNINGS_PERSON, IDLE, BASE_RATE)
RIVALS = (NEEDS_HELP, WARNINGS_TASK)  # what was published, to be beaten
TAKES_OVER = 0.5  # P(accept) from which taking over is likelier accepted than not
WEIGHT_PRIOR = 0.5  # standard deviation around 1, the weight that Bayes' rule gives

COUNTED: dict[str, Callable[[TakeOver], bool]] = {
    "first grasp of a subtask": lambda t: t.first,
    "every grasp begun": lambda t: t.begun,
}


@dataclass(frozen=True)
class Table:
    """All take-overs, with the score of each by name, (n,): the higher, the likelier accepted.

    actions: (n,) what our proactive policy does at the same belief over the states.
    """

    take_overs: tuple[TakeOver, ...]
    scores: dict[str, NDArray]
    actions: tuple[str, ...]

    @property
    def robots(self) -> list[str]:
        """The recorded robots."""
        return sorted({t.robot for t in self.take_overs})


@dataclass(frozen=True)
class Line:
    """How well one score tells, among n take-overs.

    area: AUC with its interval. within: AUC over pairs of the same person. without: AUC when one
    person's take-overs are left out, by person. gains: area of this score minus that of a rival.
    """

    name: str
    area: Interval
    within: float
    without: dict[str, float]
    gains: dict[str, Interval]


@dataclass(frozen=True)
class Part:
    """The comparison for one way of counting take-overs and one recorded robot."""

    counted: str
    robot: str
    n: int
    accepted: int
    rows: tuple[int, ...]  # in the table
    lines: tuple[Line, ...]


def table(
    people: dict[str, list[TakeOver]], models: Models, habits: Habits, policy: AlphaVectors
) -> Table:
    """Score every take-over. Raises ValueError when there is none."""
    people = {name: own for name, own in people.items() if own}
    if not people:
        raise ValueError("the recorded robots have not taken over once")
    predictor = TypeStateModel(habits, models.pomdp.states, models.selector.models.types)
    found = [predictor.predict(History.of(own)) for own in people.values()]
    flat = tuple(t for own in people.values() for t in own)
    scores = {
        TOGETHER: np.concatenate([p.together for p in found]),
        STATE: np.concatenate([p.state for p in found]),
        TYPE: np.concatenate([p.type for p in found]),
        KNOWN: np.concatenate([p.known_types for p in found]),
    }
    scores[WEIGHED] = weighed(flat, scores[STATE], scores[TYPE], habits.mean)
    scores |= baselines(flat, models.pomdp.state_index("needs_help"))
    actions = [models.pomdp.actions[policy.action(t.state)] for t in flat]
    return Table(flat, scores, tuple(actions))


def baselines(take_overs: Sequence[TakeOver], needs_help: int) -> dict[str, NDArray]:
    """Scores that need no idea of people; needs_help: index of that state."""
    return {
        NEEDS_HELP: np.array([t.state[needs_help] for t in take_overs]),
        WARNINGS_TASK: -np.array([t.warnings_task for t in take_overs], dtype=float),
        WARNINGS_PERSON: -np.array([t.warnings_person for t in take_overs], dtype=float),
        IDLE: np.array([t.idle for t in take_overs]),
        BASE_RATE: base_rate(take_overs),
    }


def base_rate(take_overs: Sequence[TakeOver]) -> NDArray:
    """Share of accepted take-overs of the same robot with everybody else; 1/2 without anybody."""
    scores = []
    for one in take_overs:
        others = [t.accepted for t in take_overs if t.person != one.person and t.robot == one.robot]
        scores.append(np.mean(others) if others else 0.5)
    return np.array(scores)


def weighed(take_overs: Sequence[TakeOver], state: NDArray, kind: NDArray, mean: float) -> NDArray:
    """P(accept) by log-odds of state and type with weights that fit the other people best.

    state, kind: (n,) chances by either alone. mean: what both have in common, log-odds.
    """
    parts = np.column_stack((logit(state) - mean, logit(kind)))
    accepted = np.array([t.accepted for t in take_overs], dtype=bool)
    people = np.array([t.person for t in take_overs])
    scores = np.empty(len(take_overs))
    for person in sorted(set(people)):
        other = people != person
        scores[~other] = np.exp(log_expit(parts[~other] @ _weights(parts[other], accepted[other])))
    return scores


def _weights(parts: NDArray, accepted: NDArray) -> NDArray:
    """(2,): maximum a posteriori of a logistic regression without intercept, prior around 1."""
    signed = parts * np.where(accepted, 1.0, -1.0)[:, None]

    def cost(weights: NDArray) -> float:
        prior = ((weights - 1.0) ** 2).sum() / (2.0 * WEIGHT_PRIOR**2)
        return float(prior - log_expit(signed @ weights).sum())

    return minimize(cost, np.ones(2), method="BFGS").x


def compare(all_of: Table, seed: int) -> list[Part]:
    """Every way of counting, for each recorded robot and for all of them."""
    robots = all_of.robots
    chosen = [*robots, "all"] if len(robots) > 1 else robots
    return [
        part(all_of, counted, robot, seed)
        for counted in COUNTED
        for robot in chosen
        if rows_of(all_of, counted, robot)
    ]


def rows_of(all_of: Table, counted: str, robot: str) -> list[int]:
    """Numbers of the take-overs that count."""
    return [
        i
        for i, t in enumerate(all_of.take_overs)
        if COUNTED[counted](t) and robot in (t.robot, "all")
    ]


def part(all_of: Table, counted: str, robot: str, seed: int) -> Part:
    """Compare the scores on the take-overs that count; the bootstrap is the same for all scores."""
    rows = rows_of(all_of, counted, robot)
    own = [all_of.take_overs[i] for i in rows]
    accepted = np.array([t.accepted for t in own])
    groups = Groups(tuple(t.person for t in own), tuple(t.task for t in own))
    counts = resamples(groups, seed)
    scores = {name: values[rows] for name, values in all_of.scores.items()}
    drawn = {name: resampled_auc(values, accepted, counts) for name, values in scores.items()}
    lines = []
    for name, values in scores.items():
        area = auc(values, accepted)
        gains = {
            rival: interval(area - auc(scores[rival], accepted), drawn[name] - drawn[rival])
            for rival in RIVALS
        }
        within = within_people(values, accepted, groups.person)
        without = left_out(values, accepted, groups.person)
        lines.append(Line(name, interval(area, drawn[name]), within, without, gains))
    return Part(counted, robot, len(own), int(accepted.sum()), tuple(rows), tuple(lines))


def left_out(scores: NDArray, accepted: NDArray, people: Sequence[str]) -> dict[str, float]:
    """AUC without each person in turn; NaN where nobody, or one outcome only, is left."""
    who = np.array(people)
    areas = {}
    for person in sorted(set(people)):
        rest = who != person
        areas[person] = auc(scores[rest], accepted[rest]) if rest.any() else math.nan
    return areas


@dataclass(frozen=True)
class Kept:
    """What a rule would have done with the take-overs that count."""

    warned: int
    avoided: int
    accepted: int
    kept: int


def kept(all_of: Table, rows: Sequence[int], takes_over: Sequence[bool]) -> Kept:
    """takes_over: (n,) of all take-overs, whether the rule takes over at that moment."""
    accepted = [i for i in rows if all_of.take_overs[i].accepted]
    warned = [i for i in rows if not all_of.take_overs[i].accepted]
    return Kept(
        len(warned),
        sum(not takes_over[i] for i in warned),
        len(accepted),
        sum(bool(takes_over[i]) for i in accepted),
    )


def rules(all_of: Table) -> dict[str, list[bool]]:
    """The rules that are counted, over all take-overs."""
    by_belief = [bool(p >= TAKES_OVER) for p in all_of.scores[TOGETHER]]
    by_policy = [action == "grasp" for action in all_of.actions]
    return {
        f"takes over when P(accept) >= {TAKES_OVER:g}": by_belief,
        "takes over when the proactive policy does": by_policy,
    }
