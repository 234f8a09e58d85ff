# SPDX-License-Identifier: BSD-3-Clause
"""Played visits as the tables of a study, without a folder."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import pandas as pd

from fabric_sim.rehearsal.visit_play import PlayedStep, PlayedVisit
from fabric_study.meter import COLUMNS
from fabric_study.protocol import Protocol
from fabric_study.study_data import ANSWER_KEYS, TASK_KEYS, StudyData, study_from_frames


def study_of(protocol: Protocol, visits: Sequence[PlayedVisit]) -> StudyData:
    """Return what `load_study` would of the written visits; people are called by their index."""
    tasks = [row for visit in visits for row in _tasks(visit)]
    answers = [row for visit in visits for row in _answers(visit, protocol)]
    return study_from_frames(
        {"protocol": protocol.name, "simulated": True, "content": protocol.content},
        pd.DataFrame(tasks, columns=[*TASK_KEYS, *COLUMNS]),
        pd.DataFrame(answers, columns=list(ANSWER_KEYS)),
    )


def _place(visit: PlayedVisit, played: PlayedStep) -> dict[str, Any]:
    step = played.step
    return {"person": str(visit.index), "condition": step.condition, "number": step.number}


def _tasks(visit: PlayedVisit) -> Iterator[dict[str, Any]]:
    for played in visit.steps:
        if played.task is not None and not played.step.practice:
            own = {
                "in_condition": played.step.in_condition,
                "definition": played.step.definition,
            }
            yield {**_place(visit, played), **own, **played.task.row}


def _answers(visit: PlayedVisit, protocol: Protocol) -> Iterator[dict[str, Any]]:
    for played in visit.steps:
        if played.answers is None:
            continue
        instrument = protocol.instruments[played.step.instrument]
        for item in instrument.items:
            own = {
                "instrument": instrument.name,
                "item": item.id,
                "kind": item.kind,
                "category": item.category,
                "value": played.answers[item.id],
            }
            yield {**_place(visit, played), **own}
