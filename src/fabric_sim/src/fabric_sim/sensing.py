# SPDX-License-Identifier: BSD-3-Clause
"""Direct sensing: what gesture recogniser, head tracker, colour camera and load cells report.

They see the truth through a model of their errors. Every object draws from a generator of its own.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from mypy_extensions import mypyc_attr

from fabric_msgs.clock import micro
from fabric_msgs.msg import Container, Cube, HumanActivity
from fabric_sim.entries import Entries

ACTIVITIES = 4  # HumanActivity.IDLE, GRASP, WARN, OTHER
COLOURS = (Cube.COLOUR_RED, Cube.COLOUR_GREEN, Cube.COLOUR_BLUE)
SWAPPED = {HumanActivity.GRASP: HumanActivity.WARN, HumanActivity.WARN: HumanActivity.GRASP}
SLACK = 1e-9  # s; forgives rounding when times are compared


class Behaviour(NamedTuple):
    """What can be seen of the person."""

    activity: int = HumanActivity.IDLE
    looking_around: bool = False
    present: bool = True


class Percept(NamedTuple):
    """What is seen of the person at one moment."""

    behaviour: Behaviour  # as recognised
    posterior: tuple[float, ...]  # (4,), indexed by HumanActivity's constants, sums to 1
    evidence_age: float  # s since the person was last in view
    warning: bool  # a warning is recognised for the first time


@mypyc_attr(native_class=False)  # travels between processes
@dataclass(frozen=True)
class DirectParameters:
    """Numbers of config/sensing.yaml: probabilities, and times in s."""

    confusion: float
    swap_share: float
    delay: tuple[float, float]
    certainty: tuple[float, float]
    colour_misread: float
    colour_certainty: tuple[float, float]
    settle: dict[int, tuple[float, float]]  # by Container.OWNER_*


class _Stretch(NamedTuple):
    """A stretch of one behaviour and what it will be taken for."""

    recognised: float  # s
    taken_for: Behaviour
    certainty: float

    def posterior(self) -> tuple[float, ...]:
        """(4,), indexed by HumanActivity's constants, sums to 1."""
        if not self.taken_for.present:
            return (1.0 / ACTIVITIES,) * ACTIVITIES
        rest = (1.0 - self.certainty) / (ACTIVITIES - 1)
        believed = self.taken_for.activity
        return tuple(self.certainty if i == believed else rest for i in range(ACTIVITIES))


class PersonSensor:
    """Recognises behaviour late, and each stretch of it right or wrong as a whole."""

    def __init__(self, parameters: DirectParameters, rng: np.random.Generator) -> None:
        self._parameters = parameters
        self._rng = rng
        self._actual: tuple[Behaviour, int] | None = None
        self._shown: _Stretch | None = None
        self._percept: Percept | None = None  # of what is shown, of a person in view
        self._posterior: tuple[float, ...] = ()  # of what is shown
        self._coming: list[_Stretch] = []
        self._seen = 0.0

    def sense(self, t: float, behaviour: Behaviour, episode: int = 0) -> Percept:
        """What is recognised at time t (s) of a person who behaves so now.

        A stretch ends with its behaviour, or when `episode` changes: the same gesture anew.
        """
        if not self.knows(behaviour, episode):
            self._actual = (behaviour, episode)
            self._begin(t, behaviour)
        warning = bool(self._coming) and self._recognise(t)
        percept = self.still(t)
        return percept._replace(warning=True) if warning else percept

    def still(self, t: float) -> Percept:
        """What is recognised at time t (s), before `wakeup`, of a person who goes on alike."""
        assert self._shown is not None
        if self._percept is not None:
            self._seen = t
            return self._percept
        return Percept(self._shown.taken_for, self._posterior, micro(t - self._seen), False)

    def knows(self, behaviour: Behaviour, episode: int) -> bool:
        """Whether this goes on from the last call."""
        return self._actual == (behaviour, episode)

    def pass_time(self, t: float) -> None:
        """The same is recognised until time t (s)."""
        if self._shown is not None and self._shown.taken_for.present:
            self._seen = t

    @property
    def wakeup(self) -> float:
        """When something else is recognised of a person who goes on alike, s; else infinite."""
        return self._coming[0].recognised if self._coming else math.inf

    def _begin(self, t: float, behaviour: Behaviour) -> None:
        delay = _uniform(self._rng, self._parameters.delay)
        stretch = _Stretch(
            t + delay, self._confuse(behaviour), _uniform(self._rng, self._parameters.certainty)
        )
        if self._shown is None:
            self._show(stretch)
            self._seen = t
        else:
            self._coming.append(stretch)

    def _recognise(self, t: float) -> bool:
        """Go on to what is due; True when that includes a new warning."""
        warning = False
        while self._coming and self._coming[0].recognised <= t + SLACK:
            stretch = self._coming.pop(0)
            self._show(stretch)
            warning |= stretch.taken_for.activity == HumanActivity.WARN
        return warning

    def _show(self, stretch: _Stretch) -> None:
        self._shown, self._posterior = stretch, stretch.posterior()
        seen = stretch.taken_for
        self._percept = Percept(seen, self._posterior, 0.0, False) if seen.present else None

    def _confuse(self, behaviour: Behaviour) -> Behaviour:
        """The behaviour, or with the probability `confusion` what it is mistaken for."""
        wrong: float = self._rng.random()
        swap: float = self._rng.random()
        if not behaviour.present or wrong >= self._parameters.confusion:
            return behaviour
        if behaviour.activity not in SWAPPED:
            return behaviour._replace(looking_around=not behaviour.looking_around)
        if swap < self._parameters.swap_share:
            return behaviour._replace(activity=SWAPPED[behaviour.activity])
        return behaviour._replace(activity=HumanActivity.IDLE)


class ColourSensor:
    """Reads a cube's colour once, sometimes wrongly."""

    def __init__(self, parameters: DirectParameters, rng: np.random.Generator) -> None:
        self._parameters = parameters
        self._rng = rng

    def read(self, colour: int) -> tuple[int, float]:
        """The colour as perceived (Cube.COLOUR_*) and the confidence in it."""
        wrong: float = self._rng.random()
        which: float = self._rng.random()
        confidence = _uniform(self._rng, self._parameters.colour_certainty)
        if wrong < self._parameters.colour_misread:
            others = [c for c in COLOURS if c != colour]
            colour = others[int(which * len(others))]
        return colour, micro(confidence)


class LoadCells:
    """Report what lies in a container after a while, each cube once."""

    def __init__(self, parameters: DirectParameters, rng: np.random.Generator) -> None:
        self._parameters = parameters
        self._rng = rng
        self._settling: list[tuple[float, int, int]] = []

    def put(self, t: float, container: int, owner: int, cube: int) -> None:
        """A cube was put into a container at time t (s); owner is Container.OWNER_*."""
        settled = t + _uniform(self._rng, self._parameters.settle[owner])
        self._settling.append((settled, container, cube))

    @property
    def wakeup(self) -> float:
        """When the next container is reported, s; infinite when none is settling."""
        return min(self._settling)[0] if self._settling else math.inf

    def settled(self, t: float) -> list[tuple[int, int]]:
        """(container, cube) of everything reported by time t, in the order of settling."""
        if self.wakeup > t + SLACK:
            return []
        due = sorted(entry for entry in self._settling if entry[0] <= t + SLACK)
        self._settling = [entry for entry in self._settling if entry[0] > t + SLACK]
        return [(container, cube) for _, container, cube in due]


def _uniform(rng: np.random.Generator, span: tuple[float, float]) -> float:
    """Return what `rng.uniform(*span)` does, sooner."""
    chance: float = rng.random()
    return span[0] + (span[1] - span[0]) * chance


def load_sensing(path: str | Path) -> DirectParameters:
    """Read config/sensing.yaml. Raises ConfigError naming the file, the entry and its value."""
    entries = Entries.read(path).branch("direct")
    return DirectParameters(
        confusion=entries.number("confusion", 0.0, 1.0),
        swap_share=entries.number("swap_share", 0.0, 1.0),
        delay=entries.span("delay", 0.0, 10.0),
        certainty=entries.span("certainty", 1.0 / ACTIVITIES, 1.0),
        colour_misread=entries.number("colour_misread", 0.0, 1.0),
        colour_certainty=entries.span("colour_certainty", 0.0, 1.0),
        settle={
            Container.OWNER_PERSON: entries.span("settle_person", 0.0, 10.0),
            Container.OWNER_ROBOT: entries.span("settle_robot", 0.0, 10.0),
            Container.OWNER_BELT: entries.span("settle_belt", 0.0, 10.0),
        },
    )
