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


def level(candidates: Sequence[Candidate], notice: str, words: Sequence[str]) -> list[str]:
    """A word for each candidate by its place among all: equal shares of the ranks a word."""
    values = [candidate.mean(notice) for candidate in candidates]
    ranks = np.argsort(np.argsort(values, kind="stable"), kind="stable")
    return [words[rank * len(words) // len(values)] for rank in ranks]


def names_of(candidates: Sequence[Candidate], kept: Sequence[str]) -> list[str]:
    """A name for each: its own for those of `kept`, else by what it did; all are different.

    How much it takes over and how much it points, each in thirds of the library, for instance
    `active_pointing`; namesakes are numbered by reward.
    """
    takes = level(candidates, "take_overs", ("reserved", "balanced", "active"))
    points = level(candidates, "pointings", ("silent", "hinting", "pointing"))
    names: list[str] = []
    for candidate, take, point in zip(candidates, takes, points, strict=True):
        name = candidate.name if candidate.name in kept else f"{take}_{point}"
        same = sum(other.rsplit("-", 1)[0] == name for other in names)
        names.append(name if same == 0 else f"{name}-{same + 1}")
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
