# SPDX-License-Identifier: BSD-3-Clause
"""The numbers of the simulated workers: typed, read from config/worker.yaml, checked by name."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, is_dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
import yaml

from .character import INFLUENCES

STATES = (
    "task_assigned", "evaluating", "no_attention", "tired", "failed_to_grasp", "recovery",
    "robot_interfered", "warns_the_robot", "robot_receives_the_warning", "task_assigned_to_robot",
    "success", "failure",
)  # fmt: skip
ACTIONS = ("idle", "grasp", "look_around", "walk_away", "warn")
SCENARIOS = ("inspection", "sorting")


class WorkerParameterError(ValueError):
    """A parameter of the workers is missing, unknown or out of range; the message says which."""


@dataclass(frozen=True)
class Span:
    """A lognormal duration, clipped: mean, least and most in s, cv = deviation / mean."""

    mean: float
    cv: float
    least: float
    most: float

    def check(self, where: str) -> None:
        """Raise WorkerParameterError unless 0 < least <= mean <= most and cv > 0."""
        if not (0.0 < self.least <= self.mean <= self.most and self.cv > 0.0):
            raise WorkerParameterError(
                f"{where}: needs 0 < least <= mean <= most and cv > 0, got "
                f"{self.least:g}, {self.mean:g}, {self.most:g}, cv {self.cv:g}"
            )

    def draw(self, rng: np.random.Generator, factor: float = 1.0) -> float:
        """Draw a duration in s; `factor` stretches all of it."""
        deviation, shift = self._of_logarithm
        value = self.mean * math.exp(deviation * rng.standard_normal() - shift)
        return factor * min(self.most, max(self.least, value))

    @cached_property
    def _of_logarithm(self) -> tuple[float, float]:
        """Deviation of the duration's logarithm, and how far its mean lies below log(mean)."""
        variance = math.log1p(self.cv * self.cv)
        return math.sqrt(variance), variance / 2.0


@dataclass(frozen=True)
class ScenarioTiming:
    """How long the pieces of behaviour take in one scenario; `leave`/`come_back` are the walk.

    slowness stretches thinking and handling by 1 + sum of influence * weight.
    """

    slowness: dict[str, float]
    idle: Span
    look_around: Span
    warn: Span
    leave: Span
    rest: Span
    come_back: Span
    failed_attempt: Span
    reach: Span
    carry: Span
    retreat: Span
    reaction: Span
    late_reaction: Span
    settle: Span


@dataclass(frozen=True)
class TimingParameters:
    """Durations per scenario."""

    inspection: ScenarioTiming
    sorting: ScenarioTiming


@dataclass(frozen=True)
class ModelParameters:
    """Tables of the MDP; `transitions` and `rewards` are checked by WorkerModel's builder."""

    discount: float
    temperature: float
    allowed: dict[str, list]
    transitions: dict[str, dict]
    rewards: dict[str, Any]


@dataclass(frozen=True)
class HistoryParameters:
    """How n_r and k_t move the dials; units in worker.yaml."""

    horizon: float
    weariness: float
    boredom: float
    strain: float
    patience: float
    annoyance: float
    restored: float
    practice: float
    practice_horizon: float
    helped_work: float
    rest: float
    repeated_gesture: float
    near_miss: float
    work: dict[str, float]


@dataclass(frozen=True)
class ResponseParameters:
    """Answers to the robot; probabilities and seconds where nothing else is said.

    person_counts, origin_counts: factors by scenario, of the log-odds of refusing that the person
    and the place of the interruption bring. own_credit, refusal_shift: log-odds of refusing, by
    scenario and by place.
    """

    person_counts: dict[str, float]
    origin_counts: dict[str, float]
    own_credit: dict[str, float]
    refusal_shift: dict[str, float]
    distraction_relief: float
    distraction_time: float
    pointing: dict[str, float]
    pointing_annoys_from: int
    planning_warned: float
    planning_wakes: float
    planning_spurs: float


@dataclass(frozen=True)
class MemoryParameters:
    """Memory of the sorting rules of a task; shares and probabilities in [0, 1].

    learns, taught: share of what is unknown that a right placement of one's own, or of the robot's,
    makes known.
    """

    known: float
    inexperience: float
    distraction: float
    learns: float
    taught: float
    forgets: float
    hesitation: float


@dataclass(frozen=True)
class TruthParameters:
    """Thresholds of the rule in truth.py; counts of steps and a probability."""

    stage_one: int
    reminders: int
    failures: int
    wants_help: float


@dataclass(frozen=True)
class WorkerParameters:
    """Everything in config/worker.yaml."""

    model: ModelParameters
    history: HistoryParameters
    responses: ResponseParameters
    memory: MemoryParameters
    timing: TimingParameters
    truth: TruthParameters

    @classmethod
    def load(cls, path: Path | None = None) -> WorkerParameters:
        """Read a file, by default the package's; raises WorkerParameterError naming the entry."""
        path = Path(path) if path else default_path()
        try:
            content = yaml.safe_load(path.read_text())
        except (OSError, yaml.YAMLError) as error:
            raise WorkerParameterError(f"{path}: {error}") from None
        return cls.of(content, path.name)

    @classmethod
    def of(cls, content: Any, where: str = "worker") -> WorkerParameters:
        """Build from nested dicts; raises WorkerParameterError naming the entry."""
        parameters = _build(cls, content, where)
        _check_ranges(parameters, where)
        return parameters


def default_path() -> Path:
    """Where the package's worker.yaml lies, in the source tree or in an install space."""
    here = Path(__file__).resolve()
    candidates = [here.parents[2] / "config" / "worker.yaml"]
    if len(here.parents) > 4:
        candidates.append(here.parents[4] / "share" / "fabric_sim" / "config" / "worker.yaml")
    for path in candidates:
        if path.is_file():
            return path
    raise WorkerParameterError(f"no worker.yaml at {' nor '.join(map(str, candidates))}")


def _build(kind: Any, content: Any, where: str) -> Any:
    """Turn nested dicts into nested dataclasses; keys must match exactly."""
    if not isinstance(content, dict):
        raise WorkerParameterError(f"{where}: expected a mapping, got {content!r}")
    hints = get_type_hints(kind)
    names = [field.name for field in fields(kind)]
    for name in content:
        if name not in names:
            raise WorkerParameterError(f"{where}.{name}: unknown; allowed: {', '.join(names)}")
    for name in names:
        if name not in content:
            raise WorkerParameterError(f"{where}.{name}: missing")
    built = kind(**{n: _value(hints[n], content[n], f"{where}.{n}") for n in names})
    if isinstance(built, Span):
        built.check(where)
    return built


def _value(kind: Any, value: Any, where: str) -> Any:
    if is_dataclass(kind):
        return _build(kind, value, where)
    if kind is float:
        return number(value, where)
    if kind is int:
        if isinstance(value, bool) or not isinstance(value, int) or value < 0:
            raise WorkerParameterError(f"{where}: {value!r} is not a count")
        return value
    if not isinstance(value, dict):
        raise WorkerParameterError(f"{where}: expected a mapping, got {value!r}")
    if kind == dict[str, float]:
        return {key: number(item, f"{where}.{key}") for key, item in value.items()}
    return value


def number(value: Any, where: str) -> float:
    """Return a finite float; raises WorkerParameterError naming NaN, infinity and non-numbers."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise WorkerParameterError(f"{where}: {value!r} is not a number")
    if not math.isfinite(value):
        raise WorkerParameterError(f"{where}: {value} is not finite")
    return float(value)


def _check_ranges(p: WorkerParameters, where: str) -> None:
    _within(p.model.discount, 0.0, 0.999999, f"{where}.model.discount")
    _positive(p.model.temperature, f"{where}.model.temperature")
    for name in ("horizon", "patience", "practice_horizon"):
        _positive(getattr(p.history, name), f"{where}.history.{name}")
    _positive(p.responses.distraction_time, f"{where}.responses.distraction_time")
    for name in ("weariness", "boredom", "strain", "annoyance", "practice", "helped_work"):
        _within(getattr(p.history, name), 0.0, 1.0, f"{where}.history.{name}")
    for field in fields(p.memory):
        _within(getattr(p.memory, field.name), 0.0, 1.0, f"{where}.memory.{field.name}")
    for name in ("planning_warned", "planning_wakes", "planning_spurs"):
        _within(getattr(p.responses, name), 0.0, 1.0, f"{where}.responses.{name}")
    for state, chance in p.responses.pointing.items():
        known(state, STATES, f"{where}.responses.pointing")
        _within(chance, 0.0, 1.0, f"{where}.responses.pointing.{state}")
    for scenario in SCENARIOS:
        for influence in getattr(p.timing, scenario).slowness:
            known(influence, INFLUENCES, f"{where}.timing.{scenario}.slowness")
    _within(p.truth.wants_help, 0.0, 1.0, f"{where}.truth.wants_help")
    _check_scenarios(p, where)


def _check_scenarios(p: WorkerParameters, where: str) -> None:
    """What differs by scenario is there for each of them; only a credit may be negative."""
    _every_scenario(p.history.work, f"{where}.history.work")
    for name in ("person_counts", "origin_counts"):
        counts, here = getattr(p.responses, name), f"{where}.responses.{name}"
        _every_scenario(counts, here)
        for scenario, value in counts.items():
            _within(value, 0.0, math.inf, f"{here}.{scenario}")
    _every_scenario(p.responses.own_credit, f"{where}.responses.own_credit")


def _every_scenario(values: dict[str, float], where: str) -> None:
    for scenario in values:
        known(scenario, SCENARIOS, where)
    for scenario in SCENARIOS:
        if scenario not in values:
            raise WorkerParameterError(f"{where}.{scenario}: missing")


def known(name: str, allowed: tuple, where: str) -> str:
    """Return the name if it is one of `allowed`, else raise WorkerParameterError."""
    if name not in allowed:
        raise WorkerParameterError(f"{where}: unknown '{name}'; allowed: {', '.join(allowed)}")
    return name


def _within(value: float, least: float, most: float, where: str) -> None:
    if not least <= value <= most:
        raise WorkerParameterError(f"{where}: {value:g} is outside [{least:g}, {most:g}]")


def _positive(value: float, where: str) -> None:
    if value <= 0.0:
        raise WorkerParameterError(f"{where}: {value:g} is not positive")
