# SPDX-License-Identifier: BSD-3-Clause
"""What a policy of the library is called and how it is told to people.

Names and sentences come from what a policy did beside people, not from its numbers.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fabric_abps.dials import CLEAR, DIALS, Dial, Setting

NOTICES = ("success", "warnings", "take_overs", "pointings", "duration_s")  # means of a task
TRAITS = (
    ("beginners", "experts"),
    ("tired", "rested"),
    ("distracted", "attentive"),
    ("noncollaborative", "collaborative"),
)
ACTIVITY = ("reserved", "balanced", "active")  # thirds of a library by how often it takes over
SEEING = {
    "pomdp": "The person's state is hidden (POMDP).",
    "mixed": "Whether there is trouble is seen, what kind is hidden (mixed observability).",
    "mdp": "Each symbol is taken for the state it fits best (MDP).",
}
WRITTEN = {
    "proactive": "Reads the person's state from what they do, offers help before taking over.",
    "reactive": "Takes over by fixed rules, after 15 s without success or a failed attempt.",
    "none": "Leaves the task to the person.",
}


@dataclass(frozen=True)
class Candidate:
    """A candidate with its files and what it did.

    model, map, policy: contents of its files. reward: (n_people,) points a task. notices:
    (n_people, 5) means of NOTICES. people: (n_people, 4) dials of the people it was run with.
    """

    name: str  # among the candidates
    setting: Setting | None  # None: written by hand
    model: str
    map: str
    policy: str
    reward: NDArray
    notices: NDArray
    people: NDArray

    def mean(self, notice: str) -> float:
        """Mean over all people of one of NOTICES."""
        return float(self.notices[:, NOTICES.index(notice)].mean())


def names_of(candidates: Sequence[Candidate], kept: Sequence[str]) -> list[str]:
    """A name for each: its own for those of `kept`, else what it did and what it is.

    How much it takes over, in thirds of the library, and the dial that is turned furthest, for
    instance `reserved_wary`; of namesakes the later take a further dial, or a number at last.
    """
    order = np.argsort([candidate.mean("take_overs") for candidate in candidates], kind="stable")
    rank = {int(place): number for number, place in enumerate(order)}
    names: list[str] = []
    for place, candidate in enumerate(candidates):
        if candidate.name in kept or candidate.setting is None:
            names.append(candidate.name)
            continue
        activity = ACTIVITY[rank[place] * len(ACTIVITY) // len(candidates)]
        words = [f"{activity}_{word}" for word in candidate.setting.adjectives() or ["usual"]]
        words += [f"{words[0]}_{number}" for number in range(2, len(candidates) + 2)]
        names.append(next(word for word in words if word not in names))
    return names


def sentence(candidate: Candidate) -> str:
    """What the policy is, in one line."""
    if candidate.setting is None:
        return WRITTEN[candidate.name]
    words = candidate.setting.words() or "close to the base model"
    did = f"{candidate.mean('take_overs'):.1f} take-overs, {candidate.mean('pointings'):.1f} "
    return f"{words[0].upper()}{words[1:]}; {did}pointings a task."


def card(scenario: str, name: str, candidate: Candidate) -> str:
    """The card of a policy, Markdown."""
    parts = [
        "<!-- SPDX-License-Identifier: BSD-3-Clause -->",
        f"# {name}\n\n{sentence(candidate)}",
        *_dials(candidate.setting),
        _deeds(scenario, candidate),
        _by_kind(candidate),
    ]
    return "\n\n".join(parts) + "\n"


def _dials(setting: Setting | None) -> list[str]:
    if setting is None:
        return ["Written by hand, see docs/models/robot_models.md."]
    rows = [
        f"| {dial.name} | {setting.factors[dial.name]:g} | {_meaning(dial, setting)} |"
        for dial in DIALS
    ]
    head = "| dial | times the base model | so it |\n|---|---|---|\n"
    jitter = f"Each chance was shaken besides (standard deviation {setting.jitter:g} of its log)."
    return [SEEING[setting.observability], head + "\n".join(rows), jitter]


def _meaning(dial: Dial, setting: Setting) -> str:
    turned = setting.turned(dial)
    if turned == 0.0:
        return "is as the base model"
    words = dial.many if turned > 0.0 else dial.few
    return words if abs(turned) > CLEAR else f"{words}, a little"


def _deeds(scenario: str, candidate: Candidate) -> str:
    rows = [f"| {notice.replace('_s', ', s').replace('_', '-')} | {candidate.mean(notice):.2f} |"
            for notice in NOTICES]  # fmt: skip
    head = f"What it did beside {len(candidate.people)} random people, {scenario}, means a task:\n"
    reward = f"| reward, points | {candidate.reward.mean():.2f} |\n"
    return head + "\n| | |\n|---|---|\n" + reward + "\n".join(rows)


def _by_kind(candidate: Candidate) -> str:
    """Reward of the halves of each trait."""
    lines = ["| people | reward, points | | |", "|---|---|---|---|"]
    for trait, (low, high) in enumerate(TRAITS):
        above = candidate.people[:, trait] >= 0.5
        means = [_mean(candidate.reward[flags]) for flags in (~above, above)]
        lines.append(f"| {low} | {means[0]} | {high} | {means[1]} |")
    return "\n".join(lines)


def _mean(values: NDArray) -> str:
    return f"{values.mean():.2f}" if len(values) else "-"
