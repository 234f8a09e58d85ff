# SPDX-License-Identifier: BSD-3-Clause
"""The robots of a rehearsal, whose policies were solved beforehand so that tasks take moments."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from types import SimpleNamespace

from fabric_abps import Selector
from fabric_sim.batch_decider import AgentDecider, Decider
from fabric_sim.batch_files import Files
from fabric_sim.experiments.long_term_deciders import PreparedDecider
from fabric_sim.experiments.long_term_shifts import World

SCENARIO = "sorting"
ABPS = "abps"
ALONE = "none"


class Robots:
    """What decides in the tasks of a study; make it before processes are forked."""

    def __init__(self, policies: Iterable[str], files: Files | None = None) -> None:
        """Prepare `policies`. Raises ValueError naming one that no robot has."""
        self.files = files or Files()
        self._world = World(SCENARIO, self.files)
        for policy in sorted(set(policies)):
            self._prepare(policy)

    def _prepare(self, policy: str) -> None:
        if policy == ABPS:
            for own in self.selector().library.policies:
                self._world.prepare(own)
        elif policy != ALONE:
            path = self._model(policy)
            self._world.prepare(SimpleNamespace(path=path, name=policy))

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
            return PreparedDecider(self._world.robots, str(self._model(policy)))
        first = selector.library[selector.library.base].path
        return PreparedDecider(self._world.robots, str(first))
