# SPDX-License-Identifier: BSD-3-Clause
"""Task definitions: which cubes come, where they belong, what counts as success."""

import hashlib
import random
from dataclasses import dataclass
from pathlib import Path

from fabric_msgs.msg import SortingRule
from fabric_study.strict_yaml import DefinitionError, Section, read
from fabric_study.task_rules import COLOUR_NAMES, COLOURS, Rules, allowed, read_rules

LABELS = {"inspection": ("inspected",), "sorting": ("red", "green", "blue")}
MAX_CUBES = 100


@dataclass(frozen=True)
class Scores:
    """Points of the score that people see (thesis 6.2.2), one of them per subtask."""

    person: int
    robot: int
    wrong: int


@dataclass(frozen=True)
class TaskDefinition:
    """One kind of task; read it with `load_definition`, which checks everything."""

    name: str
    scenario: str  # inspection or sorting
    count: int  # cubes
    order: tuple[int, ...]  # Cube.COLOUR_* in the order of arrival; empty: drawn by seed
    rules: Rules
    rules_display_time: float  # s
    t_max: float  # s from the arrival of a cube until the belt carries it on
    belt_speed: float  # m/s
    arrival_limit: float  # s that the belt may take to bring a cube
    overrun_limit: float  # s that the belt may take to carry a cube away
    success_needs: int  # subtasks that must succeed
    fails_at: int | None  # wrong subtasks that end the task at once; None: it goes to the end
    warning_gap: float  # s of silence that separate two warnings
    scores: Scores
    load: float = 1.0  # cognitive load relative to task type 4; only simulated people feel it

    def cube_colours(self, seed: int) -> tuple[int, ...]:
        """Return the colours (count,) in the order of arrival; equal seeds give equal orders."""
        if self.order:
            return self.order
        colours = self.rules.colours
        cubes = [colours[index % len(colours)] for index in range(self.count)]
        if self.count > 1:
            random.Random(f"{seed}/cube_order").shuffle(cubes)
        return tuple(cubes)

    def sorting_rules(self) -> list[SortingRule]:
        """Return the items to remember as messages, in the order in which they are shown."""
        return [item.message() for item in self.rules.items]

    def cube_rules(self, seed: int) -> tuple[int, ...]:
        """Return for every cube in the order of arrival the index of its item of the rules."""
        return self.rules.of_cubes(self.cube_colours(seed))


def task_seed(root_seed: int, task_id: int) -> int:
    """Return the seed of a task of a run, 0..2^31-1, derived from the run's seed by name."""
    digest = hashlib.sha256(f"{root_seed}/task/{task_id}".encode()).digest()
    return int.from_bytes(digest[:4], "big") >> 1


def definitions_folder() -> Path:
    """Return the folder of the shipped definitions, in the source tree or installed."""
    here = Path(__file__).resolve()
    candidates = [here.parents[2] / "config" / "tasks"]
    if len(here.parents) > 4:
        candidates.append(here.parents[4] / "share" / "fabric_study" / "config" / "tasks")
    for candidate in candidates:
        if candidate.is_dir():
            return candidate
    raise DefinitionError(f"no task definitions in {' or '.join(map(str, candidates))}")


def definition_names() -> list[str]:
    """Return the names of the shipped definitions."""
    return sorted(path.stem for path in definitions_folder().glob("*.yaml"))


def load_definition(name_or_path: str) -> TaskDefinition:
    """Return a shipped definition by name, or the one in a .yaml file by path.

    Raises DefinitionError naming the file, the key and the value that cannot be meant.
    """
    path = Path(name_or_path)
    if path.suffix != ".yaml":
        if name_or_path not in definition_names():
            raise DefinitionError(
                f"no task definition {name_or_path!r}; "
                f"there are {', '.join(definition_names())}, or give a .yaml file"
            )
        path = definitions_folder() / f"{name_or_path}.yaml"
    return _definition(path.stem, read(path))


def _definition(name: str, top: Section) -> TaskDefinition:
    scenario = top.choice("scenario", tuple(LABELS))
    count, order = _cubes(top.section("cubes"))
    if scenario == "inspection" and count != 1:
        raise top.error("cubes.count", f"is {count}; an inspection task has one package")
    rules = read_rules(top.section("rules"), LABELS[scenario], count)
    _check_order(top, order, rules)
    definition = TaskDefinition(
        name=name,
        scenario=scenario,
        count=count,
        order=order,
        rules=rules,
        rules_display_time=top.number("rules_display_time", 0.0, 600.0),
        t_max=top.number("t_max", 1.0, 3600.0),
        belt_speed=top.number("belt_speed", 0.001, 0.5),
        arrival_limit=top.number("arrival_limit", 1.0, 600.0, 60.0),
        overrun_limit=top.number("overrun_limit", 1.0, 600.0, 30.0),
        success_needs=top.integer("success_needs", 1, count),
        fails_at=_fails_at(top, count),
        warning_gap=top.number("warning_gap", 0.0, 60.0, 1.0),
        scores=_scores(top.section("scores")),
        load=top.number("load", 0.0, 3.0, 1.0),
    )
    top.finish()
    return definition


def _cubes(section: Section) -> tuple[int, tuple[int, ...]]:
    count = section.integer("count", 1, MAX_CUBES)
    order = section.value("order")
    section.finish()
    if order == "random":
        return count, ()
    if not isinstance(order, list):
        raise section.error("order", f"is {order!r}; it must be random or a list of colours")
    for number, colour in enumerate(order, start=1):
        if not isinstance(colour, str) or colour not in COLOURS:
            raise section.error("order", f"cube {number} is {colour!r}; {allowed(COLOURS)}")
    if len(order) != count:
        raise section.error("order", f"lists {len(order)} cubes, but count is {count}")
    return count, tuple(COLOURS[colour] for colour in order)


def _check_order(top: Section, order: tuple[int, ...], rules: Rules) -> None:
    for colour in order:
        if colour not in rules.colours:
            name = COLOUR_NAMES[colour]
            raise top.error(f"rules.{name}", f"is missing, but a {name} cube comes on the belt")


def _scores(section: Section) -> Scores:
    scores = Scores(*(section.integer(key, -1000, 1000) for key in ("person", "robot", "wrong")))
    section.finish()
    return scores


def _fails_at(top: Section, count: int) -> int | None:
    if top.value("fails_at", None) is None:
        return None
    return top.integer("fails_at", 1, count)
