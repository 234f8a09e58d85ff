# SPDX-License-Identifier: BSD-3-Clause
"""What a test says: numbers, or a sentence where numbers would have no meaning."""

import math
from dataclasses import dataclass

CONFIDENCE = 0.95
ALPHA = 0.05


@dataclass(frozen=True)
class Effect:
    """An effect size or a difference, with its 95 % interval where there is one."""

    name: str
    value: float
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class Result:
    """A test that could be made. All numbers are finite."""

    test: str
    n: int  # of `unit`
    statistic: str
    value: float
    df: tuple[float, ...]
    p: float
    effects: tuple[Effect, ...] = ()
    note: str = ""
    unit: str = "people"

    def __post_init__(self) -> None:
        """Refuse numbers that are none: ValueError naming test and number."""
        numbers = [self.value, self.p, *self.df]
        for effect in self.effects:
            numbers += [effect.value, effect.low or 0.0, effect.high or 0.0]
        if not all(math.isfinite(number) for number in numbers):
            raise ValueError(f"{self.test}: a number is not finite: {self}")


@dataclass(frozen=True)
class NoResult:
    """A test that could not be made, and why: a sentence without a full stop."""

    test: str
    reason: str


Outcome = Result | NoResult


def p_text(p: float) -> str:
    """Return "p = .038" or "p < .001"."""
    return "p < .001" if p < 0.001 else f"p = {p:.3f}".replace("0.", ".", 1)


def number_text(value: float, digits: int = 2) -> str:
    """Return a number with a fixed count of decimals; no minus before zero."""
    text = f"{value:.{digits}f}"
    return text[1:] if text.startswith("-") and float(text) == 0.0 else text


def effect_text(effect: Effect, digits: int = 2) -> str:
    """Return "dz = 0.62 [0.03, 1.19]"."""
    text = f"{effect.name} = {number_text(effect.value, digits)}"
    if effect.low is None or effect.high is None:
        return text
    return f"{text} [{number_text(effect.low, digits)}, {number_text(effect.high, digits)}]"


def statistic_text(outcome: Outcome) -> str:
    """Return "t(13) = 2.31, p = .038", or the sentence that says why there is none."""
    if isinstance(outcome, NoResult):
        return outcome.reason
    df = ", ".join(f"{value:.2f}".rstrip("0").rstrip(".") for value in outcome.df)
    place = f"({df})" if df else ""
    return f"{outcome.statistic}{place} = {number_text(outcome.value)}, {p_text(outcome.p)}"
