# SPDX-License-Identifier: BSD-3-Clause
"""All visits of a study, spread over processes; equal whatever their number is."""

from __future__ import annotations

from dataclasses import dataclass

from fabric_sim.experiments.jobs import run_jobs
from fabric_sim.rehearsal.answer_parameters import AnswerParameters
from fabric_sim.rehearsal.robots import Robots
from fabric_sim.rehearsal.visit_play import PlayedVisit, play_visit
from fabric_study.protocol import Protocol


@dataclass(frozen=True)
class Laboratory:
    """What all visits share; processes inherit it by forking."""

    protocol: Protocol
    robots: Robots
    model: AnswerParameters
    seed: int

    @classmethod
    def of(cls, protocol: Protocol, seed: int) -> Laboratory:
        """Get everything ready. Raises ValueError naming what cannot be used."""
        policies = {step.policy for step in protocol.visit_steps(0, seed) if step.kind == "task"}
        robots = Robots(policies)
        for definition in protocol.definitions:
            robots.files.definition(definition)
        return cls(protocol, robots, AnswerParameters.load(), seed)


_open: list[Laboratory] = []  # the one that visits take place in


def play_visits(laboratory: Laboratory, people: int, processes: int) -> list[PlayedVisit]:
    """Return the visits of `people` simulated people, in order."""
    _open.append(laboratory)
    try:
        return run_jobs(_play, range(people), processes, "people")
    finally:
        _open.pop()


def _play(index: int) -> PlayedVisit:
    laboratory = _open[-1]
    return play_visit(
        laboratory.protocol, laboratory.robots, laboratory.model, laboratory.seed, index
    )
