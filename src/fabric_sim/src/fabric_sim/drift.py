# SPDX-License-Identifier: BSD-3-Clause
"""One person over a scenario, who starts normal and drifts (thesis section 4.3).

Task by task the person is normal, stubborn, tired or distracted; the moods become likelier with
the task number. A mood moves the dials of the person's own character for that task, while what
the person went through (n_r, k_t, practice) goes on. Moods depend on the seed only, so that
every robot meets the same person in the same moods.

    staff = DriftingStaff(seed=101)
    worker = staff.worker(1)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import yaml

from .character import Character, named_generator
from .worker import Worker
from .worker_model import ModelLibrary
from .worker_parameters import WorkerParameters, default_path, known, number

NORMAL = "normal"
DIALS = tuple(field.name for field in fields(Character))
_OWN_DIALS = ("expertise", "stamina", "attention")  # trust decides the fourth

Range = tuple[float, float]


class DriftError(ValueError):
    """A number of drift.yaml that cannot be meant; the message names file, entry and value."""


@dataclass(frozen=True)
class Pull:
    """A move of a dial: dial + by * (to - dial); both in [0, 1]."""

    to: float
    by: float


@dataclass(frozen=True)
class Mood:
    """A mood, how likely it is, and what it does to the dials."""

    name: str
    most: float
    never_until: float
    full_from: float
    dials: dict[str, Pull]

    def probability(self, task_number: int) -> float:
        """Return the probability in a task: 0, then a smooth step, then `most`."""
        x = (task_number - self.never_until) / (self.full_from - self.never_until)
        x = min(1.0, max(0.0, x))
        return self.most * x * x * (3.0 - 2.0 * x)

    def applied(self, person: Character) -> Character:
        """Return the dials of a person in this mood."""
        moved = {
            dial: getattr(person, dial) + pull.by * (pull.to - getattr(person, dial))
            for dial, pull in self.dials.items()
        }
        return person.with_dials(**moved)


@dataclass(frozen=True)
class DriftParameters:
    """The numbers of config/drift.yaml; ranges are (least, most) of a uniform draw."""

    expertise: Range
    stamina: Range
    attention: Range
    trust_share: float
    trusting: Range
    wary: Range
    moods: tuple[Mood, ...]

    @classmethod
    def load(cls, path: Path | None = None) -> DriftParameters:
        """Read a file, by default the package's. Raises DriftError naming file, entry and value."""
        path = path or default_path().with_name("drift.yaml")
        try:
            content = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
        except (OSError, yaml.YAMLError) as error:
            raise DriftError(f"{path}: cannot be read: {error}") from error
        return cls.parse(content, str(path))

    @classmethod
    def parse(cls, content: Any, where: str) -> DriftParameters:
        """As load, from nested mappings; `where` begins every message."""
        try:
            return cls._parse(content, where)
        except DriftError:
            raise
        except ValueError as error:  # of the shared readers of worker_parameters
            raise DriftError(str(error)) from None

    @classmethod
    def _parse(cls, content: Any, where: str) -> DriftParameters:
        _keys(content, ("person", "trust", "moods"), where)
        person, trust = content["person"], content["trust"]
        _keys(person, _OWN_DIALS, f"{where}: person")
        _keys(trust, ("share", "trusting", "wary"), f"{where}: trust")
        return cls(
            **{dial: _range(person[dial], f"{where}: person.{dial}") for dial in _OWN_DIALS},
            trust_share=_share(trust["share"], f"{where}: trust.share"),
            trusting=_range(trust["trusting"], f"{where}: trust.trusting"),
            wary=_range(trust["wary"], f"{where}: trust.wary"),
            moods=_moods(content["moods"], f"{where}: moods"),
        )

    def chances(self, task_number: int) -> dict[str, float]:
        """Return the probability of each mood in a task, normal first; they sum to 1."""
        of_moods = {mood.name: mood.probability(task_number) for mood in self.moods}
        return {NORMAL: 1.0 - sum(of_moods.values()), **of_moods}


def _keys(content: Any, names: tuple[str, ...], where: str) -> None:
    if not isinstance(content, dict):
        raise DriftError(f"{where}: expected a mapping, got {content!r}")
    for name in content:
        known(name, names, where)
    for name in names:
        if name not in content:
            raise DriftError(f"{where}.{name}: missing")


def _share(value: Any, where: str) -> float:
    value = number(value, where)
    if not 0.0 <= value <= 1.0:
        raise DriftError(f"{where}: {value:g} is outside [0, 1]")
    return value


def _range(value: Any, where: str) -> Range:
    if not isinstance(value, list) or len(value) != 2:
        raise DriftError(f"{where}: expected [least, most], got {value!r}")
    least, most = (_share(item, f"{where}[{index}]") for index, item in enumerate(value))
    if least > most:
        raise DriftError(f"{where}: least {least:g} is above most {most:g}")
    return least, most


def _moods(content: Any, where: str) -> tuple[Mood, ...]:
    if not isinstance(content, dict) or not content:
        raise DriftError(f"{where}: expected a mapping of moods, got {content!r}")
    moods = tuple(_mood(name, values, f"{where}.{name}") for name, values in content.items())
    total = sum(mood.most for mood in moods)
    if total > 1.0 + 1e-9:
        raise DriftError(f"{where}: the `most` of all moods sum to {total:g}, more than 1")
    return moods


def _mood(name: str, values: Any, where: str) -> Mood:
    if name == NORMAL:
        raise DriftError(f"{where}: normal is what the moods leave over")
    _keys(values, ("most", "never_until", "full_from", "dials"), where)
    never_until = number(values["never_until"], f"{where}.never_until")
    full_from = number(values["full_from"], f"{where}.full_from")
    if not 0.0 <= never_until < full_from:
        raise DriftError(
            f"{where}: needs 0 <= never_until < full_from, got {never_until:g}, {full_from:g}"
        )
    if not isinstance(values["dials"], dict) or not values["dials"]:
        raise DriftError(f"{where}.dials: expected a mapping of dials, got {values['dials']!r}")
    pulls = {}
    for dial, pull in values["dials"].items():
        place = f"{where}.dials.{known(dial, DIALS, f'{where}.dials')}"
        _keys(pull, ("to", "by"), place)
        pulls[dial] = Pull(_share(pull["to"], f"{place}.to"), _share(pull["by"], f"{place}.by"))
    most = _share(values["most"], f"{where}.most")
    return Mood(name, most, never_until, full_from, pulls)


class DriftingStaff:
    """The person of a scenario, task by task; same interface as staff.Staff."""

    def __init__(
        self,
        seed: int,
        parameters: DriftParameters | None = None,
        worker_parameters: WorkerParameters | None = None,
        library: ModelLibrary | None = None,
        make_worker: Callable[..., Worker] = Worker,
    ) -> None:
        """Draw the person. make_worker: Worker or a subclass of it."""
        self._seed = seed
        self._p = parameters or DriftParameters.load()
        workers = worker_parameters or WorkerParameters.load()
        self.person = self._draw_person()
        rng = named_generator(seed, "worker", 1)
        self._worker = make_worker(
            self.person, rng, workers, library or ModelLibrary(workers.model)
        )

    def _draw_person(self) -> Character:
        rng, p = named_generator(self._seed, "drift", "person"), self._p
        own = {dial: float(rng.uniform(*getattr(p, dial))) for dial in _OWN_DIALS}
        trust = p.trusting if rng.random() < p.trust_share else p.wary
        return Character(**own, collaborativeness=float(rng.uniform(*trust)))

    def mood(self, task_number: int) -> str:
        """Return the mood of a task, numbered from 1; decided by the seed alone."""
        if task_number < 1:
            raise ValueError(f"task number is {task_number}; allowed: 1 or more")
        draw = named_generator(self._seed, "drift", "mood", task_number).random()
        for mood in self._p.moods:
            draw -= mood.probability(task_number)
            if draw < 0.0:
                return mood.name
        return NORMAL

    def worker(self, task_number: int) -> Worker:
        """Return the person in the mood of a task, numbered from 1; the history is kept."""
        name = self.mood(task_number)
        mood = next((mood for mood in self._p.moods if mood.name == name), None)
        if mood is None:
            self._worker.person.become(self.person)
        else:
            self._worker.person.become(mood.applied(self.person))
        return self._worker
