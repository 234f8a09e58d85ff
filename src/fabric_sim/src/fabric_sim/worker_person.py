# SPDX-License-Identifier: BSD-3-Clause
"""The lasting side of a worker: character, history, and what both say about this moment."""

from __future__ import annotations

from .character import Character
from .worker_model import History, ModelSource, WorkerModel, effective_character
from .worker_parameters import ScenarioTiming, WorkerParameters
from .worker_responses import refusal_probability


class Person:
    """A character with a history: n_r, k_t and practice move the dials (section 6.4.1.1)."""

    def __init__(
        self, character: Character, parameters: WorkerParameters, library: ModelSource
    ) -> None:
        self.character = character
        self._p = parameters
        self._library = library
        self._history = History()
        self._now: Character | None = None
        self._model: WorkerModel | None = None  # of now
        self._refusal: float | None = None  # of that model

    @property
    def history(self) -> History:
        """What the person went through."""
        return self._history

    @property
    def now(self) -> Character:
        """The dials as they are now."""
        if self._now is None:
            self._now = effective_character(self.character, self._history, self._p.history)
        return self._now

    def become(self, character: Character) -> None:
        """Take on a mood: other dials for the history to act on."""
        self.character = character
        self._changed()

    def _changed(self) -> None:
        self._now = self._model = self._refusal = None

    def model(self) -> WorkerModel:
        """Return the MDP of the person as of now."""
        if self._model is None:
            self._model = self._library.model(self.now)
        return self._model

    def slowness(self, timing: ScenarioTiming) -> float:
        """Return the factor on the duration of thinking and handling."""
        weights = timing.slowness.items()
        return 1.0 + sum(weight * self.now.influence(name) for name, weight in weights)

    def refusal(self, origin: str, distracted_for: float, scenario: str) -> float:
        """Return the probability of refusing help when interrupted at `origin`."""
        if self._refusal is None:
            self._refusal = self.model().refusal
        p = self._p.responses
        return refusal_probability(self._refusal, origin, distracted_for, scenario, p)

    def annoyed(self, amount: float) -> None:
        """Add unwanted interference, in interferences."""
        self._history.unwanted += amount
        self._changed()

    def helped_well(self) -> None:
        """Good help makes unwanted interference good."""
        self._history.unwanted = max(0.0, self._history.unwanted - self._p.history.restored)
        self._changed()

    def worked(self, scenario: str, by_person: bool) -> None:
        """Add the work of one subtask; practice comes from one's own work only."""
        effort = self._p.history.work[scenario]
        self._history.work += effort * (1.0 if by_person else self._p.history.helped_work)
        self._history.practised += effort if by_person else 0.0
        self._changed()

    def rested(self) -> None:
        """Undo some tiredness by a break."""
        self._history.work = max(0.0, self._history.work - self._p.history.rest)
        self._changed()
