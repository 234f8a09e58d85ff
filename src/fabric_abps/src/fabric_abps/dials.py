# SPDX-License-Identifier: BSD-3-Clause
"""The dials of a candidate: in what it differs from the base model, in words and numbers.

A dial makes some ways of the model more or less likely: their chances are multiplied, then each row
is brought back to a sum of 1. A way that does not exist in the base model never appears, one that
exists never vanishes.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

WORKING = ("task_assigned_to_human", "human_doing_ok")
STAGE_1 = ("may_not_be_capable", "may_be_tired", "may_be_distracted")
IN_TROUBLE = (*STAGE_1, "needs_to_be_reminded", "needs_help")
BY_ONESELF = ("idle", "planning", "cancel")
HANDS_OFF = (*BY_ONESELF, "point")
OBSERVABILITY = ("pomdp", "mixed", "mdp")


@dataclass(frozen=True)
class Dial:
    """A factor on the chance of the ways from some states to others under some actions.

    low, high: the range a candidate is drawn from, log-uniform around 1. small, large: what a robot
    is that believes in a small or a large factor; few, many: what it does.
    """

    name: str
    low: float
    high: float
    small: str
    large: str
    few: str
    many: str
    actions: tuple[str, ...] = ()
    sources: tuple[str, ...] = ()
    targets: tuple[str, ...] = ()

    @property
    def moves_transitions(self) -> bool:
        """Whether the dial turns the transitions; else it turns the observations."""
        return bool(self.actions)


DIALS = (
    Dial(
        "failing", 0.2, 4.0, "lenient", "strict",
        "thinks people capable", "sees attempts fail early",
        HANDS_OFF, WORKING, ("may_not_be_capable",),
    ),
    Dial(
        "tiring", 0.2, 4.0, "brisk", "caring",
        "thinks people rested", "judges idle hands as tired",
        HANDS_OFF, WORKING, ("may_be_tired",),
    ),
    Dial(
        "wandering", 0.2, 4.0, "tolerant", "watchful",
        "thinks people attentive", "judges a look away as distraction",
        HANDS_OFF, WORKING, ("may_be_distracted",),
    ),
    Dial(
        "worsening", 0.25, 4.0, "hopeful", "worried",
        "expects trouble to pass", "takes trouble for a need of help",
        HANDS_OFF, STAGE_1, ("needs_to_be_reminded", "needs_help"),
    ),
    Dial(
        "recovery", 0.25, 4.0, "impatient", "patient",
        "does not count on people to recover", "lets people recover",
        BY_ONESELF, IN_TROUBLE, (*WORKING, "does_not_need_help"),
    ),
    Dial(
        "pointing", 0.2, 4.0, "discreet", "reminding",
        "sees little use in reminding", "reminds",
        ("point",), ("may_be_distracted", "needs_to_be_reminded"), WORKING,
    ),
    Dial(
        "refusal", 0.2, 8.0, "bold", "wary",
        "hardly fears a warning", "is wary of warnings",
        ("grasp",), (*WORKING, *IN_TROUBLE, "does_not_need_help"), ("warning_received",),
    ),
    Dial(
        "welcome", 0.25, 8.0, "reluctant", "obliging",
        "waits to be needed", "takes help to be welcome any time",
        ("grasp",), (*WORKING, *STAGE_1, "needs_to_be_reminded"), ("needs_help",),
    ),
    Dial(
        "paying", 0.4, 2.5, "modest", "confident",
        "takes over with little hope", "takes over with confidence",
        ("grasp",), IN_TROUBLE, ("global_success", "task_assigned_to_human"),
    ),
    Dial(
        "urgency", 0.25, 4.0, "calm", "hurried",
        "has time", "fears that the time runs out",
        HANDS_OFF, IN_TROUBLE, ("global_fail",),
    ),
    Dial(
        "ability", 0.25, 2.5, "doubting", "trusting",
        "doubts the person's skill", "trusts the person's skill",
        HANDS_OFF, (*WORKING, "does_not_need_help"), ("global_success", "human_doing_ok"),
    ),
    Dial("trust", 0.4, 4.0, "sceptical", "believing",
        "doubts what it sees", "trusts what it sees"),
)  # fmt: skip
SHARP = 0.01  # share of its weight that a symbol keeps in states it does not belong to
RARE = 0.005  # chance of a symbol below which trust does not matter
LEAST = 5e-4  # chance that a rare symbol or way keeps, whatever the dials
JITTER = 0.25  # spread of the logarithm of each chance, at most
CLEAR = 0.3  # how far a dial must be turned to be told of
EXTREME = 0.7  # shape of the symmetric beta distribution of the dials: below 1 prefers the ends
SPREAD = 0.3  # standard deviation of the logarithm of a dial that is handed down
UNTURNED = 0.25  # share of the dials that a draw leaves as they are


@dataclass(frozen=True)
class Setting:
    """What defines a candidate.

    factors: a positive number for each of DIALS, 1 as the base model. observability: pomdp; mixed,
    whether somebody is at work or in trouble is seen, the rest is hidden; mdp, a symbol names the
    state. jitter: standard deviation of the logarithm of each chance, drawn from jitter_seed.
    Raises ValueError naming the dial.
    """

    factors: Mapping[str, float]
    observability: str = "pomdp"
    jitter: float = 0.0
    jitter_seed: int = 0

    def __post_init__(self) -> None:
        names = [dial.name for dial in DIALS]
        if sorted(self.factors) != sorted(names):
            raise ValueError(f"factors must be of {', '.join(names)}; got {[*self.factors]}")
        for name, factor in self.factors.items():
            if not (math.isfinite(factor) and factor > 0.0):
                raise ValueError(f"dial {name} is {factor}; it must be positive and finite")
        if self.observability not in OBSERVABILITY:
            raise ValueError(
                f"observability is {self.observability!r}, none of {', '.join(OBSERVABILITY)}"
            )
        if not 0.0 <= self.jitter < math.inf:
            raise ValueError(f"jitter is {self.jitter}; it must be 0 or more, and finite")

    @classmethod
    def base(cls) -> "Setting":
        """All dials at 1: the base model itself."""
        return cls({dial.name: 1.0 for dial in DIALS})

    @classmethod
    def draw(cls, rng: np.random.Generator) -> "Setting":
        """Draw one: the ends of the dials are likelier than their middles; two in three a POMDP."""
        factors = {}
        for dial in DIALS:
            place = 2.0 * rng.beta(EXTREME, EXTREME) - 1.0
            end = dial.high if place > 0.0 else dial.low
            turned = rng.random() >= UNTURNED
            factors[dial.name] = round(float(end ** abs(place)), 3) if turned else 1.0
        observability = str(rng.choice(OBSERVABILITY, p=(4 / 6, 1 / 6, 1 / 6)))
        jitter = round(float(rng.uniform(0.0, JITTER)), 3)
        return cls(factors, observability, jitter, int(rng.integers(2**31)))

    @classmethod
    def child(cls, rng: np.random.Generator, parents: Sequence["Setting"]) -> "Setting":
        """Draw one that has each dial, and the observability, near that of one of its parents."""
        factors = {}
        for dial in DIALS:
            parent = parents[int(rng.integers(len(parents)))].factors[dial.name]
            shaken = parent * math.exp(SPREAD * rng.standard_normal())
            factors[dial.name] = round(min(max(shaken, dial.low), dial.high), 3)
        observability = parents[int(rng.integers(len(parents)))].observability
        jitter = round(float(rng.uniform(0.0, JITTER)), 3)
        return cls(factors, observability, jitter, int(rng.integers(2**31)))

    def transition(self, states: list[str], actions: list[str], T: Any) -> np.ndarray:
        """T (A, S, S') of the base model with the dials turned; zeros stay, rows sum to 1."""
        weights = np.ones(np.shape(T))
        for dial in DIALS:
            if dial.moves_transitions:
                weights[np.ix_(*_places(dial, states, actions))] *= self.factors[dial.name]
        rng = np.random.default_rng([self.jitter_seed, 1])
        noise = np.exp(self.jitter * rng.standard_normal(weights.shape))
        return _rows(np.asarray(T), weights * noise)

    def observation(self, states: list[str], ends: Any, O: Any) -> np.ndarray:  # noqa: E741
        """O (A, S', O) of the base model: to the power of trust, then as observability has it.

        ends: (S',) bool, states whose rows stay as they are. Symbols rarer than RARE keep their
        weight. The jitter is the same under every action; zeros stay, rows sum to 1.
        """
        table = np.asarray(O)
        rng = np.random.default_rng([self.jitter_seed, 2])
        weights = np.exp(self.jitter * rng.standard_normal(table.shape[1:]))
        weights = weights * np.maximum(table / RARE, 1.0) ** (self.factors["trust"] - 1.0)
        if self.observability != "pomdp":
            groups = np.array([_group(name, self.observability) for name in states])
            weights = weights * np.where(_belongs(table, groups), 1.0, SHARP)
        rows = _rows(table, weights)
        rows[:, np.asarray(ends)] = table[:, np.asarray(ends)]
        return rows

    def turned(self, dial: Dial) -> float:
        """How far a dial is turned: -1 at its low end, 0 as the base model, 1 at its high end."""
        factor = self.factors[dial.name]
        return math.log(factor) / abs(math.log(dial.high if factor > 1.0 else dial.low))

    @property
    def furthest(self) -> list[Dial]:
        """The dials that are clearly turned, the furthest first."""
        order = sorted(DIALS, key=lambda dial: -abs(self.turned(dial)))
        return [dial for dial in order if abs(self.turned(dial)) > CLEAR]

    def words(self, how_many: int = 3) -> str:
        """What it does by the dials that are turned furthest: "reminds, is wary of warnings"."""
        said = self.furthest[:how_many]
        return ", ".join(d.many if self.factors[d.name] > 1.0 else d.few for d in said)

    def adjectives(self) -> list[str]:
        """What it is by the dials that are turned, the furthest first: "wary"."""
        return [d.large if self.factors[d.name] > 1.0 else d.small for d in self.furthest]


def _group(state: str, observability: str) -> str:
    """What is seen of a state: its name (mdp), or only whether there is trouble (mixed)."""
    if observability == "mdp":
        return state
    if state in IN_TROUBLE:
        return "trouble"
    return "work" if state in (*WORKING, "does_not_need_help") else state


def _belongs(O: np.ndarray, groups: np.ndarray) -> np.ndarray:  # noqa: E741
    """(A, S', O): whether a symbol is as likely nowhere else as in the state's group."""
    most = np.stack([O[:, groups == group].max(axis=1) for group in groups], axis=1)
    return most >= 0.999 * O.max(axis=1, keepdims=True)


def _places(dial: Dial, states: list[str], actions: list[str]) -> tuple[list[int], ...]:
    named = ((dial.actions, actions), (dial.sources, states), (dial.targets, states))
    return tuple([names.index(n) for n in wanted if n in names] for wanted, names in named)


def _rows(table: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Weighted rows of a stochastic table: entries at least LEAST (or as before), sum 1."""
    rows = table * weights
    rows /= rows.sum(axis=-1, keepdims=True)
    rows = np.where(table > 0.0, np.maximum(rows, LEAST), 0.0)
    return rows / rows.sum(axis=-1, keepdims=True)
