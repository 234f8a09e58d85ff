# SPDX-License-Identifier: BSD-3-Clause
"""A worker left alone: chooses actions, spends time on them, handles cubes, takes breaks."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from typing import Any

import numpy as np
from mypy_extensions import mypyc_attr

from .character import Character
from .truth import Counters, Truth
from .worker_agenda import Agenda
from .worker_events import HELD_BY_NOBODY, EventKind, WorkerEvent
from .worker_model import ACTION_INDEX, STATE_INDEX, ModelLibrary, ModelSource, WorkerModel
from .worker_parameters import ACTIONS, STATES, WorkerParameters
from .worker_person import Person
from .worker_responses import RuleMemory


@mypyc_attr(allow_interpreted_subclasses=True)
class LoneWorker:
    """The acting half of a Worker; knows a cube but neither a robot nor the task's status.

    state and action are names of STATES and ACTIONS. away: out of sight. holding: a cube is in
    the hand. counters: steps since the subtask started.
    """

    def __init__(
        self,
        character: Character,
        rng: np.random.Generator,
        parameters: WorkerParameters | None = None,
        library: ModelSource | None = None,
    ) -> None:
        self._p = parameters or WorkerParameters.load()
        self.person = Person(character, self._p, library or ModelLibrary(self._p.model))
        self._rng = rng
        self.state, self.action = "task_assigned", "idle"
        self.away = False
        self.holding = False
        self.counters = Counters()
        self._subtask = False  # a cube that is not dealt with yet
        self._item: Any = None  # of the rules, that the cube falls under
        self._rules: Mapping[Any, str] = {}
        self._memory = RuleMemory((), character, self._p.memory)
        self._cube, self._held_by = False, HELD_BY_NOBODY
        self._events: list[WorkerEvent] = []
        self._agenda = Agenda()
        self._truth: Truth | None = None
        self._distracted_since: float | None = None  # s, while the eyes are off the work
        self._prepare("inspection")

    def _prepare(self, scenario: str) -> None:
        """Update the model by the history, as after each task in section 6.4.1.1."""
        self._scenario, self._sorting = scenario, scenario == "sorting"
        self._timing = getattr(self._p.timing, scenario)
        self._model: WorkerModel = self.person.model()
        self._slow = self.person.slowness(self._timing)

    @property
    def looking_around(self) -> bool:
        """Whether the eyes are off the work; who stands lost in thought looks elsewhere too."""
        lost = self.state == "no_attention" and self.action == "idle"
        return lost or self.action == "look_around"

    @property
    def next_deed(self) -> float:
        """When the present piece of the action ends, s: a cube picked or placed, a rest over."""
        return self._agenda.next_piece

    def intended_tray(self) -> str | None:
        """Label of the tray for which the cube in the hand is meant now; None with empty hands.

        Asking changes nothing: the worker goes on to draw as if nobody had asked.
        """
        if not self.holding:
            return None
        rng, self._rng = self._rng, deepcopy(self._rng)
        try:
            return self._choose_tray(self._rules.get(self._item, "inspected"))
        finally:
            self._rng = rng

    def _emit(self, t: float, kind: EventKind, **details: Any) -> None:
        self._events.append(WorkerEvent(t, kind, self.state, self.action, **details))

    def _set_state(self, state: str, t: float) -> None:
        self.state = state
        self._truth = None

    def _release(self, t: float) -> None:
        if self.holding:
            self.holding = False
            self._emit(t, EventKind.RELEASED, item=self._item)

    def _begin(self, t: float, action: str) -> None:
        self._agenda.clear()
        self.action = action
        self._truth = None
        if not self.looking_around:
            self._distracted_since = None
        elif self._distracted_since is None:
            self._distracted_since = t
        if self._subtask:
            self.counters.step(self.state, action)
        self._emit(t, EventKind.STARTED_ACTION)

    def _stand_by(self, t: float) -> None:
        """Stand idle until something happens."""
        self._agenda.clear()
        if self.action != "idle":
            self._begin(t, "idle")

    def _decide(self, t: float) -> None:
        """Choose the next action by the policy, or wait while there is nothing to do."""
        if not self._subtask or not self._cube or self._held_by != HELD_BY_NOBODY:
            self._stand_by(t)
            return
        state = STATE_INDEX[self.state]
        action = self._model.sample_action(state, self._rng)
        self._begin(t, ACTIONS[action])
        if self.action == "grasp":
            self._grasp(t)
        elif self.action == "walk_away":
            self._agenda.add(t + self._timing.leave.draw(self._rng), self._leave)
        else:
            self._pass_time(t, state, action)

    def _pass_time(self, t: float, state: int, action: int) -> None:
        """Idle or look around, then be in the next state."""
        span = self._timing.look_around if self.looking_around else self._timing.idle
        slow = self._slow
        if self._sorting and self.action == "idle":
            slow *= 1.0 + self._p.memory.hesitation * (1.0 - self._memory.knows(self._item))
        outcome = STATES[self._model.sample_next(state, action, self._rng)]
        self._agenda.add(t + span.draw(self._rng, slow), lambda now: self._arrive(now, outcome))

    def _arrive(self, t: float, state: str) -> None:
        self._set_state(state, t)
        self._decide(t)

    def _grasp(self, t: float) -> None:
        """Lift and place, or fail to lift; light cubes are always lifted when sorting."""
        outcome = self._outcome_of_grasp()
        if self._sorting or outcome == "success":
            self._agenda.add(t + self._timing.reach.draw(self._rng, self._slow), self._pick)
        else:
            end = t + self._timing.failed_attempt.draw(self._rng, self._slow)
            self._agenda.add(end, lambda now: self._fail(now, outcome))

    def _outcome_of_grasp(self) -> str:
        """Draw the state that a grasp begun now leads to."""
        grasp = ACTION_INDEX["grasp"]
        return STATES[self._model.sample_next(STATE_INDEX[self.state], grasp, self._rng)]

    def _fail(self, t: float, state: str) -> None:
        """Let go: the hands return before anything else begins."""
        self.counters.failed += 1
        self.action = "idle"
        self._set_state(state, t)
        self._agenda.add(t + self._timing.retreat.draw(self._rng, self._slow), self._decide)

    def _pick(self, t: float) -> None:
        if not self._cube or self._held_by != HELD_BY_NOBODY:
            self._arrive(t, "evaluating")
            return
        self.holding = True
        self._agenda.drop_notice()
        self._emit(t, EventKind.PICKED_CUBE, item=self._item)
        placed = t + self._timing.carry.draw(self._rng, self._slow)
        self._agenda.add(placed, self._place)
        self._agenda.add(placed + self._timing.retreat.draw(self._rng, self._slow), self._decide)

    def _place(self, t: float) -> None:
        self.holding = False
        right = self._rules.get(self._item, "inspected")
        label = self._choose_tray(right)
        self.counters.placed(label == right)
        self._emit(
            t, EventKind.PLACED_CUBE, container=label, correct=label == right, item=self._item
        )

    def _choose_tray(self, right: str) -> str:
        if not self._sorting or self._rng.random() < self._memory.knows(self._item):
            return right
        labels = sorted(set(self._rules.values()))
        return labels[int(self._rng.integers(len(labels)))]

    # -- breaks ---------------------------------------------------------------------------------

    def _leave(self, t: float) -> None:
        self.away = True
        self._set_state("recovery", t)
        self._emit(t, EventKind.LEFT)
        self._rest(t)

    def _rest(self, t: float) -> None:
        self._begin(t, "idle")
        self._agenda.add(t + self._timing.rest.draw(self._rng), self._rested)

    def _rested(self, t: float) -> None:
        index = self._model.sample_next(STATE_INDEX["recovery"], ACTION_INDEX["idle"], self._rng)
        if STATES[index] == "recovery":
            self._rest(t)
        else:
            back = t + self._timing.come_back.draw(self._rng)
            self._agenda.add(back, lambda now: self._return(now, STATES[index]))

    def _return(self, t: float, state: str) -> None:
        self.away = False
        self.person.rested()
        self._set_state(state, t)
        self._emit(t, EventKind.RETURNED)
        self._take_up_work(t)

    def _take_up_work(self, t: float) -> None:
        """Go on after a break."""
        self._decide(t)
