# SPDX-License-Identifier: BSD-3-Clause
"""What the pages are told of a visit, ready for JSON. All texts stay in all languages."""

from collections.abc import Mapping, Sequence
from typing import Any

from fabric_msgs.msg import Cube, SortingRule, TaskState
from fabric_study.instruments import TLX_STEP, Answer, Item
from fabric_study.protocol import Step
from fabric_study.visit import Visit

COLOURS = {
    Cube.COLOUR_UNKNOWN: "",
    Cube.COLOUR_RED: "red",
    Cube.COLOUR_GREEN: "green",
    Cube.COLOUR_BLUE: "blue",
}
PLACED = ("subtask_succeeded", "subtask_failed")
Entries = Sequence[Mapping[str, Any]]  # of the event journal


def step_view(visit: Visit) -> dict[str, Any] | None:
    """Return the step the visit is at, None when it is closed."""
    step = visit.step
    if step is None:
        return None
    return {
        "id": step.id,
        "kind": step.kind,
        "at": visit.position + 1,
        "of": len(visit.steps),
        "text": dict(step.text),
        "practice": step.practice,
        "task": step.number,
        "tasks": max(other.number for other in visit.steps),
    }


def questions_view(visit: Visit, title: Mapping[str, str]) -> dict[str, Any]:
    """Return the items of the step in this person's order, and the answers that are recorded."""
    return {
        "title": dict(title),
        "items": [_item(item) for item in visit.items()],
        "answers": dict(visit.answers),
    }


def _item(item: Item) -> dict[str, Any]:
    return {
        "id": item.id,
        "kind": item.kind,
        "text": dict(item.text),
        "low": item.low,
        "high": item.high,
        "step": TLX_STEP,
        "labels": [[value, dict(text)] for value, text in item.labels.items()],
    }


def unanswered(items: Sequence[Item], answers: Mapping[str, Answer]) -> list[str]:
    """Return the ids of the items without an answer."""
    return [item.id for item in items if answers.get(item.id) is None]


def rules_view(rules: Sequence[SortingRule]) -> list[dict[str, Any]]:
    """Return the items to remember."""
    return [
        {
            "colour": COLOURS[rule.colour],
            "container": rule.label,
            "occurrence": rule.occurrence,
            "word": COLOURS[rule.word],
            "ink": COLOURS[rule.ink],
            "ink_counts": bool(rule.ink_counts),
        }
        for rule in rules
    ]


def placements_view(entries: Entries) -> list[dict[str, Any]]:
    """Return which cube lies where; not whether it belongs there."""
    placed = [entry for entry in entries if entry["what"] in PLACED]
    return [
        {
            "number": number,
            "colour": COLOURS[entry["colour"]],
            "container": entry["container"],
            "by": entry["by"],
        }
        for number, entry in enumerate(placed, start=1)
    ]


def result_view(
    entries: Entries, row: Mapping[str, Any] | None, state: TaskState | None
) -> dict[str, Any]:
    """Return the result of a task that has ended: from its row, until then from its last state."""
    if row is not None:
        rate, duration = row["task_success_rate"], row["duration_s"]
    elif state is not None:
        succeeded = state.succeeded_by_person + state.succeeded_by_robot
        rate, duration = succeeded / max(state.subtasks_total, 1), state.duration
    else:
        rate, duration = None, None
    return {
        "success_rate": round(rate or 0.0, 4),
        "duration": duration or 0.0,
        "score": sum(entry["score"] for entry in entries),
        "saved": row is not None,
    }


def events_view(entries: Entries) -> list[dict[str, Any]]:
    """Return what happened in a task, for the experimenter: with right and wrong."""
    if not entries:
        return []
    start = entries[0]["stamp"]
    return [
        {
            "at": entry["stamp"] - start,
            "colour": COLOURS[entry["colour"]],
            "what": _sentence(entry),
            "score": entry["score"],
        }
        for entry in entries
        if entry["what"] != "subtask_started"
    ]


def _sentence(entry: Mapping[str, Any]) -> str:
    if entry["what"] not in PLACED:
        return str(entry["what"]).replace("_", " ")
    if entry["by"] == "nobody":
        return "nobody placed it"
    right = "right" if entry["what"] == "subtask_succeeded" else "wrong"
    return f"{entry['by']}, {right}: {entry['container'] or 'nowhere'}"


def steps_view(visit: Visit, titles: Mapping[str, str]) -> list[dict[str, str]]:
    """Return a line for each step of the visit; titles: of instruments, by name."""
    return [_line(step, titles) for step in visit.steps]


def _line(step: Step, titles: Mapping[str, str]) -> dict[str, str]:
    if step.kind == "task":
        return {"name": task_name(step), "about": step.condition or step.definition}
    if step.kind == "instrument":
        return {"name": "Questions", "about": titles[step.instrument]}
    return {"name": "Text", "about": step.text["en"].lstrip("# ").split("\n")[0]}


def task_name(step: Step) -> str:
    """Return what a task is called on the console."""
    return "Practice" if step.practice else f"Task {step.number}"
