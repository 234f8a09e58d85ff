# SPDX-License-Identifier: BSD-3-Clause
"""What our decisions on a recording amount to: a line each, a summary, a picture.

The person answered the recorded robot, not ours: after the first difference the recording shows
what our robot would have seen only in part. A summary says where the two differ; it does not say
what the person would have done.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fabric_planner.replay import ACTIONS, Recording, Step

# A take-over counts as warned when the person warns in one of the next so many observations,
# before the next placement.
WARNING_WINDOW = 5


@dataclass(frozen=True)
class Outcome:
    """Our decision on one observation."""

    action: str
    symbol: str  # the observation as the model reads it
    belief: np.ndarray  # (n_states,), sums to 1
    value: float  # points, as are the bounds
    lower_bound: float
    upper_bound: float
    planning_time: float  # s
    round_trip: float  # s, from publishing the observation to hearing the decision
    deadline_missed: bool
    fallback_used: bool
    belief_recovered: bool

    @classmethod
    def of(cls, decision: Any, observations: Sequence[str], round_trip: float) -> "Outcome":
        """From a Decision message and the model's observation names; raises ValueError when an
        index in the message is out of range.
        """
        if decision.action >= len(ACTIONS) or decision.observation_index >= len(observations):
            raise ValueError(
                f"decision {decision.sequence} names action {decision.action} "
                f"and observation {decision.observation_index}, which do not exist"
            )
        return cls(
            ACTIONS[decision.action],
            observations[decision.observation_index],
            np.array(decision.belief, dtype=float),
            decision.value,
            decision.lower_bound,
            decision.upper_bound,
            decision.planning_time,
            round_trip,
            bool(decision.deadline_missed),
            bool(decision.fallback_used),
            bool(decision.belief_recovered),
        )


def header() -> str:
    """Headings of the lines of `describe`."""
    return (
        f"{'time':>8} {'no':>4} {'seen':<22} {'belief':<52} {'decision':<9}"
        f"{'value':>7} {'bounds':<16} recorded robot"
    )


def describe(step: Step, outcome: Outcome, states: Sequence[str]) -> str:
    """One line: time, symbol, the two likeliest states, decision, bounds, recorded action."""
    order = np.argsort(-outcome.belief, kind="stable")[:2]
    belief = "  ".join(f"{states[i]} {outcome.belief[i]:.2f}" for i in order)
    bounds = f"{outcome.lower_bound:.2f}..{outcome.upper_bound:.2f}"
    recorded = step.recorded or (f"({step.in_force})" if step.in_force else "-")
    return (
        f"{step.time:8.1f} {step.observation.sequence:4d} {outcome.symbol:<22} {belief:<52} "
        f"{outcome.action:<9}{outcome.value:7.2f} {bounds:<16} {recorded}"
    )


def summarise(recording: Recording, outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Everything that is counted, ready for JSON. Outcomes belong to the steps, in order."""
    steps = recording.steps
    if len(outcomes) != len(steps):
        raise ValueError(f"{len(outcomes)} decisions on {len(steps)} observations")
    ours = [outcome.action for outcome in outcomes]
    recorded = [step.recorded for step in steps]
    return {
        "recording": recording.name,
        "recorded_robot": recording.robot,
        "observations": len(steps),
        "warnings": sum(_warning_begins(steps, i) for i in range(len(steps))),
        "warning_window": WARNING_WINDOW,
        "decisions": {action: ours.count(action) for action in ACTIONS},
        "recorded_decisions": {action: recorded.count(action) for action in ACTIONS},
        "take_overs": _take_overs(steps, ours),
        "recorded_take_overs": _recorded_take_overs(steps, ours),
        "agreement": _agreement(ours, recorded),
        "latency": _latency(outcomes),
    }


def _first_grasps(steps: Sequence[Step], actions: Sequence["str | None"]) -> list[int]:
    """Indices of the first grasp in every subtask that has one."""
    first: dict[int, int] = {}
    for i, (step, action) in enumerate(zip(steps, actions, strict=True)):
        if action == "grasp" and not step.final:
            first.setdefault(step.decides_for, i)
    return list(first.values())


def _warning_begins(steps: Sequence[Step], i: int) -> bool:
    """The person starts to warn at step i."""
    return steps[i].observation.warning and (i == 0 or not steps[i - 1].observation.warning)


def _warned_after(steps: Sequence[Step], i: int) -> bool:
    """The person warned within the window after step i and before the next placement ended."""
    for step in steps[i + 1 : i + 1 + WARNING_WINDOW]:
        if step.observation.warning:
            return True
        if step.placement:
            return False
    return False


def _ended_by(steps: Sequence[Step], i: int) -> str:
    """Who made the placement that ended the subtask decided on at step i, and how it went."""
    for step in steps[i + 1 :]:
        o = step.observation
        if o.subtask_success or o.subtask_failure:
            return "person right" if o.subtask_success else "person wrong"
        if o.robot_success or o.robot_failure:
            return "robot right" if o.robot_success else "robot wrong"
    return "nobody"


def _take_overs(steps: Sequence[Step], ours: Sequence[str]) -> list[dict[str, Any]]:
    """Where our robot would have taken over: the first grasp of each subtask."""
    recorded = {steps[i].decides_for: i for i in _first_grasps(steps, [s.recorded for s in steps])}
    found = []
    for i in _first_grasps(steps, ours):
        theirs = recorded.get(steps[i].decides_for)
        found.append(
            {
                "time": steps[i].time,
                "observation": steps[i].observation.sequence,
                "subtask": steps[i].decides_for,
                "recorded_in_force": steps[i].in_force,
                "recorded_took_over_at": None if theirs is None else steps[theirs].time,
                "warned_recorded": None if theirs is None else _warned_after(steps, theirs),
                "warned_next": _warned_after(steps, i),
                "subtask_ended_by": _ended_by(steps, i),
            }
        )
    return found


def _recorded_take_overs(steps: Sequence[Step], ours: Sequence[str]) -> list[dict[str, Any]]:
    """Where the recorded robot took over, whether it was warned, and whether ours had by then."""
    mine = {steps[i].decides_for: i for i in _first_grasps(steps, ours)}
    return [
        {
            "time": steps[i].time,
            "observation": steps[i].observation.sequence,
            "subtask": steps[i].decides_for,
            "warned": _warned_after(steps, i),
            "ours": ours[i],
            "ours_took_over": mine.get(steps[i].decides_for, len(steps)) <= i,
            "subtask_ended_by": _ended_by(steps, i),
        }
        for i in _first_grasps(steps, [step.recorded for step in steps])
    ]


def _agreement(ours: Sequence[str], recorded: Sequence["str | None"]) -> dict[str, Any]:
    """Counts over the observations to which the recorded robot gave an answer."""
    pairs = [(mine, his) for mine, his in zip(ours, recorded, strict=True) if his is not None]
    same = sum(mine == his for mine, his in pairs)
    table = {his: {mine: pairs.count((mine, his)) for mine in ACTIONS} for his in ACTIONS}
    return {"compared": len(pairs), "same": same, "ours_by_recorded": table}


def _latency(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    planning = np.array([outcome.planning_time for outcome in outcomes]) * 1e3
    round_trip = np.array([outcome.round_trip for outcome in outcomes]) * 1e3
    return {
        "planning_ms_p50": round(float(np.percentile(planning, 50)), 3),
        "planning_ms_p99": round(float(np.percentile(planning, 99)), 3),
        "round_trip_ms_p50": round(float(np.percentile(round_trip, 50)), 3),
        "round_trip_ms_p99": round(float(np.percentile(round_trip, 99)), 3),
        "deadline_missed": sum(outcome.deadline_missed for outcome in outcomes),
        "fallback_used": sum(outcome.fallback_used for outcome in outcomes),
        "belief_recovered": sum(outcome.belief_recovered for outcome in outcomes),
    }


def summary_text(summary: dict[str, Any]) -> str:
    """The summary for people."""
    ours = summary["take_overs"]
    theirs = summary["recorded_take_overs"]
    lines = [
        f"{summary['recording']}: {summary['observations']} observations, "
        f"{summary['warnings']} warnings, recorded robot {summary['recorded_robot']}",
        f"It would have taken over in {len(ours)} subtasks, the recorded robot did in "
        f"{len(theirs)}, in {sum(t['warned_recorded'] is not None for t in ours)} of them both.",
    ]
    for t in ours:
        lines.append(f"  {t['time']:8.1f} s  subtask {t['subtask']:2d}: {_take_over_words(t)}")
    warned = [t for t in theirs if t["warned"]]
    accepted = [t for t in theirs if not t["warned"]]
    lines += [
        f"The person warned the recorded robot after {len(warned)} of its {len(theirs)} take-overs "
        f"(within {summary['warning_window']} observations, before the next placement); "
        f"ours had taken over by then in {_ours(warned)} of these {len(warned)} "
        f"and in {_ours(accepted)} of the {len(accepted)} accepted ones.",
        _agreement_text(summary["agreement"]),
        "Latency: planning p50 {planning_ms_p50} ms, p99 {planning_ms_p99} ms; over ROS p50 "
        "{round_trip_ms_p50} ms, p99 {round_trip_ms_p99} ms; {deadline_missed} deadlines missed, "
        "{fallback_used} fallbacks, {belief_recovered} impossible observations.".format(
            **summary["latency"]
        ),
    ]
    return "\n".join(lines)


def _ours(take_overs: Sequence[dict[str, Any]]) -> int:
    return sum(t["ours_took_over"] for t in take_overs)


def _take_over_words(t: dict[str, Any]) -> str:
    at = t["recorded_took_over_at"]
    if at is None:
        doing = t["recorded_in_force"] or "not decided yet"
        return f"the recorded robot did not ({doing}); ended by {t['subtask_ended_by']}"
    answer = "was warned" if t["warned_recorded"] else "was not warned"
    return f"the recorded robot did at {at:.1f} s and {answer}; ended by {t['subtask_ended_by']}"


def _agreement_text(agreement: dict[str, Any]) -> str:
    compared, same = agreement["compared"], agreement["same"]
    if compared == 0:
        return "Agreement: the recorded robot decided nothing."
    parts = []
    for action, row in agreement["ours_by_recorded"].items():
        total = sum(row.values())
        if total:
            parts.append(f"{action} {row[action]}/{total}")
    return (
        f"Agreement with the recorded robot: {same}/{compared} ({100 * same / compared:.0f} %); "
        f"of its decisions: {', '.join(parts)}."
    )


def write_plot(
    path: "str | Path", recording: Recording, outcomes: Sequence[Outcome], states: Sequence[str]
) -> None:
    """PNG of belief over time, decisions of ours and the recorded robot, warnings, placements."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12, 7), constrained_layout=True)
    FigureCanvasAgg(figure)
    belief, action = figure.subplots(2, 1, sharex=True, height_ratios=[3, 2])
    times = np.array([step.time for step in recording.steps])
    _draw_belief(belief, times, np.array([outcome.belief for outcome in outcomes]), states)
    _draw_actions(action, recording, times, outcomes)
    for axes in (belief, action):
        _draw_events(axes, recording)
    handles, labels = action.get_legend_handles_labels()
    unique = dict(zip(labels, handles, strict=True))
    action.legend(unique.values(), unique.keys(), loc="upper left", bbox_to_anchor=(1.0, 1.0))
    belief.set_title(f"{recording.name}: our decisions on a recorded task")
    figure.savefig(path, dpi=110)


def _draw_belief(axes: Any, times: np.ndarray, belief: np.ndarray, states: Sequence[str]) -> None:
    from matplotlib import colormaps

    shown = np.flatnonzero(belief.max(axis=0) >= 0.02)
    colours = colormaps["tab20"](np.arange(len(states)) % 20)
    edges = np.append(times, times[-1] + 1.0)
    steps = np.vstack([belief, belief[-1:]])
    axes.stackplot(
        edges,
        steps[:, shown].T,
        labels=[states[i].replace("_", " ") for i in shown],
        colors=colours[shown],
        step="post",
    )
    axes.set_ylim(0, 1)
    axes.set_ylabel("belief")
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize="small")


def _draw_actions(
    axes: Any, recording: Recording, times: np.ndarray, outcomes: Sequence[Outcome]
) -> None:
    height = {action: number for number, action in enumerate(ACTIONS)}
    ours = [height[outcome.action] for outcome in outcomes]
    axes.step(times, ours, where="post", color="tab:blue", label="our robot", lw=1.8)
    answers = [(step.time, height[step.in_force]) for step in recording.steps if step.in_force]
    if answers:
        when, what = np.array(answers).T
        axes.step(when, what + 0.12, where="post", color="tab:orange", label="recorded robot")
    axes.set_yticks(range(len(ACTIONS)), ACTIONS)
    axes.set_xlabel("time (s)")
    axes.set_ylabel("decision")


def _draw_events(axes: Any, recording: Recording) -> None:
    for i, step in enumerate(recording.steps):
        if _warning_begins(recording.steps, i):
            axes.axvline(step.time, color="red", lw=1.4, label="warning")
        if step.placement:
            by_person = step.observation.subtask_success or step.observation.subtask_failure
            label = "placed by the person" if by_person else "placed by the robot"
            style = ":" if by_person else "--"
            axes.axvline(step.time, color="black", lw=0.8, ls=style, label=label)
