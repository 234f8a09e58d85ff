# SPDX-License-Identifier: BSD-3-Clause
"""How well characters explain recorded trials, history included, in blocks that fit the cache."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fabric_sim.character import Character
from fabric_sim.experiments.likelihood import Filter
from fabric_sim.experiments.tables import Tables
from fabric_sim.experiments.trials import (
    NOTHING,
    PERSON_FAILED,
    PERSON_SUCCEEDED,
    ROBOT_SUCCEEDED,
    SYMBOLS,
    UNSEEN,
    WARN,
    Trial,
)
from fabric_sim.experiments.watching import Watching
from fabric_sim.worker_model import History, ModelLibrary, effective_character
from fabric_sim.worker_parameters import WorkerParameters

BLOCK = 16  # characters that are filtered together


class Explainer:
    """log P(trial | character) for trials in their order, each after the ones before it."""

    def __init__(self, watching: Watching, parameters: WorkerParameters | None = None) -> None:
        self.watching = watching
        self.parameters = parameters or WorkerParameters.load()
        self._library = ModelLibrary(self.parameters.model)
        self._filters: dict[tuple, Filter] = {}

    def fresh(self, characters: Sequence[Character], trials: Sequence[Trial]) -> np.ndarray:
        """(n_trials, B): nobody has a history."""
        return self.after([History()] * len(trials), characters, trials)

    def person(self, characters: Sequence[Character], trials: Sequence[Trial]) -> np.ndarray:
        """(n_trials, B): one person, whom the trials before have tired, annoyed and practised."""
        return self.after(self.pasts(trials), characters, trials)

    def after(
        self, pasts: Sequence[History], characters: Sequence[Character], trials: Sequence[Trial]
    ) -> np.ndarray:
        """(n_trials, B): each trial by somebody with the past that goes with it."""
        found = np.empty((len(trials), len(characters)))
        for start in range(0, len(characters), BLOCK):
            block = characters[start : start + BLOCK]
            for row, (trial, past) in enumerate(zip(trials, pasts, strict=True)):
                scores = self._filter(block, past, trial.scenario)
                found[row, start : start + len(block)] = scores.run(trial).total
        return found

    def _filter(self, block: Sequence[Character], history: History, scenario: str) -> Filter:
        p = self.parameters
        now = [effective_character(character, history, p.history) for character in block]
        key = (scenario, *(character.dials for character in now))
        if key not in self._filters:
            tables = Tables(now, p, self._library, self.watching, scenario)
            self._filters = {**dict(list(self._filters.items())[-3:]), key: Filter(tables)}
        return self._filters[key]

    def pasts(self, trials: Sequence[Trial]) -> list[History]:
        """Return n_r, k_t and practice in the middle of each trial, as far as was seen."""
        w = self.watching
        found, history = [], History()
        for trial in trials:
            during = self._course(trial)
            found.append(_plus(history, during, 0.5))
            whole = _plus(history, during, 1.0)
            history = History(
                w.carried * whole.unwanted, w.carried * whole.work, w.remembered * whole.practised
            )
        return found

    def _course(self, trial: Trial) -> History:
        """What a trial adds; the person is taken to have meant every warning that was seen."""
        p = self.parameters.history
        effort = p.work[trial.scenario]
        own = int(np.isin(trial.events, (PERSON_SUCCEEDED, PERSON_FAILED)).sum())
        others = int((trial.events > NOTHING).sum()) - own
        began = (trial.symbols == WARN) & (np.roll(trial.symbols, 1) != WARN)
        helped = int((trial.events == ROBOT_SUCCEEDED).sum())
        return History(
            unwanted=float(began.sum()) - p.restored * helped,
            work=effort * (own + p.helped_work * others),
            practised=effort * own,
        )


def _plus(history: History, during: History, share: float) -> History:
    return History(
        max(0.0, history.unwanted + share * during.unwanted),
        history.work + share * during.work,
        history.practised + share * during.practised,
    )


# -- baselines ------------------------------------------------------------------------------------


def uniform_scores(trials: Sequence[Trial]) -> np.ndarray:
    """(n_trials,): every symbol alike at every tick; what the trays report is not counted."""
    return np.array([-np.log(len(SYMBOLS)) * (t.symbols != UNSEEN).sum() for t in trials])


def persistence_scores(trials: Sequence[Trial], held_in: Sequence[Trial]) -> np.ndarray:
    """(n_trials,): a symbol stays as often as in the held-in trials, else any other follows.

    Reports of the trays come as often as there, too.
    """
    kept = sum(_stays(trial) for trial in held_in) + 1.0
    changed = sum(_changes(trial) for trial in held_in) + 1.0
    stay = np.log(kept / (kept + changed))
    change = np.log(changed / (kept + changed) / (len(SYMBOLS) - 1))
    counts = sum(_outcomes(trial) for trial in held_in) + 1.0
    outcome = np.log(counts / counts.sum())
    first = -np.log(len(SYMBOLS))
    return np.array(
        [first + stay * _stays(t) + change * _changes(t) + outcome @ _outcomes(t) for t in trials]
    )


def _changes(trial: Trial) -> float:
    seen = trial.symbols[trial.symbols != UNSEEN]
    return float((np.diff(seen) != 0).sum())


def _stays(trial: Trial) -> float:
    return float((trial.symbols != UNSEEN).sum() - 1 - _changes(trial))


def _outcomes(trial: Trial) -> np.ndarray:
    """(3,): ticks without a report of the person's cubes, with success, with failure."""
    right = (trial.events == PERSON_SUCCEEDED).sum()
    wrong = (trial.events == PERSON_FAILED).sum()
    return np.array([len(trial) - right - wrong, right, wrong], dtype=float)
