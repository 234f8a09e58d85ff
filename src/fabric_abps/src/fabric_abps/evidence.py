# SPDX-License-Identifier: BSD-3-Clause
"""What a task looked like so far, each observation credited to the policy it answers."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fabric_abps.observation_model import ObservationModel, task_weight
from fabric_abps.signals import SignalEncoder


class Stretch(NamedTuple):
    """Observations in a row that answer one policy."""

    policy: int
    codes: list[int]


class TaskEvidence:
    """The codes of one task. A task played with one policy is one stretch."""

    def __init__(self, policy: int) -> None:
        """policy: index of the one that the task starts with."""
        self.stretches: list[Stretch] = []
        self._encoder = SignalEncoder()
        self._acted = self._acts_next = policy

    def observe(self, observation: Any) -> None:
        """Take the next observation: it answers what the robot decided last."""
        if not self.stretches or self.stretches[-1].policy != self._acted:
            self.stretches.append(Stretch(self._acted, []))
        self.stretches[-1].codes.append(self._encoder.encode(observation))
        self._acted = self._acts_next

    def switch(self, policy: int) -> None:
        """Another policy decides from the next observation on."""
        self._acts_next = policy

    @property
    def codes(self) -> list[int]:
        """All observations in order."""
        return [code for stretch in self.stretches for code in stretch.codes]

    @property
    def count(self) -> int:
        """Number of observations."""
        return sum(len(stretch.codes) for stretch in self.stretches)

    def contributions(self, model: ObservationModel) -> NDArray:
        """ln P of every observation under every type, given those before, (count, n_types) nats."""
        parts, previous = [], None
        for policy, codes in self.stretches:
            parts.append(model.contributions(codes, policy, previous))
            previous = codes[-1]
        return np.concatenate(parts)

    def weight(self, effective: float) -> float:
        """Share of its log-likelihood that the task counts with, see `task_weight`."""
        return task_weight(self.count, effective)

    def log_likelihood(self, model: ObservationModel) -> NDArray:
        """ln P(sigma | tau, pi) under every type, (n_types,) nats, of one observation at least."""
        return self.contributions(model).sum(axis=0)

    def p_values(self, model: ObservationModel) -> NDArray | None:
        """How typical the task is of every type, (n_types,); None when it was played with several
        policies, for no training task was."""
        if len(self.stretches) != 1:
            return None
        return model.p_values(self.stretches[0].codes, self.stretches[0].policy)
