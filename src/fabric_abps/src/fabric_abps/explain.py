# SPDX-License-Identifier: BSD-3-Clause
"""Why the selector believes and chooses what it does, in words and numbers."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fabric_abps.evidence import TaskEvidence
from fabric_abps.observation_model import ObservationModel
from fabric_abps.signals import code_name


@dataclass(frozen=True)
class Move:
    """What one kind of observation of a task did to the belief."""

    words: str  # the observation
    count: int  # how often it was made
    log_ratio: float  # nats by which it spoke for `tau`, against the belief before the task
    tau: str  # the type most likely after the task

    def __str__(self) -> str:
        often = {1: "once", 2: "twice"}.get(self.count, f"{self.count} times")
        factor = math.exp(abs(self.log_ratio))
        likely = "as likely" if self.log_ratio >= 0 else "less likely"
        return f"'{self.words}' {often}, {factor:.2g} times {likely} for {in_words(self.tau)}"


@dataclass(frozen=True)
class Explanation:
    """What `Selector.explain` answers."""

    ranking: tuple[tuple[str, float, float], ...]  # policy, score, expected reward; best first
    moves: tuple[Move, ...]  # of the last task; what moved the belief most comes first
    typicality: float  # see Familiarity
    unlike_anyone_known: bool
    alarm_rate: float  # of that flag, for a known person
    changed: bool  # somebody else seems to have come

    def __str__(self) -> str:
        sentences = []
        if self.moves:
            sentences.append(f"Most telling in the last task: {self.moves[0]}.")
        if self.changed:
            sentences.append("Somebody else seems to have come.")
        return " ".join(sentences)


def in_words(tau: str) -> str:
    """A type's name for people."""
    return tau.replace("_", " ")


def moves(
    evidence: TaskEvidence,
    model: ObservationModel,
    effective: float,
    types: Sequence[str],
    before: NDArray,
    after: NDArray,
) -> tuple[Move, ...]:
    """What each kind of observation did, the strongest first; before, after: beliefs (n_types,).

    The parts sum to the log-likelihood that Eq. 5.1 used, whatever the observation model is.
    """
    if evidence.count == 0:
        return ()
    tau = int(np.argmax(after))
    codes = np.array(evidence.codes)
    parts = evidence.weight(effective) * evidence.contributions(model)
    ratios = parts[:, tau] - parts @ before
    found = [
        Move(
            code_name(int(code)),
            int((codes == code).sum()),
            ratios[codes == code].sum(),
            types[tau],
        )
        for code in np.unique(codes)
    ]
    return tuple(sorted(found, key=lambda move: (-abs(move.log_ratio), move.words)))
