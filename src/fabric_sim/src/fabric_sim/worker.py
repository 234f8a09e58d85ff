# SPDX-License-Identifier: BSD-3-Clause
"""A simulated worker in seconds: the MDP of Fig. 6.28 run as a semi-Markov process.

The policy chooses an action, T says what comes of it, Table 6.7 how long it takes. The robot's
action and the task's status override the state where thesis section 4.3.2 says so.

    worker = Worker(Character.parse("expert_rested_attentive_collaborative"), rng)
    worker.start_task(t, "inspection", named_generator(seed, "worker"))
    worker.start_subtask(t)                      # a cube is on its way, or at the pick point
    for event in worker.step(t, robot, world):   # every tick
        ...
    worker.end_subtask(t, success=True, by_person=False)
    worker.end_task(t, success=True)
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from mypy_extensions import mypyc_attr

from .character import Character
from .truth import Counters, Truth, anticipated_state
from .worker_agenda import Handler
from .worker_alone import LoneWorker
from .worker_events import (
    HELD_BY_NOBODY,
    PHASE_APPROACH,
    PHASE_CARRY,
    PHASE_CONTACT,
    ROBOT_GRASP,
    ROBOT_NONE,
    ROBOT_PLANNING,
    ROBOT_POINT,
    EventKind,
    RobotView,
    WorkerEvent,
    WorldView,
)
from .worker_model import ACTION_INDEX, STATE_INDEX, ModelSource
from .worker_parameters import SCENARIOS, WorkerParameterError, WorkerParameters, known
from .worker_responses import RuleMemory, origin_of

_PRESENT_PHASES = (PHASE_APPROACH, PHASE_CONTACT, PHASE_CARRY)
#: A state of mind that the next cube on the belt does not wipe out.
_LASTING = ("tired", "no_attention", "recovery")
#: States in which the robot is not answered (any more).
_SETTLED = ("success", "failure", "recovery", "warns_the_robot", "task_assigned_to_robot")


@mypyc_attr(allow_interpreted_subclasses=True)
class Worker(LoneWorker):
    """One person beside a robot; times in s, not decreasing; all chance comes from generators.

    tasks_done: tasks so far. interferences: grasps of the robot that the person noticed and had
    to answer. refusals: those answered by a warning.
    """

    def __init__(
        self,
        character: Character,
        rng: np.random.Generator,
        parameters: WorkerParameters | None = None,
        library: ModelSource | None = None,
    ) -> None:
        super().__init__(character, rng, parameters, library)
        self.tasks_done = 0
        self.interferences = 0
        self.refusals = 0
        self._running = False  # a task
        self._pointings = 0
        self._on_call = False  # the robot comes when it is called
        self._called = False  # it was, for this cube
        self._origin: str | None = None  # overrides where the person was interrupted
        self._forget_robot()

    def _forget_robot(self) -> None:
        self._robot, self._phase, self._robot_grasping = ROBOT_NONE, 0, False
        self._cube, self._held_by = False, HELD_BY_NOBODY

    # -- what the task tells ------------------------------------------------------------------

    def start_task(
        self,
        t: float,
        scenario: str,
        rng: np.random.Generator | None = None,
        rules: Mapping[Any, str] | None = None,
        load: float = 1.0,
        on_call: bool = False,
    ) -> None:
        """Begin a task at its place of work.

        rng: generator of this task, so that a task replays without the ones before it.
        rules: label of the right tray by item to remember; needed for sorting. load: how hard they
        are to remember, relative to task type 4. on_call: the robot comes when it is called.
        Raises WorkerParameterError for an unknown scenario or sorting without rules.
        """
        known(scenario, SCENARIOS, "scenario")
        if scenario == "sorting" and not rules:
            raise WorkerParameterError("scenario sorting needs rules: tray label by item")
        self._rng = rng if rng is not None else self._rng
        if self.away:
            self.person.rested()
        self._rules = dict(rules or {})
        self._memory = RuleMemory(self._rules, self.person.now, self._p.memory, load)
        self._prepare(scenario)
        self._forget_robot()
        self.counters = Counters()
        self._on_call, self._called = on_call, False
        self._running, self._subtask, self.away, self.holding = True, False, False, False
        self._agenda.drop_notice()
        self._set_state("task_assigned", t)
        self._stand_by(t)

    def start_subtask(self, t: float, item: Any = None) -> None:
        """The next cube, which falls under this item of the rules, is the person's; work begins
        when it is at the pick point."""
        self._subtask = True
        self._item = item
        self._called = False
        self._pointings = 0
        self._truth = None
        self.counters.begin_again()
        if self.state not in _LASTING and not self.holding:
            self._set_state("task_assigned", t)
        if not self._agenda:
            self._agenda.add(t, self._decide)

    def end_subtask(self, t: float, success: bool, by_person: bool) -> None:
        """The task's status says that the cube is dealt with; only this ends a subtask."""
        if not self._subtask:
            return
        self._subtask = False
        self._release(t)
        self._agenda.drop_notice()
        self.person.worked(self._scenario, by_person)
        if not by_person:
            self._judge_help(success)
        if success:
            self._memory.saw(self._item, by_person)
        self._truth = None
        if self.state == "recovery" or self.action == "walk_away":
            return
        self._set_state(self._state_after(success, by_person), t)
        if not (by_person and self._agenda):  # else the hands still return from the tray
            self._stand_by(t)

    def _state_after(self, success: bool, by_person: bool) -> str:
        """State between two cubes; an inspection is over with its only package."""
        if not self._sorting:
            return "success" if success else "failure"
        return "failed_to_grasp" if by_person and not success else "task_assigned"

    def _judge_help(self, success: bool) -> None:
        """Good help restores trust; a cube taken against a warning costs some more."""
        if self.state == "robot_interfered" and success:
            self.person.helped_well()
        elif self.state in ("warns_the_robot", "robot_receives_the_warning"):
            self.person.annoyed(1.0)

    def end_task(self, t: float, success: bool) -> None:
        """Count the task and stand by until the next one."""
        self._release(t)
        self.tasks_done += self._running
        self._running = self._subtask = False
        self._agenda.drop_notice()
        if not self.away:
            self._set_state("success" if success else "failure", t)
            self._stand_by(t)

    # -- what can be read -----------------------------------------------------------------------

    @property
    def activity(self) -> str:
        """What an ideal camera would recognise: idle, grasp, look_around, walk_away or warn."""
        return self.action

    @property
    def detected(self) -> bool:
        """Whether the person is at the place of work."""
        return not self.away

    @property
    def next_wakeup(self) -> float:
        """Time in s until which nothing happens unless the robot or the cube changes."""
        return self._agenda.until

    def acceptance(self, t: float) -> float:
        """Return the probability that help would be accepted at this moment."""
        if self.away:
            return 1.0
        return 1.0 - self._refusal(t)

    def _refusal(self, t: float) -> float:
        origin = self._origin or origin_of(self.state, self.action, self.counters.failed)
        since = t if self._distracted_since is None else self._distracted_since
        return self.person.refusal(origin, t - since, self._scenario)

    def truth(self, t: float) -> Truth:
        """Return the hidden state and its name in the robot's models."""
        if self._truth is None:
            word = anticipated_state(
                self.state,
                self.action,
                self.counters,
                lambda: self.acceptance(t),
                self._sorting,
                self._p.truth,
            )
            self._truth = Truth(
                self.person.character.name,
                self.state,
                self.action,
                word,
                *self.person.now.dials,
                self.refusals,
                self.tasks_done,
            )
        return self._truth

    # -- running --------------------------------------------------------------------------------

    def step(self, t: float, robot: RobotView, world: WorldView) -> list[WorkerEvent]:
        """Advance to time t (s) and return what the person did since the last step."""
        if (
            t < self._agenda.until
            and robot.current == self._robot
            and robot.phase == self._phase
            and world.cube_at_pick_point == self._cube
            and world.held_by == self._held_by
            and not self._events
        ):
            return []
        self._see_cube(t, world)
        self._see_robot(t, robot)
        self._agenda.run(t)
        self._truth = None
        events, self._events = self._events, []
        return events

    def _see_cube(self, t: float, world: WorldView) -> None:
        came = world.cube_at_pick_point and not self._cube
        self._cube, self._held_by = world.cube_at_pick_point, world.held_by
        if came and self._subtask and not self._agenda and self.state not in _SETTLED:
            self._agenda.add(t, self._decide)

    def _see_robot(self, t: float, robot: RobotView) -> None:
        changed = robot.current != self._robot
        self._robot, self._phase = robot.current, robot.phase
        grasping = robot.current == ROBOT_GRASP and robot.phase in _PRESENT_PHASES
        if grasping != self._robot_grasping:
            self._robot_grasping = grasping
            (self._robot_comes if grasping else self._robot_stops)(t)
        elif changed and robot.current == ROBOT_PLANNING:
            self._watch_for(t, self._notice_planning)
        elif changed and robot.current == ROBOT_POINT:
            self._watch_for(t, self._notice_pointing)

    def _watch_for(self, t: float, notice: Handler) -> None:
        """Let the person notice the robot after a reaction time, if somebody is there to notice."""
        if not self._subtask or self.away or self.state in _SETTLED or self.action == "walk_away":
            return
        span = self._timing.late_reaction if self.looking_around else self._timing.reaction
        self._agenda.notice(t + span.draw(self._rng), notice)

    # -- answers to the robot (section 4.3.2) ----------------------------------------------------

    def _take_up_work(self, t: float) -> None:
        """Back from a break; the robot may be at work meanwhile, which is welcome."""
        if self._robot_grasping and self._subtask:
            self._origin = "recovery"
            self._watch_for(t, self._notice_grasp)
        else:
            self._decide(t)

    def _robot_comes(self, t: float) -> None:
        if self.holding:
            self.person.annoyed(self._p.history.near_miss)
        else:
            self._watch_for(t, self._notice_grasp)

    def _robot_stops(self, t: float) -> None:
        self._agenda.drop_notice()
        if self.state == "robot_interfered" or self._origin:
            self._origin = None
            self._agenda.clear()
            self._agenda.add(t + self._timing.settle.draw(self._rng), self._after_help)

    def _after_help(self, t: float) -> None:
        if not self._robot_grasping:
            self._arrive(t, "evaluating")

    def _notice_grasp(self, t: float) -> None:
        """The robot takes over: refuse or accept, depending on where the person was interrupted."""
        if self.action == "walk_away" or self.state == "robot_interfered":
            return
        refused = not self._called and self._rng.random() < self._refusal(t)
        self._origin = None
        self.interferences += 1
        self._set_state("robot_interfered", t)
        if refused:
            self.refusals += 1
            self.person.annoyed(1.0)
            self._warn(t)
        else:
            self._stand_by(t)

    def _warn(self, t: float) -> None:
        self._set_state("warns_the_robot", t)
        self._begin(t, "warn")
        self._emit(t, EventKind.WARNED)
        self._agenda.add(t + self._timing.warn.draw(self._rng), self._warned)

    def _warned(self, t: float) -> None:
        """Warn again while the robot goes on; else it received the warning."""
        if self._robot_grasping:
            self._warn(t)
            return
        self._set_state("robot_receives_the_warning", t)
        self.counters.begin_again()
        self._begin(t, "idle")
        self._pass_time(t, STATE_INDEX[self.state], ACTION_INDEX["idle"])

    # -- asking for help (on call) ----------------------------------------------------------------

    def _decide(self, t: float) -> None:
        """Call the robot where that is wanted, else go on by the policy."""
        if self._on_call and self._wants_help(t):
            self._call(t)
        else:
            super()._decide(t)

    def _wants_help(self, t: float) -> bool:
        """Whether help is needed with the cube at the pick point, and welcome.

        It is needed by who would accept it by the rule of truth.py, and by who does not remember
        where the cube belongs; it is welcome with the probability that it would be accepted.
        """
        if self._called or not self._subtask or not self._cube or self._held_by != HELD_BY_NOBODY:
            return False
        if self._robot == ROBOT_GRASP or self.away:
            return False
        needed = self.truth(t).anticipated_state == "needs_help"
        if not needed and self._sorting:
            needed = self._rng.random() >= self._memory.knows(self._item)
        return needed and self._rng.random() < self.acceptance(t)

    def _call(self, t: float) -> None:
        self._called = True
        self._begin(t, "warn")
        self._emit(t, EventKind.CALLED)
        self._agenda.add(t + self._timing.warn.draw(self._rng), self._wait_for_robot)

    def _wait_for_robot(self, t: float) -> None:
        self._begin(t, "idle")
        self._agenda.add(t + self._timing.idle.draw(self._rng), self._end_waiting)

    def _end_waiting(self, t: float) -> None:
        """A robot that is not on its way was called in vain."""
        self._called = self._robot == ROBOT_GRASP
        if self._called:
            self._wait_for_robot(t)
        else:
            self._decide(t)

    def _notice_pointing(self, t: float) -> None:
        """Pointing calls the attention back; repeated at somebody who works it annoys."""
        self._pointings += 1
        p = self._p.responses
        working = self.action == "grasp" or self.state == "evaluating"
        if working and self._pointings >= p.pointing_annoys_from:
            self.person.annoyed(self._p.history.repeated_gesture)
        if self.action != "grasp" and self._rng.random() < p.pointing.get(self.state, 0.0):
            self._arrive(t, "evaluating")

    def _notice_planning(self, t: float) -> None:
        """A robot near the cube is harmless mostly: it wakes some, spurs some, annoys a few."""
        p = self._p.responses
        chance = self._rng.random()
        if self.state == "no_attention":
            if chance < p.planning_wakes:
                self._arrive(t, "evaluating")
        elif self.state == "evaluating" and not self.holding:
            if chance < p.planning_warned * self.person.now.influence("reluctance"):
                self.person.annoyed(self._p.history.repeated_gesture)
                self._warn(t)
            elif self.action != "grasp" and chance > 1.0 - p.planning_spurs * self._refusal(t):
                self._decide(t)
