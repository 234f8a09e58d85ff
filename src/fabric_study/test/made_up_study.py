# SPDX-License-Identifier: BSD-3-Clause
"""Studies for tests: numbers drawn from a seed, no simulation of anything."""

from __future__ import annotations

import numpy as np
import pandas as pd

from fabric_study.meter import COLUMNS
from fabric_study.protocol import Protocol, load_protocol
from fabric_study.study_data import StudyData, study_from_frames

CUBES = 10
BETTER = {"alone": -0.5, "reactive": 0.0, "proactive": 0.8, "type_4": 1.0}  # effect, made up


def made_up(name: str, people: int | None = None, seed: int = 101) -> StudyData:
    """A study by a shipped protocol; every fiftieth answer is missing."""
    protocol, random = load_protocol(name), np.random.default_rng(seed)
    tasks, answers = [], []
    for index in range(people or protocol.people):
        person, level = f"P{index:02d}", random.normal(0.0, 0.7)
        for step in protocol.visit_steps(index, seed):
            if step.kind == "task" and not step.practice:
                tasks.append(_task(person, step, level, random))
            elif step.kind == "instrument":
                answers += _answers(person, step, protocol, level, random)
    meta = {
        "protocol": name,
        "hash": protocol.hash,
        "seed": seed,
        "simulated": True,
        "content": protocol.content,
        "versions": {"fabric": "0.1.0"},
    }
    return study_from_frames(meta, pd.DataFrame(tasks), pd.DataFrame(answers))


def _task(person: str, step, level: float, random: np.random.Generator) -> dict:
    effect = BETTER.get(step.condition, 0.0) + 0.1 * step.in_condition
    robot = 0 if step.policy == "none" else int(random.binomial(3, 0.6))
    human = CUBES - robot
    right = int(random.binomial(human, 1.0 / (1.0 + np.exp(-level - effect - 0.5))))
    warnings = 0 if step.policy == "none" else int(random.poisson(np.exp(1.2 - effect)))
    share, rate = right / CUBES, (right + robot) / CUBES
    values = {
        "task": step.number,
        "seed": 1,
        "scenario": "sorting",
        "human": "person",
        "policy": step.policy,
        "model": _model(step.policy, step.number, random),
        "discounted_reward": 6.0 * (right + robot) - 6.0 * (human - right) - 3.0 * warnings,
        "success": int(rate >= 0.8),
        "warnings": warnings,
        "false_warnings": None,
        "duration_s": float(random.normal(120.0, 15.0)),
        "decisions": 60,
        "human_succeeded": right,
        "human_failed": human - right,
        "robot_succeeded": robot,
        "robot_failed": 0,
        "human_success_rate": right / human,
        "human_contribution": share,
        "task_success_rate": rate,
        "efficiency": share * rate,
        "stage1_accuracy": None,
        "stage2_accuracy": None,
        "type_belief_entropy": 2.7 / step.number if step.policy == "abps" else None,
    }
    keys = ("condition", "number", "in_condition", "definition")
    return {
        "person": person,
        **{key: getattr(step, key) for key in keys},
        **{name: values[name] for name in COLUMNS},
    }


def _model(policy: str, number: int, random: np.random.Generator) -> str:
    if policy != "abps" or number < 3:
        return "proactive" if policy == "abps" else policy
    return str(random.choice(["proactive", "policy_07", "policy_12"]))


def _answers(person, step, protocol: Protocol, level: float, random) -> list[dict]:
    rows = []
    for item in protocol.instruments[step.instrument].items:
        place = (person, step.condition, step.number, step.instrument, item.id, item.kind)
        value = None if random.random() < 0.02 else _value(item, step, level, random)
        keys = ("person", "condition", "number", "instrument", "item", "kind", "category", "value")
        rows.append(dict(zip(keys, (*place, item.category, value), strict=True)))
    return rows


def _value(item, step, level: float, random):
    effect = BETTER.get(step.condition, 0.0) * (-1.0 if item.reverse else 1.0)
    if item.kind == "likert":
        return int(np.clip(np.rint(3.2 + 0.5 * level + effect + random.normal()), 1, 5))
    if item.kind == "tlx":
        return int(np.clip(5 * np.rint(10 + 6 * effect + 2 * random.normal()), 0, 100))
    if item.kind in ("choice", "pair"):
        return str(random.choice(list(item.labels)))
    return "It was fine." if item.kind == "text" else 30
