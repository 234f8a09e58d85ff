# SPDX-License-Identifier: BSD-3-Clause
"""How a person answers help (thesis section 4.3.2), and what a person remembers of the rules."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from .character import Character
from .worker_parameters import MemoryParameters, ResponseParameters

SUREST = 30.0  # log-odds; more would round to a certainty


def origin_of(state: str, action: str, failed: int) -> str:
    """Name what the robot interrupts: a state, `grasping`, `trying_again` after failures, or
    `no_attention` of whoever looks around unless it is after a failure."""
    if action == "grasp":
        return "trying_again" if failed > 0 else "grasping"
    if action == "look_around" and state != "failed_to_grasp":
        return "no_attention"
    return state


def refusal_probability(
    general: float, origin: str, distracted_for: float, scenario: str, p: ResponseParameters
) -> float:
    """Return the probability that a person interrupted at `origin` refuses the robot's help.

    general: the model's refusal, which carries the collaborativeness. Its log-odds count as much as
    the person does in the scenario; added to them are those of the origin, as much as it counts,
    and those of the credit for what one does oneself. Somebody distracted accepts in proportion to
    the time of the distraction, `distracted_for` s.
    """
    shift = p.refusal_shift.get(origin, 0.0)
    if origin == "no_attention":
        shift -= p.distraction_relief * min(1.0, distracted_for / p.distraction_time)
    general = min(1.0 - 1e-6, max(1e-6, general))
    odds = p.person_counts[scenario] * math.log(general / (1.0 - general))
    odds += p.origin_counts[scenario] * shift + p.own_credit[scenario]
    odds = min(SUREST, max(-SUREST, odds))
    return 1.0 / (1.0 + math.exp(-odds))


class RuleMemory:
    """For every item of a task's rules the probability to know its tray; who does not, guesses.

    load: cognitive load relative to task type 4, by which the unknown and the forgotten grow.
    """

    def __init__(
        self, items: Iterable[Any], person: Character, p: MemoryParameters, load: float = 1.0
    ) -> None:
        known = p.known - p.inexperience * (1.0 - person.expertise)
        known -= p.distraction * (1.0 - person.attention)
        known -= (load - 1.0) * (1.0 - known)
        self._known = {item: max(0.0, known) for item in items}
        self._forgets = min(1.0, load * p.forgets * (1.0 - person.attention))
        self._learns, self._taught = p.learns, p.taught

    def knows(self, item: Any) -> float:
        """Return the probability of knowing the tray of an item; 1 when there is no rule."""
        return self._known.get(item, 1.0)

    def saw(self, item: Any, by_person: bool) -> None:
        """Take note of a right placement of this item, one's own or the robot's."""
        rate = self._learns if by_person else self._taught
        for other, value in self._known.items():
            if other == item:
                self._known[other] = value + rate * (1.0 - value)
            else:
                self._known[other] = value * (1.0 - self._forgets)
