# SPDX-License-Identifier: BSD-3-Clause
"""Answers of simulated people: what happened, how the person answers, and chance.

A statement's agreement is a weighted sum of what the person went through (experience.MEASURES);
on it come the person's own view of the statement, the person's style (everybody uses a scale in an
own way) and noise; the nearest step of the scale is the answer. The numbers are a choice of the
modeller, config/rehearsal.yaml, and are not fitted to any published mean.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from fabric_sim.character import named_generator
from fabric_sim.rehearsal.answer_parameters import AnswerParameters, Leaning
from fabric_sim.rehearsal.experience import NOTHING_YET, Measures
from fabric_study.instruments import LIKERT, TLX, TLX_STEP, Item

MIDDLE = sum(LIKERT) // 2  # of a statement's scale
SHARE = 1.0 / (LIKERT[1] - LIKERT[0])  # of a 0..1 scale that is one step of a statement's
#: Items that the model does not know are answered around their middle.
UNKNOWN = Leaning(0.0, {}, "")
UNKNOWN_DEMAND = Leaning(0.5, {}, "")
Value = int | str | None


@dataclass(frozen=True)
class Moment:
    """What a person has gone through when asked.

    lately: of the task, the condition or the visit that is asked about. conditions: of each
    condition so far, by name.
    """

    lately: Measures = field(default_factory=lambda: NOTHING_YET)
    conditions: Mapping[str, Measures] = field(default_factory=dict)


class Respondent:
    """One person who answers, with a style of an own; equal seeds and names, equal answers."""

    def __init__(self, model: AnswerParameters, seed: int, *names: object) -> None:
        self._model, self._seed, self._names = model, seed, names
        rng = named_generator(seed, "style", *names)
        self._shift = rng.normal(0.0, model.style.shift)
        self._stretch = math.exp(rng.normal(0.0, model.style.stretch))

    def answers(self, items: Sequence[Item], place: str, moment: Moment) -> dict[str, Value]:
        """Return the answer to every item by its id, None where it was left out.

        place: where in the visit they are asked.
        """
        rng = named_generator(self._seed, "answers", *self._names, place)
        return {item.id: self._answer(item, moment, rng) for item in items}

    def _answer(self, item: Item, moment: Moment, rng: np.random.Generator) -> Value:
        left_out = rng.random() < self._model.missing
        answer: Callable[[Item, Moment, np.random.Generator], Value] = getattr(
            self, f"_{item.kind}"
        )
        value = answer(item, moment, rng)
        return None if left_out else value

    def _likert(self, item: Item, moment: Moment, rng: np.random.Generator) -> int:
        steps = self._agreement(item.id, moment.lately)
        steps = self._stretch * steps + self._shift + self._noise(rng)
        return int(min(LIKERT[1], max(LIKERT[0], round(MIDDLE + steps))))

    def _tlx(self, item: Item, moment: Moment, rng: np.random.Generator) -> int:
        share = self._demand(item.id, moment.lately) + SHARE * (self._shift + self._noise(rng))
        steps = round((TLX[0] + share * (TLX[1] - TLX[0])) / TLX_STEP)
        return int(min(TLX[1], max(TLX[0], TLX_STEP * steps)))

    def _pair(self, item: Item, moment: Moment, rng: np.random.Generator) -> Value:
        felt = {
            str(name): self._demand(str(name), moment.lately) + SHARE * self._noise(rng)
            for name in item.labels
        }
        return max(felt, key=lambda name: felt[name])

    def _choice(self, item: Item, moment: Moment, rng: np.random.Generator) -> Value:
        options = [str(option) for option in item.labels]
        preference = self._model.choices.get(item.id)
        if preference is None or preference.odds:
            return _drawn(options, preference.odds if preference else {}, rng)
        if preference.whether:
            agrees = self._agreement(preference.whether, moment.lately) + self._noise(rng) > 0.0
            return options[0] if agrees else options[-1]
        felt = {  # of a condition that was not met as much as of one without anything to tell
            option: self._agreement(preference.which, moment.conditions.get(option, NOTHING_YET))
            + self._noise(rng)
            for option in options
        }
        return max(felt, key=lambda option: felt[option])

    def _number(self, item: Item, moment: Moment, rng: np.random.Generator) -> int:
        return int(rng.integers(math.ceil(item.low), math.floor(item.high) + 1))

    def _text(self, item: Item, moment: Moment, rng: np.random.Generator) -> str | None:
        return self._model.comment if rng.random() < self._model.commented else None

    def _agreement(self, statement: str, lately: Measures) -> float:
        """Return the agreement of this person in steps from the middle, before style and noise."""
        leaning = self._model.statements.get(statement, UNKNOWN)
        return leaning.of(lately) + self._view(statement)

    def _demand(self, name: str, lately: Measures) -> float:
        """Return a demand as this person feels it, about 0..1."""
        leaning = self._model.demands.get(name, UNKNOWN_DEMAND)
        return leaning.of(lately) + SHARE * self._view(name)

    def _view(self, name: str) -> float:
        rng = named_generator(self._seed, "view", *self._names, name)
        return float(rng.normal(0.0, self._model.style.view))

    def _noise(self, rng: np.random.Generator) -> float:
        return float(rng.normal(0.0, self._model.style.noise))


def _drawn(options: Sequence[str], odds: Mapping[str, float], rng: np.random.Generator) -> str:
    """Return an option by its odds; the others share what these leave, or all when they are all."""
    others = [option for option in options if option not in odds]
    rest = max(0.0, 1.0 - math.fsum(odds.get(option, 0.0) for option in options))
    weights = np.array([odds.get(option, rest / max(len(others), 1)) for option in options])
    return options[int(rng.choice(len(options), p=weights / weights.sum()))]
