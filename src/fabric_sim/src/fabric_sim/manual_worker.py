# SPDX-License-Identifier: BSD-3-Clause
"""A simulated person who does what somebody at the keys says (thesis section 6.4.1).

What an action brings takes the same time as for the simulated people; what the person thinks is
read from what the person does. Commands may come from any thread.

    worker = ManualWorker(named_generator(seed, "worker"), parameters)
    worker.start_task(0.0, "inspection", named_generator(seed, "worker", 1))
    accepted, reason = worker.command("begin")      # nothing is to happen before
    worker.start_subtask(0.0)
    accepted, reason = worker.command("grasp")
    events = worker.step(0.05, robot_state, world_view)
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from .character import named_generator
from .manual_commands import NAMES
from .truth import Truth
from .worker import Worker
from .worker_events import (
    HELD_BY_NOBODY,
    PHASE_APPROACH,
    PHASE_CARRY,
    PHASE_CONTACT,
    ROBOT_GRASP,
    EventKind,
    RobotView,
    WorkerEvent,
    WorldView,
)
from .worker_file import NEUTRAL
from .worker_parameters import WorkerParameters

_INSPECTED = "inspected"
_GRASPING_PHASES = (PHASE_APPROACH, PHASE_CONTACT, PHASE_CARRY)


class ManualWorker(Worker):
    """A Worker whose actions come from `command`.

    ready: whether time may pass; somebody must sit down (`begin`) once a task. States follow the
    actions: looking around is no_attention, walking away tired and then recovery, watching a
    grasping robot robot_interfered, a grasp that came to nothing failed_to_grasp, otherwise
    standing is evaluating.
    """

    def __init__(
        self, rng: np.random.Generator, parameters: WorkerParameters | None = None
    ) -> None:
        self._lock = threading.RLock()
        self._commands: list[tuple[Callable[[float, str], None], str]] = []
        self._tray: str | None = None  # where the cube is to go, when that is known
        self._hand = ""  # what it does in a grasp: reaches, holds, returns
        self._leaving = False
        self.ready = False
        super().__init__(NEUTRAL, rng, parameters)

    # -- commands ---------------------------------------------------------------------------------

    def command(self, name: str, container: str = "") -> tuple[bool, str]:
        """Let the person do something from the next step on.

        container: label of the tray for `place` when sorting. Returns whether it is accepted and
        otherwise why not, as a sentence.
        """
        with self._lock:
            reason = self._objection(name, container)
            if not reason and name == "begin":
                self.ready = True
            elif not reason:
                self._commands.append((getattr(self, f"_do_{name}"), container))
            return not reason, reason

    def _objection(self, name: str, container: str) -> str:
        """Why a command makes no sense now, or nothing."""
        if name not in NAMES:
            return f"unknown command '{name}'; there are: {', '.join(NAMES)}"
        if not self._running:
            return "no task is running"
        if name == "begin":
            return "time is running already" if self.ready else ""
        if not self.ready:
            return "press begin first: time stands"
        if self.away != (name == "come_back"):
            return "you are away: come back first" if self.away else "you are not away"
        if self._leaving:
            return "you are on your way out"
        if name == "place":
            return self._objection_to_tray(container)
        if name == "drop":
            return "" if self._hand in ("reaches", "holds") else "there is nothing to drop"
        if self.holding:
            return "your hand is full: place the cube or drop it"
        return self._objection_to_grasp() if name == "grasp" else ""

    def _objection_to_grasp(self) -> str:
        if self.action == "grasp":
            return f"your hand {self._hand} already"
        if self._held_by != HELD_BY_NOBODY:
            return "the robot holds the cube"
        return "" if self._subtask and self._cube else "no cube waits at the pick point"

    def _objection_to_tray(self, container: str) -> str:
        if self._hand not in ("reaches", "holds"):
            return "there is nothing to place: grasp first"
        trays = self.trays
        if container in trays or (not container and len(trays) == 1):
            return ""
        return f"there is no tray '{container}'; there are: {', '.join(trays)}"

    @property
    def trays(self) -> list[str]:
        """Labels of the trays that the person can choose from."""
        return sorted(set(self._rules.values())) if self._sorting else [_INSPECTED]

    # -- the interface of a worker ----------------------------------------------------------------

    def start_task(
        self,
        t: float,
        scenario: str,
        rng: np.random.Generator | None = None,
        rules: Mapping[Any, str] | None = None,
        load: float = 1.0,
        on_call: bool = False,
    ) -> None:
        """Begin a task; as Worker.start_task. Time stands until somebody begins."""
        with self._lock:
            self.ready = self._leaving = False
            self._commands.clear()
            super().start_task(t, scenario, rng, rules, load, on_call)

    def end_subtask(self, t: float, success: bool, by_person: bool) -> None:
        """As Worker.end_subtask; who looks around goes on looking until the last cube."""
        with self._lock:
            distracted = self.action == "look_around"
            super().end_subtask(t, success, by_person)
            if distracted and self._sorting:
                self._do_look_around(t, "")

    def end_task(self, t: float, success: bool) -> None:
        """As Worker.end_task."""
        with self._lock:
            self._commands.clear()
            super().end_task(t, success)

    def step(self, t: float, robot: RobotView, world: WorldView) -> list[WorkerEvent]:
        """Advance to time t (s), do what was commanded, return what the person did."""
        with self._lock:
            for action, container in self._commands:
                action(t, container)
            self._commands.clear()
            return super().step(t, robot, world)

    def truth(self, t: float) -> Truth:
        """Return the state that the actions show; the type is `manual`."""
        return super().truth(t)._replace(human_type="manual")

    # -- what the commands do ---------------------------------------------------------------------

    def _do_idle(self, t: float, _: str) -> None:
        self._set_state(self._standing(), t)
        self._begin(t, "idle")
        self._wait(t)

    def _do_look_around(self, t: float, _: str) -> None:
        self._set_state("no_attention", t)
        self._begin(t, "look_around")
        self._wait(t)

    def _do_grasp(self, t: float, _: str) -> None:
        if self._objection_to_grasp():  # the cube went while the command was on its way
            return
        self._tray = None if self._sorting else _INSPECTED
        self._set_state("failed_to_grasp" if self.counters.failed else "evaluating", t)
        self._begin(t, "grasp")
        self._hand = "reaches"
        self._agenda.add(t + self._timing.reach.draw(self._rng, self._slow), self._pick)

    def _do_place(self, t: float, container: str) -> None:
        carried = self.holding and self._tray is not None  # on its way already
        self._tray = container or self.trays[0]
        if self.holding and not carried:
            self._carry(t)

    def _do_drop(self, t: float, _: str) -> None:
        if self._hand not in ("reaches", "holds"):
            return
        self._release(t)
        self._set_state("failed_to_grasp", t)
        self.counters.failed += 1
        self._begin(t, "idle")
        self._wait(t)

    def _do_warn(self, t: float, _: str) -> None:
        if self._on_call and self._subtask and self._robot != ROBOT_GRASP:
            self._call(t)
            return
        if self._robot_grasping:
            self.refusals += 1
            self.person.annoyed(1.0)
        self._warn(t)

    def _do_walk_away(self, t: float, _: str) -> None:
        self._leaving = True
        self._set_state("tired", t)
        self._begin(t, "walk_away")
        self._agenda.add(t + self._timing.leave.draw(self._rng), self._leave)

    def _do_come_back(self, t: float, _: str) -> None:
        if self.away and not self._agenda:
            back = t + self._timing.come_back.draw(self._rng)
            self._agenda.add(back, lambda now: self._return(now, "evaluating"))

    # -- what comes of them -----------------------------------------------------------------------

    def _standing(self) -> str:
        """State of mind of somebody who stands and watches."""
        watches_robot = self._robot_grasping and self._subtask and not self.holding
        return "robot_interfered" if watches_robot else "evaluating"

    def _begin(self, t: float, action: str) -> None:
        self._hand = ""
        super()._begin(t, action)

    def _wait(self, t: float) -> None:
        """Let a step of standing or looking pass; steps count for the truth."""
        if self._subtask:
            span = self._timing.look_around if self.action == "look_around" else self._timing.idle
            self._agenda.add(t + span.draw(self._rng, self._slow), self._decide)

    def _decide(self, t: float) -> None:
        """Nothing is decided here: go on looking around or watching until a command comes."""
        if self.away:
            return
        if not self._subtask:
            self._stand_by(t)
        elif self.action == "look_around":
            self._do_look_around(t, "")
        else:
            self._do_idle(t, "")

    def _pick(self, t: float) -> None:
        if not self._cube or self._held_by != HELD_BY_NOBODY:
            self._do_idle(t, "")
            return
        self.holding, self._hand = True, "holds"
        self._emit(t, EventKind.PICKED_CUBE, item=self._item)
        if self._tray is not None:
            self._carry(t)

    def _carry(self, t: float) -> None:
        placed = t + self._timing.carry.draw(self._rng, self._slow)
        self._agenda.add(placed, self._place)
        self._agenda.add(placed + self._timing.retreat.draw(self._rng, self._slow), self._decide)

    def _place(self, t: float) -> None:
        super()._place(t)
        self._hand = "returns"

    def _choose_tray(self, right: str) -> str:
        return self._tray or right

    def _rest(self, t: float) -> None:
        """Stay away until told to come back."""
        self._leaving = False
        self._begin(t, "idle")

    def _take_up_work(self, t: float) -> None:
        self._decide(t)

    def _pass_time(self, t: float, state: int, action: int) -> None:
        self._wait(t)

    def _see_robot(self, t: float, robot: RobotView) -> None:
        """See the robot; what to do about it is up to the keys."""
        before = self._robot_grasping
        self._robot, self._phase = robot.current, robot.phase
        self._robot_grasping = robot.current == ROBOT_GRASP and robot.phase in _GRASPING_PHASES
        if self._robot_grasping == before or not self._subtask or self.away:
            return
        if self._robot_grasping and not self.holding:
            self.interferences += 1
        if self.action == "idle" and self.state != "robot_receives_the_warning":
            self._set_state(self._standing(), t)


class ManualStaff:
    """The person at the keys, in every task; as fabric_sim.staff.Staff."""

    def __init__(self, seed: int, parameters: WorkerParameters | None = None) -> None:
        self._worker = ManualWorker(named_generator(seed, "worker", 1), parameters)

    def worker(self, task_number: int) -> ManualWorker:
        """The person, whatever the task."""
        return self._worker
