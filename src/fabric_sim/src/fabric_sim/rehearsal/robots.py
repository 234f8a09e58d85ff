# SPDX-License-Identifier: BSD-3-Clause
"""The robots of a rehearsal, whose policies were solved beforehand so that tasks take moments."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from pathlib import Path
from types import SimpleNamespace

import fabric_planner as fp
from fabric_abps import Policy, Selector
from fabric_sim.batch_decider import AgentDecider, Decider
from fabric_sim.batch_files import Files
from fabric_sim.experiments.long_term_deciders import Prepared, PreparedDecider

SCENARIO = "sorting"
ABPS = "abps"
ALONE = "none"


class Ready(Prepared):
    """A model that never searches, so that nothing is worked out for searches either."""

    @cached_property
    def agent(self) -> fp.DecisionAgent:
        """What decides by it."""
        limits = fp.PlannerOptions(max_nodes=1, preparation=fp.Preparation.QUICK)
        return fp.DecisionAgent(
            str(self.path), limits, str(self.map_path), solver="offline", policy=self.solved
        )


class Robots:
    """What decides in the tasks of a study; make it before processes are forked."""

    def __init__(self, policies: Iterable[str], files: Files | None = None) -> None:
        """Prepare `policies`. Raises ValueError naming one that no robot has."""
        self.files = files or Files()
        self._ready: dict[str, Ready] = {}  # by the path of the model
        for policy in sorted(set(policies)):
            self._prepare(policy)

    def _prepare(self, policy: str) -> None:
        if policy == ABPS:
            for own in self.selector().library.policies:
                self._make_ready(own)
        elif policy != ALONE:
            self._make_ready(SimpleNamespace(path=self._model(policy)))

    def _make_ready(self, policy: Policy | SimpleNamespace) -> None:
        maps = self.files.share("fabric_planner") / "config"
        self._ready[str(policy.path)] = Ready.of(policy, maps)

    def _model(self, policy: str) -> Path:
        path = self.files.model(policy, SCENARIO)
        if not path.is_file():
            raise ValueError(f"policy {policy!r}: there is no model {path}")
        return path

    def selector(self) -> Selector:
        """ABPS with its trained library, new to everybody."""
        return self.files.selector(SCENARIO)

    def decider(self, policy: str, selector: Selector | None = None) -> Decider:
        """What decides by a policy that was prepared; with ABPS the selector changes its model."""
        if policy == ALONE:
            return AgentDecider(self.files.agent(self._model(policy)))
        if selector is None:
            return PreparedDecider(self._ready, str(self._model(policy)))
        first = selector.library[selector.library.base].path
        return PreparedDecider(self._ready, str(first))
