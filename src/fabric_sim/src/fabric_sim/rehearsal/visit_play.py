# SPDX-License-Identifier: BSD-3-Clause
"""One visit played by a simulated person: every step of the protocol, with tasks and answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from fabric_abps import child_seed
from fabric_sim.character import Character, named_generator
from fabric_sim.rehearsal.answer_parameters import AnswerParameters
from fabric_sim.rehearsal.answers import Moment, Respondent, Value
from fabric_sim.rehearsal.experience import NOTHING_YET, Measures, of_several, of_task
from fabric_sim.rehearsal.robots import Robots
from fabric_sim.rehearsal.shift import PlayedTask, Shift
from fabric_study.instruments import Instrument
from fabric_study.protocol import Protocol, Step


@dataclass(frozen=True)
class PlayedStep:
    """A step as it went: task or answers, neither for a text."""

    step: Step
    task: PlayedTask | None = None
    answers: dict[str, Value] | None = None


@dataclass(frozen=True)
class PlayedVisit:
    """All steps of one person, in order. index: of the visit in the study, from 0."""

    index: int
    person: Character
    steps: tuple[PlayedStep, ...]


class VisitPlayer:
    """Goes through a visit step by step, and remembers what was gone through."""

    def __init__(
        self,
        instruments: Mapping[str, Instrument],
        person: Character,
        respondent: Respondent,
        shift: Shift,
    ) -> None:
        """person: as they come through the door; respondent, shift: how they answer and work."""
        self._instruments = instruments
        self._person, self._respondent, self._shift = person, respondent, shift
        self._lived: list[tuple[str, Measures]] = []  # condition and measures of scored tasks

    def play(self, step: Step) -> PlayedStep:
        """Do the next step."""
        if step.kind == "task":
            return PlayedStep(step, task=self._work(step))
        if step.kind == "instrument":
            items, moment = self._instruments[step.instrument].items, self._moment(step)
            return PlayedStep(step, answers=self._respondent.answers(items, step.id, moment))
        return PlayedStep(step)

    def _work(self, step: Step) -> PlayedTask:
        task = self._shift.play(step.definition, step.policy)
        if not step.practice:
            self._lived.append((step.condition, of_task(task, self._person)))
        return task

    def _moment(self, step: Step) -> Moment:
        """What a questionnaire asks about: the last task, its condition, or all of the visit."""
        names = dict.fromkeys(name for name, _ in self._lived)
        conditions = {name: of_several(self._of(name)) for name in names}
        if self._instruments[step.instrument].when == "task":
            lately = self._last_task()
        elif step.condition in conditions:
            lately = conditions[step.condition]
        else:
            lately = of_several([measures for _, measures in self._lived])
        return Moment(lately, conditions)

    def _of(self, condition: str) -> list[Measures]:
        return [measures for name, measures in self._lived if name == condition]

    def _last_task(self) -> Measures:
        """The last task, with its change against the one before in the same condition."""
        if not self._lived:
            return NOTHING_YET
        condition, last = self._lived[-1]
        changes = of_several(self._of(condition)[-2:])
        return {**last, "calmer": changes["calmer"], "better": changes["better"]}


def play_visit(
    protocol: Protocol, robots: Robots, model: AnswerParameters, seed: int, index: int
) -> PlayedVisit:
    """Return the visit of the person `index` (from 0) of a study; decided by the seed alone."""
    root = child_seed(seed, "rehearsal", "visit", index)
    person = Character.random(named_generator(root, "rehearsal", "person"))
    respondent, shift = Respondent(model, root), Shift(person, root, robots)
    player = VisitPlayer(protocol.instruments, person, respondent, shift)
    steps = protocol.visit_steps(index, seed)
    return PlayedVisit(index, person, tuple(player.play(step) for step in steps))
