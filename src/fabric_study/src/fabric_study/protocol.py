# SPDX-License-Identifier: BSD-3-Clause
"""Protocols: what one person does in a visit, step by step, read from a file."""

import hashlib
import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from fabric_study.instruments import IDENTIFIER, Instrument, Text, instrument_from, text_of
from fabric_study.orders import MOST_BALANCED, ORDERS, condition_order
from fabric_study.policies import ABPS, MODEL_SUFFIXES, NONE, ON_CALL
from fabric_study.shipped import load_path, names_in
from fabric_study.strict_yaml import DefinitionError, Section, read
from fabric_study.tasks import load_definition

PROTOCOL_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")
POLICIES = (NONE, ABPS, "proactive", "patient", "eager", "reactive", ON_CALL)
PLACES = {"start": ("start",), "after_task": ("task",), "after_condition": ("general",)}
PLACES["end"] = ("general",)


@dataclass(frozen=True)
class Step:
    """One thing a person reads, answers or does. What does not apply is empty or 0."""

    id: str  # of its own within the visit
    kind: str  # text, instrument or task
    condition: str = ""
    number: int = 0  # of the scored task that it is or follows, from 1; 0: of none
    in_condition: int = 0  # the same, counted within the condition
    definition: str = ""
    policy: str = ""
    instrument: str = ""
    text: Text = field(default_factory=dict)
    practice: bool = False  # a task that does not count


@dataclass(frozen=True)
class Condition:
    """One way of working that the study compares."""

    name: str
    shown_as: Text  # what people call it
    definition: str  # of its tasks
    policy: str
    tasks: int  # in each round
    text: Text  # shown before its first task of a round; may be empty
    after_task: tuple[str, ...]  # instruments
    after_condition: tuple[str, ...]  # instruments, after its last task


@dataclass(frozen=True)
class Protocol:
    """A study as planned; read it with `load_protocol`, which checks everything."""

    name: str
    title: Text
    people: int
    order: str  # one of ORDERS
    first: tuple[str, ...]  # conditions that come before those that are ordered
    rounds: int
    start: tuple[Step, ...]
    conditions: Mapping[str, Condition]
    end: tuple[Step, ...]
    instruments: Mapping[str, Instrument]
    content: Mapping[str, Any]  # all of it as in `study.json`, for `protocol_from`

    @property
    def hash(self) -> str:
        """SHA-256 of the content - plan, wording, task definitions - in hexadecimal digits."""
        text = json.dumps(self.content, separators=(",", ":"), allow_nan=False)
        return hashlib.sha256(text.encode()).hexdigest()

    @property
    def definitions(self) -> tuple[str, ...]:
        """The names of the task definitions, sorted."""
        tasks = [step.definition for step in self.start if step.kind == "task"]
        return tuple(sorted({*tasks, *(c.definition for c in self.conditions.values())}))

    def condition_order(self, index: int, seed: int) -> tuple[str, ...]:
        """Return the conditions of the visit with this index, from 0, round by round."""
        ordered = [name for name in self.conditions if name not in self.first]
        met: list[str] = []
        for turn in range(self.rounds):
            place = index * self.rounds + turn
            met += [*self.first, *condition_order(self.order, ordered, place, seed)]
        return tuple(met)

    def visit_steps(self, index: int, seed: int) -> tuple[Step, ...]:
        """Return the steps of the visit with this index, from 0, in a study with this seed."""
        if index < 0:
            raise ValueError(f"index is {index}; visits count from 0")
        middle = _Middle(self.conditions, self.condition_order(index, seed))
        return (*self.start, *middle.steps(), *self.end)

    def task_seed(self, index: int, seed: int, step_id: str) -> int:
        """Return the seed of a task of a visit, 0..2^31-1, derived by name."""
        digest = hashlib.sha256(f"{seed}/visit/{index}/{step_id}".encode()).digest()
        return int.from_bytes(digest[:4], "big") >> 1


class _Middle:
    """The steps of the conditions, in the order in which a person meets them."""

    def __init__(self, conditions: Mapping[str, Condition], order: tuple[str, ...]) -> None:
        self._conditions = conditions
        self._order = order
        self._number = 0
        self._done = dict.fromkeys(conditions, 0)

    def steps(self) -> Iterator[Step]:
        left = {name: self._order.count(name) for name in self._conditions}
        for name in self._order:
            condition = self._conditions[name]
            turn = self._order.count(name) - left[name] + 1
            left[name] -= 1
            if condition.text:
                yield Step(f"before_{name}_{turn}", "text", name, text=condition.text)
            for _ in range(condition.tasks):
                yield from self._task(condition)
            if left[name] == 0:
                for instrument in condition.after_condition:
                    step_id = f"after_{name}_{instrument}"
                    yield Step(step_id, "instrument", name, instrument=instrument)

    def _task(self, condition: Condition) -> Iterator[Step]:
        self._number += 1
        self._done[condition.name] += 1
        place = (condition.name, self._number, self._done[condition.name])
        step_id = f"task_{self._number}"
        yield Step(step_id, "task", *place, condition.definition, condition.policy)
        for instrument in condition.after_task:
            yield Step(f"{step_id}_{instrument}", "instrument", *place, instrument=instrument)


def protocol_names() -> list[str]:
    """Return the names of the shipped protocols."""
    return names_in("protocols")


def load_protocol(name_or_path: str) -> Protocol:
    """Return a shipped protocol by name, or the one in a .yaml file by path, with all it needs.

    Instruments are sought as NAME.yaml beside the file, then among the shipped ones.
    Raises DefinitionError naming the file, the key and the value that cannot be meant.
    """
    path = load_path("protocols", name_or_path)
    plan, wordings, instruments = read(path), {}, {}
    for name in _named_instruments(plan):
        beside = path.parent / f"{name}.yaml"
        file = beside if beside.is_file() else load_path("instruments", name)
        instruments[name] = instrument_from(name, read(file))
        wordings[name] = read(file).content
    content = {"name": path.stem, "protocol": plan.content, "instruments": wordings}
    protocol = _protocol(path.stem, plan, instruments, content)
    _check_models(plan, protocol)
    return replace(
        protocol, content=_plain({**content, "definitions": _definitions(plan, protocol)})
    )


def protocol_from(content: Mapping[str, Any], source: str) -> Protocol:
    """Return the protocol whose `content` this is. Raises as `load_protocol`."""
    whole, instruments = Section(source, "", content), {}
    name, wordings = whole.value("name"), whole.section("instruments")
    for key, wording in wordings.items():
        instruments[key] = instrument_from(key, Section(f"{source}: instrument {key}", "", wording))
    plan = Section(source, "", whole.value("protocol"))
    definitions = whole.section("definitions")
    whole.finish()
    protocol = _protocol(name, plan, instruments, content)
    for definition in protocol.definitions:
        definitions.section(definition)
    definitions.finish()
    return protocol


def _protocol(
    name: Any, top: Section, instruments: Mapping[str, Instrument], content: Mapping[str, Any]
) -> Protocol:
    if not isinstance(name, str) or not PROTOCOL_NAME.fullmatch(name):
        raise top.error("", f"is named {name!r}; it must be like {PROTOCOL_NAME.pattern}")
    conditions = _conditions(top, instruments)
    kind, first = _order(top.section("order"), conditions)
    plan = {
        "title": text_of(top, "title"),
        "people": top.integer("people", 1, 10000),
        "rounds": top.integer("rounds", 1, 20, 1),
        "start": _steps(top, "start", instruments),
        "end": _steps(top, "end", instruments),
    }
    top.finish()
    return Protocol(
        name=name,
        order=kind,
        first=first,
        conditions=conditions,
        instruments=instruments,
        content=_plain(content),
        **plan,
    )


def _plain(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return content as `study.json` will give it back."""
    return json.loads(json.dumps(content))


def _check_models(plan: Section, protocol: Protocol) -> None:
    policies = [step.policy for step in protocol.start if step.practice]
    for policy in (*policies, *(condition.policy for condition in protocol.conditions.values())):
        if policy not in POLICIES and not Path(policy).is_file():
            raise plan.error("conditions", f"there is no model file {policy}")


def _definitions(plan: Section, protocol: Protocol) -> dict[str, Any]:
    """Return the content of the task definitions, each of which must be fit to be used."""
    contents, scenarios = {}, set()
    for name in protocol.definitions:
        try:
            scenarios.add(load_definition(name).scenario)
        except DefinitionError as error:
            raise plan.error("", str(error)) from error
        contents[name] = read(load_path("tasks", name)).content
    if len(scenarios) > 1:
        raise plan.error("conditions", f"mix the scenarios {', '.join(sorted(scenarios))}")
    return contents


def _order(section: Section, conditions: Mapping[str, Condition]) -> tuple[str, tuple[str, ...]]:
    kind = section.choice("kind", ORDERS)
    first = section.value("first", [])
    section.finish()
    if not isinstance(first, list):
        raise section.error("first", f"must be a list of conditions, not {first!r}")
    for name in first:
        if name not in conditions or first.count(name) > 1:
            allowed = ", ".join(conditions)
            raise section.error("first", f"{name!r} is given twice, or is none of {allowed}")
    ordered = len(conditions) - len(first)
    if kind == "balanced" and ordered > MOST_BALANCED:
        text = f"balanced over {ordered} conditions has too many orders; take latin_square"
        raise section.error("kind", text)
    return kind, tuple(first)


def _conditions(top: Section, instruments: Mapping[str, Instrument]) -> dict[str, Condition]:
    section = top.section("conditions")
    common = {
        place: _instruments(top, place, instruments) for place in ("after_task", "after_condition")
    }
    conditions = {}
    for name, _ in section.items():
        if not isinstance(name, str) or not IDENTIFIER.fullmatch(name):
            raise section.error(name, f"is no name; it must be like {IDENTIFIER.pattern}")
        conditions[name] = _condition(name, section.section(name), instruments, common)
    if not conditions:
        raise section.error("", "is empty")
    return conditions


def _condition(
    name: str,
    section: Section,
    instruments: Mapping[str, Instrument],
    common: Mapping[str, tuple[str, ...]],
) -> Condition:
    def after(place: str) -> tuple[str, ...]:
        own = section.value(place, None) is not None
        return _instruments(section, place, instruments) if own else common[place]

    definition, policy = _work(section)
    condition = Condition(
        name=name,
        shown_as=text_of(section, "shown_as"),
        definition=definition,
        policy=policy,
        tasks=section.integer("tasks", 1, 100),
        text={} if section.value("text", None) is None else text_of(section, "text"),
        after_task=after("after_task"),
        after_condition=after("after_condition"),
    )
    section.finish()
    return condition


def _work(section: Section) -> tuple[str, str]:
    definition = section.value("definition")
    if not isinstance(definition, str) or not definition:
        raise section.error("definition", f"must name a task definition, not {definition!r}")
    if definition.endswith(".yaml") and not Path(definition).is_absolute():
        raise section.error("definition", f"{definition} must be a full path")
    policy = section.value("policy")
    if isinstance(policy, str) and policy.lower().endswith(MODEL_SUFFIXES):
        if not Path(policy).is_absolute():
            raise section.error("policy", f"{policy} must be a full path")
        return definition, policy
    return definition, section.choice("policy", POLICIES)


def _instruments(
    section: Section, place: str, instruments: Mapping[str, Instrument]
) -> tuple[str, ...]:
    names = section.value(place)
    if not isinstance(names, list):
        raise section.error(place, f"must be a list of instruments, not {names!r}")
    for name in names:
        _check_instrument(section, place, place, name, instruments)
        if names.count(name) > 1:
            raise section.error(place, f"{name} is given twice")
    return tuple(names)


def _check_instrument(
    section: Section, key: str, place: str, name: Any, instruments: Mapping[str, Instrument]
) -> None:
    if not isinstance(name, str) or name not in instruments:
        raise section.error(key, f"no instrument {name!r}")
    if instruments[name].when not in PLACES[place]:
        text = f"{name} is meant for `when: {instruments[name].when}`, not for {place}"
        raise section.error(key, text)


def _steps(top: Section, place: str, instruments: Mapping[str, Instrument]) -> tuple[Step, ...]:
    steps: list[Step] = []
    for number, entry in enumerate(top.parts(place), start=1):
        steps.append(_step(entry, place, number, instruments))
        if steps[-1].id in [step.id for step in steps[:-1]]:
            raise entry.error("instrument", f"{steps[-1].instrument} is given twice")
    return tuple(steps)


def _step(entry: Section, place: str, number: int, instruments: Mapping[str, Instrument]) -> Step:
    kinds = [key for key, _ in entry.items()]
    if kinds == ["text"]:
        return Step(f"{place}_{number}", "text", text=text_of(entry, "text"))
    if kinds == ["instrument"]:
        name = entry.value("instrument")
        _check_instrument(entry, "instrument", place, name, instruments)
        return Step(f"{place}_{name}", "instrument", instrument=name)
    if kinds == ["practice"] and place == "start":
        work = entry.section("practice")
        definition, policy = _work(work)
        work.finish()
        names = {"definition": definition, "policy": policy}
        return Step(f"practice_{number}", "task", **names, practice=True)
    raise entry.error("", "must be one of text, instrument and, at the start, practice")


def _named_instruments(top: Section) -> list[str]:
    """Return every instrument that a plan names, in order; the checks come later."""
    names: list[Any] = []
    for place in ("start", "end"):
        entries = top.value(place, None)
        for entry in entries if isinstance(entries, list) else []:
            names += [entry.get("instrument")] if isinstance(entry, dict) else []
    conditions = top.value("conditions", None)
    places = [top.value(place, None) for place in ("after_task", "after_condition")]
    for condition in conditions.values() if isinstance(conditions, dict) else []:
        if isinstance(condition, dict):
            places += [condition.get("after_task"), condition.get("after_condition")]
    for place in places:
        names += place if isinstance(place, list) else []
    return list(dict.fromkeys(name for name in names if isinstance(name, str)))
