# SPDX-License-Identifier: BSD-3-Clause
"""The lines of events.csv: what happened in a task, from its messages, nothing of the machine."""

from collections.abc import Iterable, Mapping, Sequence

from fabric_msgs.msg import Decision, Observation, TaskEvent, TaskState
from fabric_study.stamps import to_seconds

LOG_COLUMNS = ("policy", "task", "seed", "t_s", "what", "number", "details")
FEATURES = (
    "task_success", "task_failure", "detected", "looking_around", "grasp_attempt", "warning",
    "idle", "subtask_success", "subtask_failure", "robot_success", "robot_failure",
)  # fmt: skip
CLOCKS = ("subtask_elapsed", "waiting_time")
WHO = {TaskEvent.BY_NOBODY: "nobody", TaskEvent.BY_PERSON: "person", TaskEvent.BY_ROBOT: "robot"}
LogRow = tuple[str, int, int, str, str, int, str]  # as LOG_COLUMNS


def _constants(message_class: type, names: Iterable[str]) -> dict[int, str]:
    return {getattr(message_class, name): name.lower() for name in names}


KINDS = _constants(
    TaskEvent,
    (
        "TASK_STARTED", "SUBTASK_STARTED", "SUBTASK_SUCCEEDED", "SUBTASK_FAILED", "WARNING",
        "TASK_SUCCEEDED", "TASK_FAILED", "TASK_ABORTED", "CALL",
    ),
)  # fmt: skip
ACTIONS = _constants(Decision, ("IDLE", "PLANNING", "POINT", "GRASP", "CANCEL"))
TRIGGERS = {
    Observation.TRIGGER_START: "start",
    Observation.TRIGGER_ACTION_CHANGE: "action_change",
    Observation.TRIGGER_SUBTASK: "subtask",
    Observation.TRIGGER_WARNING: "warning",
    Observation.TRIGGER_TIMEOUT: "timeout",
}


def log_rows(
    policy: str,
    state: TaskState,
    events: Mapping[int, TaskEvent],
    observations: Mapping[int, Observation],
    decisions: Mapping[int, Decision],
) -> list[LogRow]:
    """Return the lines of a task in order of time; messages by their sequence.

    In one instant events come before observations before decisions.
    """
    entries = [
        *((to_seconds(m), 0, n, "event", _event(m)) for n, m in events.items()),
        *((to_seconds(m), 1, n, "observation", _observation(m)) for n, m in observations.items()),
        *((to_seconds(m), 2, n, "decision", _decision(m)) for n, m in decisions.items()),
    ]
    return [
        (policy, state.task_id, state.seed, f"{t:.3f}", what, number, details)
        for t, _, number, what, details in sorted(entries)
    ]


def _event(event: TaskEvent) -> str:
    words = [KINDS[event.kind]]
    if event.cube_id:
        words.append(f"by={WHO[event.by]} cube={event.cube_id} colour={event.cube_colour}")
    if event.container:
        words.append(f"container={event.container} score={event.score}")
    return " ".join(words)


def _observation(observation: Observation) -> str:
    words = [TRIGGERS[observation.trigger]]
    words += [name for name in FEATURES if getattr(observation, name)]
    words += [f"{name}={getattr(observation, name):.3f}" for name in CLOCKS]
    return " ".join([*words, f"failed_attempts={observation.failed_attempts}"])


def _decision(decision: Decision) -> str:
    words = [
        ACTIONS[decision.action],
        f"action={decision.action_index} symbol={decision.observation_index}",
        f"belief={_likeliest(decision.belief)} model={decision.model_hash[:8]}",
    ]
    words += [name for name in ("fallback_used", "belief_recovered") if getattr(decision, name)]
    return " ".join(words)


def _likeliest(belief: Sequence[float]) -> str:
    if not len(belief):
        return "-"
    state = max(range(len(belief)), key=lambda index: belief[index])
    return f"{state}:{belief[state]:.6f}"
