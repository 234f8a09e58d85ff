# SPDX-License-Identifier: BSD-3-Clause
"""What the robot knows and thinks, as text and bars in a plane behind the table."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator, Sequence

from visualization_msgs.msg import Marker

from fabric_bringup import draw
from fabric_msgs.msg import (
    Cube,
    Decision,
    ModelInfo,
    PolicyChoice,
    SortingRule,
    TaskState,
    TypeBelief,
)

PLANE_Y = 0.20  # m, where the panels' plane meets the table; it leans back from there
TILT = 0.5  # rad, the pitch of the shipped view
ROW = 0.066  # m
LETTER = 0.041  # m, height of a capital
TITLE = 0.050
LABEL_WIDTH = 0.47
BAR_LENGTH = 0.27
BELIEF_AT = (-1.27, 0.92)  # x, z of the upper left corner
DECISION_AT = (1.53, 0.96)  # x of the middle
TYPES_AT = (1.09, 0.44)
TASK_AT = (0.34, 1.13)

STAGE_1 = ("task_assigned_to_human", "human_doing_ok", "may_not_be_capable", "may_be_tired")
STAGE_1 += ("may_be_distracted",)
STAGE_2 = ("needs_to_be_reminded", "needs_help", "does_not_need_help")
STAGE_1_COLOUR = (0.36, 0.55, 0.80, 1.0)
STAGE_2_COLOUR = (0.88, 0.55, 0.12, 1.0)
LEGEND = (
    ("blue: stage 1, what may be wrong", STAGE_1_COLOUR),
    ("orange: stage 2, what is needed", STAGE_2_COLOUR),
)
END_COLOURS = {"global_success": draw.GOOD, "global_fail": draw.ALARM}
END_COLOURS["warning_received"] = draw.ALARM
ACTION_WORDS = ("WAIT", "PLAN A GRASP", "POINT TO REMIND", "GRASP", "CANCEL")
STATUS = ("waiting", "showing the rules", "running", "SUCCEEDED", "FAILED", "aborted")
CUBE_WORDS = {Cube.COLOUR_RED: "red", Cube.COLOUR_GREEN: "green", Cube.COLOUR_BLUE: "blue"}
REASON_WIDTH = 42  # letters
REASON_LINES = 8
RULES_WIDTH = 84
DIALS = ("expert", "rested", "attentive", "collaborative")  # the upper end of each


def in_plane(x: float, z: float, ahead: float = 0.0) -> draw.Vector:
    """A point of the plane that leans back as the shipped view looks down; `ahead` of it in m."""
    s, c = math.sin(TILT), math.cos(TILT)
    return (x, PLANE_Y + z * s - ahead * c, z * c + ahead * s)


def strip(
    key: tuple[str, int], start: float, length: float, z: float, ahead: float, colour: draw.Colour
) -> Marker:
    """One bar of a row, from x = start to the right."""
    marker = draw.box(
        key, in_plane(start + length / 2, z, ahead), (length, 0.003, 0.6 * ROW), colour
    )
    marker.pose.orientation = draw.pitched(TILT)
    return marker


def words_at(
    key: tuple[str, int], x: float, z: float, height: float, words: str, colour: draw.Colour
) -> Marker:
    """Text in the plane of the panels, centred on (x, z)."""
    return draw.text(key, in_plane(x, z), height, words, colour)


def colour_of(state: str) -> draw.Colour:
    """Colour of a state's bar: stage 1, stage 2, the ends, or neutral."""
    if state in STAGE_1:
        return STAGE_1_COLOUR
    if state in STAGE_2:
        return STAGE_2_COLOUR
    return END_COLOURS.get(state, draw.FAINT)


def bars(
    ns: str,
    corner: tuple[float, float],
    labels: Sequence[str],
    values: Sequence[float],
    colours: Sequence[draw.Colour],
) -> Iterator[Marker]:
    """One row a value in [0, 1]: label, track, bar, number; from the upper left corner (x, z)."""
    x, z = corner
    start = x + LABEL_WIDTH
    for row, (label, value, colour) in enumerate(zip(labels, values, colours, strict=True)):
        height = z - row * ROW
        yield words_at((ns, 10 * row), x + LABEL_WIDTH / 2, height, LETTER, label, draw.INK)
        yield strip((ns, 10 * row + 1), start, BAR_LENGTH, height, 0.0, draw.TRACK)
        length = max(0.002, min(1.0, value) * BAR_LENGTH)
        yield strip((ns, 10 * row + 2), start, length, height, 0.004, colour)
        end = start + BAR_LENGTH + 0.06
        yield words_at((ns, 10 * row + 3), end, height, LETTER, f"{value:.2f}", draw.INK)


def belief_panel(info: ModelInfo | None, decision: Decision | None) -> Iterator[Marker]:
    """Bars of the belief over the person's states; nothing before the first decision."""
    if info is None or decision is None or len(info.states) != len(decision.belief):
        return
    x, z = BELIEF_AT
    middle = x + (LABEL_WIDTH + BAR_LENGTH + 0.1) / 2
    title = "WHAT THE ROBOT BELIEVES\nABOUT THE PERSON"
    yield words_at(("belief", 1000), middle, z + 0.14, TITLE, title, draw.INK)
    labels = [name.replace("_", " ") for name in info.states]
    colours = [colour_of(name) for name in info.states]
    yield from bars("belief", (x, z), labels, decision.belief, colours)
    foot = z - len(labels) * ROW - 0.02
    for number, (words, colour) in enumerate(LEGEND):
        key = ("belief", 1001 + number)
        yield words_at(key, middle, foot - 0.055 * number, 0.8 * LETTER, words, colour)


def decision_panel(info: ModelInfo | None, decision: Decision | None) -> Iterator[Marker]:
    """The last decision, what it is worth, between which bounds, and what came second."""
    if decision is None:
        return
    x, z = DECISION_AT
    yield words_at(("decision", 0), x, z + 0.16, TITLE, "THE ROBOT DECIDES TO", draw.INK)
    action = ACTION_WORDS[decision.action] if decision.action < len(ACTION_WORDS) else "?"
    yield words_at(("decision", 1), x, z + 0.06, 0.085, action, draw.ROBOT)
    lines = [f"worth {points(decision.value)} points"]
    lines.append(f"(best is in {points(decision.lower_bound)} .. {points(decision.upper_bound)})")
    if info is not None and 0 <= decision.runner_up < len(info.actions):
        second = info.actions[decision.runner_up].replace("_", " ")
        lines.append(f"second best: {second}, {decision.runner_up_gap:.2f} less")
    if info is not None and decision.observation_index < len(info.observations):
        seen = info.observations[decision.observation_index].replace("_", " ")
        lines.append(f"after seeing: {seen}")
    for row, words in enumerate(lines):
        yield words_at(("decision", 2 + row), x, z - 0.05 - row * 0.062, LETTER, words, draw.INK)


def points(value: float) -> str:
    """A value with two decimals, or a word for what is no number."""
    return f"{value:.2f}" if math.isfinite(value) else "unknown"


def dial_probabilities(types: Sequence[str], probability: Sequence[float]) -> list[float]:
    """P(expert), P(rested), P(attentive), P(collaborative): the type belief summed, (4,).

    A type that is no corner is named by its four dials, "e,s,a,c": each counts by its share.
    """
    sums = [0.0] * len(DIALS)
    for name, mass in zip(types, probability, strict=True):
        dials = name.split(",")
        words = name.split("_")
        for dial, word in enumerate(DIALS):
            share = float(dials[dial]) if len(dials) == len(DIALS) else float(word in words)
            sums[dial] += mass * share
    return sums


def type_panel(belief: TypeBelief | None, choice: PolicyChoice | None) -> Iterator[Marker]:
    """Who the person is thought to be, as one bar a dial, and the policy chosen for it, and why."""
    x, z = TYPES_AT
    middle = x + (LABEL_WIDTH + BAR_LENGTH + 0.1) / 2
    if belief is not None and belief.types:
        title = "WHO IS THIS PERSON?"
        yield words_at(("type belief", 1000), middle, z + 0.10, TITLE, title, draw.INK)
        values = dial_probabilities(belief.types, belief.probability)
        yield from bars("type belief", (x, z), DIALS, values, [draw.PERSON] * len(DIALS))
    if choice is not None and choice.policy:
        foot = z - 4.5 * ROW
        title = f"POLICY: {choice.policy.replace('_', ' ')}"
        yield words_at(("type belief", 1001), middle, foot, TITLE, title, draw.ROBOT)
        for row, line in enumerate(reason_lines(choice)):
            colour = draw.ALARM if choice.unlike_anyone_known and row == 0 else draw.INK
            height = foot - 0.07 - 0.057 * row
            yield words_at(("type belief", 1002 + row), middle, height, 0.87 * LETTER, line, colour)


def reason_lines(choice: PolicyChoice) -> list[str]:
    """Why the policy was chosen, in short lines; a person unlike anyone known comes first."""
    words = choice.reason.removeprefix(f"{choice.policy}: ")
    alarm = ["a person unlike anyone known"] if choice.unlike_anyone_known else []
    lines = textwrap.wrap(
        words, REASON_WIDTH, max_lines=REASON_LINES - len(alarm), placeholder=" ..."
    )
    return alarm + lines


def task_panel(state: TaskState | None) -> Iterator[Marker]:
    """Which task, how it stands, and by which rules."""
    x, z = TASK_AT
    if state is None or state.task_id == 0:
        yield words_at(("task", 0), x, z, TITLE, "no task yet", draw.FAINT)
        return
    status = STATUS[state.status] if state.status < len(STATUS) else "?"
    colour = {TaskState.SUCCEEDED: draw.GOOD, TaskState.FAILED: draw.ALARM}
    title = f"{state.scenario.upper()}   task {state.task_id}   {status}"
    ink = colour.get(state.status, draw.INK)
    yield words_at(("task", 0), x, z, 0.065, title, ink)
    failed = state.failed_by_person + state.failed_by_robot
    counts = (
        f"done {state.succeeded_by_person + state.succeeded_by_robot} of {state.subtasks_total}: "
        f"person {state.succeeded_by_person}, robot {state.succeeded_by_robot}    "
        f"failed {failed}    warnings {state.warnings}    score {state.score}"
    )
    yield words_at(("task", 1), x, z - 0.08, LETTER, counts, draw.INK)
    rules = "\n".join(textwrap.wrap(rules_in_words(state), RULES_WIDTH))
    yield words_at(("task", 2), x, z - 0.145, LETTER, rules, draw.FAINT)


def rules_in_words(state: TaskState) -> str:
    """The rules of the task in one sentence."""
    if state.scenario == "inspection":
        return "the person inspects each package and puts it into a tray 'inspected'"
    if all(rule.colour == Cube.COLOUR_UNKNOWN for rule in state.rules):
        return "one cube after the other into: " + ", ".join(map(turn_in_words, state.rules))
    return "which cube into which tray: " + ", ".join(map(rule_in_words, state.rules))


def rule_in_words(rule: SortingRule) -> str:
    """Where cubes of a colour belong, or each so and so many of them."""
    turn = f"{rule.occurrence}. " if rule.occurrence else ""
    return f"{turn}{CUBE_WORDS.get(rule.colour, '?')} into '{rule.label}'"


def turn_in_words(rule: SortingRule) -> str:
    """Where the next cube belongs; a coloured word with its ink, and what of it counts."""
    if rule.word == Cube.COLOUR_UNKNOWN:
        return f"'{rule.label}'"
    word, ink = (CUBE_WORDS.get(colour, "?") for colour in (rule.word, rule.ink))
    return f"{word} IN {ink.upper()}" if rule.ink_counts else f"{word.upper()} in {ink}"
