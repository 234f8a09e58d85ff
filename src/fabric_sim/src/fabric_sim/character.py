# SPDX-License-Identifier: BSD-3-Clause
"""Who a simulated person is: four dials in [0, 1], corners by name, the argument `human:=`."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, fields, replace
from functools import cached_property, lru_cache
from numbers import Real

import numpy as np

LOW_NAMES = ("beginner", "tired", "distracted", "noncollaborative")
HIGH_NAMES = ("expert", "rested", "attentive", "collaborative")

#: What a pull of the worker model may depend on: the four dials and their opposites (1 - dial).
INFLUENCES = (
    "expertise", "stamina", "attention", "collaborativeness",
    "inexperience", "weariness", "distraction", "reluctance",
)  # fmt: skip


class CharacterError(ValueError):
    """A human type that does not exist; the message names the value and the allowed ones."""


def named_generator(seed: int, *names: object) -> np.random.Generator:
    """Return the generator of the stream `names` under a root seed; streams are independent."""
    text = "/".join([str(int(seed)), *map(str, names)])
    digest = hashlib.sha256(text.encode()).digest()
    return np.random.Generator(np.random.PCG64(int.from_bytes(digest[:16], "little")))


@dataclass(frozen=True)
class Character:
    """A point in the space of human types; every dial lies in [0, 1].

    expertise 0 beginner .. 1 expert, stamina 0 tired .. 1 rested, attention 0 distracted ..
    1 attentive, collaborativeness 0 noncollaborative .. 1 collaborative.
    Raises CharacterError naming the dial when a value is not a finite number in [0, 1].
    """

    expertise: float
    stamina: float
    attention: float
    collaborativeness: float

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if type(value) is float and 0.0 <= value <= 1.0:
                continue
            if isinstance(value, bool) or not isinstance(value, Real):
                raise CharacterError(f"{field.name} is {value!r}; allowed: a number in [0, 1]")
            value = float(value)
            if not math.isfinite(value):
                raise CharacterError(f"{field.name} is {value}; allowed: a number in [0, 1]")
            if not 0.0 <= value <= 1.0:
                raise CharacterError(f"{field.name} is {value:g}; allowed: a number in [0, 1]")
            object.__setattr__(self, field.name, value)

    @property
    def dials(self) -> tuple[float, float, float, float]:
        """(expertise, stamina, attention, collaborativeness)."""
        return (self.expertise, self.stamina, self.attention, self.collaborativeness)

    @property
    def influences(self) -> tuple[float, ...]:
        """Values of INFLUENCES, (8,): the dials, then one minus each dial."""
        return self.dials + tuple(1.0 - dial for dial in self.dials)

    def influence(self, name: str) -> float:
        """Return one of `influences` by name."""
        return self.influences[INFLUENCES.index(name)]

    @cached_property
    def name(self) -> str:
        """Name of the corner, or "e,s,a,c" with what is needed to read it back."""
        if all(dial in (0.0, 1.0) for dial in self.dials):
            return corner_name(self.dials)
        return ",".join(f"{dial:.10g}" for dial in self.dials)

    def with_dials(self, **dials: float) -> Character:
        """Return a copy with some dials replaced."""
        return replace(self, **dials)

    @classmethod
    def random(cls, rng: np.random.Generator) -> Character:
        """Draw a point uniformly, to three decimals."""
        return cls(*(round(float(dial), 3) for dial in rng.random(4)))

    @classmethod
    def parse(cls, text: str, rng: np.random.Generator | None = None) -> Character:
        """Read a corner's name, "e,s,a,c", or "random" (needs `rng`); raises CharacterError."""
        text = str(text).strip()
        if text in CORNERS:
            return CORNERS[text]
        if text == "random":
            if rng is None:
                raise CharacterError("human type 'random' needs a random generator")
            return cls.random(rng)
        if "," in text:
            return cls._of_numbers(text)
        raise CharacterError(f"unknown human type '{text}'; allowed: {_allowed()}")

    @classmethod
    def _of_numbers(cls, text: str) -> Character:
        parts = text.split(",")
        if len(parts) != 4:
            raise CharacterError(
                f"human type '{text}' has {len(parts)} numbers; allowed: {_allowed()}"
            )
        try:
            return cls(*map(float, parts))
        except CharacterError as error:
            raise CharacterError(f"human type '{text}': {error}") from None
        except ValueError:
            raise CharacterError(
                f"human type '{text}' is not four numbers; allowed: {_allowed()}"
            ) from None


def corner_name(dials: tuple[float, ...]) -> str:
    """Name of a corner given its four dials, each 0 or 1."""
    return "_".join(
        (high if dial else low)
        for dial, low, high in zip(dials, LOW_NAMES, HIGH_NAMES, strict=True)
    )


def _corners() -> dict[str, Character]:
    every = ([float(number >> bit & 1) for bit in (3, 2, 1, 0)] for number in range(16))
    return {corner_name(dials): Character(*dials) for dials in map(tuple, every)}


#: The 16 known types by name, from beginner_tired_distracted_noncollaborative to the opposite.
CORNERS = _corners()


def _allowed() -> str:
    words = "_".join(f"{low}|{high}" for low, high in zip(LOW_NAMES, HIGH_NAMES, strict=True))
    return f"{words}, four numbers e,s,a,c in [0, 1], random, mixed, drifting"


def human_of_task(spec: str, seed: int, task_number: int) -> Character:
    """Return the person of a task (numbered from 1) under the launch argument `human:=spec`.

    A name or "e,s,a,c" is the same person in every task, `random` one random person for the run,
    `mixed` another known type each task; all are decided by `seed`. Raises CharacterError.
    """
    if task_number < 1:
        raise CharacterError(f"task number is {task_number}; allowed: 1 or more")
    if str(spec).strip() == "mixed":
        block, place = divmod(task_number - 1, len(CORNERS))
        return list(CORNERS.values())[_mixed_order(seed, block)[place]]
    drawn = str(spec).strip() == "random"
    return Character.parse(spec, named_generator(seed, "human") if drawn else None)


@lru_cache(maxsize=64)
def _mixed_order(seed: int, block: int) -> list[int]:
    """Order of the known types in the block-th sixteen tasks; no type comes twice in a row."""
    order = named_generator(seed, "human", block).permutation(len(CORNERS)).tolist()
    if block > 0:
        last = named_generator(seed, "human", block - 1).permutation(len(CORNERS))[-1]
        if order[0] == last:
            order[0], order[1] = order[1], order[0]
    return order
