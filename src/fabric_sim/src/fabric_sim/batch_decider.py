# SPDX-License-Identifier: BSD-3-Clause
"""What decides in the headless runner: the planner's agent, or whatever an experiment puts there.

The true state of the person reaches a decision through `Decider.decide` and nowhere else, so that
an oracle is possible and everything else can be seen not to peep.
"""

from __future__ import annotations

from typing import Protocol

from mypy_extensions import mypyc_attr

import fabric_planner as fp
from fabric_msgs.clock import header_of
from fabric_msgs.msg import Decision, Observation
from fabric_sim.truth import Truth


class Names(Protocol):
    """The part of a model that the meter needs."""

    states: list[str]  # in the order of Decision.belief


class Decider(Protocol):
    """Decides on each observation of a run."""

    @property
    def model(self) -> Names:
        """The model in force."""

    @property
    def model_hash(self) -> str:
        """What Decision.model_hash says while this model is in force."""

    def reset(self) -> None:
        """Forget the last task."""

    def set_model(self, path: str, keep_belief: bool) -> None:
        """Use another model file from now on (a policy that ABPS has selected)."""

    def decide(self, observation: Observation, truth: Truth) -> Decision:
        """Return the decision; the runner stamps it as the observation."""


@mypyc_attr(allow_interpreted_subclasses=True)
class AgentDecider:
    """The planner's decision agent; it never looks at the truth."""

    def __init__(self, agent: fp.DecisionAgent) -> None:
        self._agent = agent

    @property
    def model(self) -> Names:
        """The model in force."""
        return self._agent.model

    @property
    def model_hash(self) -> str:
        """Hash of the model in force."""
        return self._agent.model_hash

    def reset(self) -> None:
        """Back to the initial belief."""
        self._agent.reset()

    def set_model(self, path: str, keep_belief: bool) -> None:
        """Load another model file."""
        self._agent.set_model(path, keep_belief)

    def decide(self, observation: Observation, truth: Truth) -> Decision:
        """Return what the agent decides on the observation alone."""
        message = Decision.__new__(Decision)  # `fill` sets every field but the header
        message.header = header_of(0.0)
        return self._agent.decide(observation).fill(message)

    def choose(self, observation: Observation) -> int:
        """Decide as `decide` does; return the action and nothing else."""
        return self._agent.choose(observation)
