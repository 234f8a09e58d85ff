# SPDX-License-Identifier: BSD-3-Clause
"""The whole loop in one process, without ROS: the same classes as the nodes, in the same order.

run = HeadlessRun(RunSetup(scenario="inspection", human="random", policy="reactive", seed=1))
results = [run.run_task() for _ in range(10)]
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple, Protocol

from mypy_extensions import mypyc_attr

import fabric_planner as fp
from fabric_abps import Selector, SignalEncoder
from fabric_msgs.msg import (
    ConveyorState,
    Decision,
    ModelInfo,
    Observation,
    PolicyChoice,
    TaskEvent,
    TaskState,
    TypeBelief,
)
from fabric_perception.observation_agent import ObservationAgent
from fabric_sim import reports
from fabric_sim.batch_decider import AgentDecider, Decider
from fabric_sim.batch_files import Files
from fabric_sim.cell import Cell, CellConfig, Moment
from fabric_sim.sensing import Percept
from fabric_sim.staff import Staff
from fabric_sim.truth import Truth
from fabric_sim.worker import Worker
from fabric_study.event_rows import LogRow
from fabric_study.meter import TaskMeter, TrueMoment
from fabric_study.task_manager import Counters, TaskManager
from fabric_study.tasks import task_seed

__all__ = ["Files", "HeadlessRun", "RunSetup", "TaskResult"]

CONVEYOR = {there: ConveyorState(cube_at_pick_point=there) for there in (False, True)}
FAR_AWAY = 2**62  # a tick that does not come
TICKS_LIMIT = 100_000  # of one task; more means that a rule of the task can no longer be met


@mypyc_attr(native_class=False)  # travels between processes
@dataclass(frozen=True)
class RunSetup:
    """What defines a run; equal setups give equal results."""

    scenario: str = "inspection"
    human: str = "random"  # as the launch argument human
    policy: str = "proactive"  # as the launch argument policy
    seed: int = 1
    noise: float | None = None  # probability in place of `confusion` in sensing.yaml
    selector: str = ""  # file of ABPS' parameters, in place of selector.yaml
    library: str = ""  # folder of ABPS' library, in place of the shipped one
    task: str = ""  # definition by name or file, of this scenario; empty: the one named like it

    def __post_init__(self) -> None:
        if self.noise is not None and not 0.0 <= self.noise <= 1.0:  # refuses NaN as well
            raise ValueError(f"noise is {self.noise}; it must lie in 0..1")


class People(Protocol):
    """Who works in which task, as fabric_sim.staff.Staff."""

    def worker(self, task_number: int) -> Worker:
        """The worker of a task, numbered from 1."""


class SeenCube(NamedTuple):
    """A cube as the motion agent sees it, in the fields of fabric_msgs/Cube."""

    colour: int
    where: int
    confidence: float
    id: int


@lru_cache
def _seen_cube(perceived: int, where: int, confidence: float, id: int) -> SeenCube:
    return SeenCube(perceived, where, reports.single(confidence), id)


class SeenCubes(NamedTuple):
    """As fabric_msgs/CubeArray."""

    cubes: list[SeenCube]


class SeenPerson(NamedTuple):
    """The person as recognised, in the fields of HumanActivity and HeadState."""

    posterior: list[float]
    detected: bool
    evidence_age: float  # s
    visible: bool
    looking_around: bool

    @classmethod
    def of(cls, percept: Percept) -> SeenPerson:
        """The person of a percept, in the precision of the messages."""
        posterior = [reports.single(p) for p in percept.posterior]
        age, seen = reports.single(percept.evidence_age), percept.behaviour
        looking = seen.present and seen.looking_around
        return cls(posterior, seen.present, age, seen.present, looking)


@mypyc_attr(native_class=False)  # travels between processes
@dataclass(frozen=True)
class TaskResult:
    """One finished task."""

    row: dict[str, Any]  # as in results.csv
    decisions: list[Decision]
    codes: list[int]  # type observation codes in order, 0..63


@mypyc_attr(allow_interpreted_subclasses=True)
class HeadlessRun:
    """One run: a sequence of tasks with one policy and one person (or a person a task)."""

    def __init__(
        self,
        setup: RunSetup,
        files: Files | None = None,
        staff: People | None = None,
        decider: Decider | None = None,
        every_tick: bool = False,
        selector: Selector | None = None,
    ) -> None:
        """staff, decider: in place of what `setup.human` and `setup.policy` say, which then are
        only names in the results. selector: chooses the policies, in place of the shipped one that
        policy abps has. every_tick: go through all ticks, also those in which nothing can
        happen; the results are the same. Raises ValueError naming the word of the setup or the file
        that cannot be used."""
        self.setup = setup
        files = files or Files()
        self._definition = files.definition(setup.scenario, setup.task)
        self._selector = selector
        if setup.policy == "abps" and selector is None:
            self._selector = files.selector(setup.scenario, setup.selector, setup.library)
        self._decider = decider or self._default_decider(files)
        self._motion = fp.MotionAgent(files.motion())
        self._observer = ObservationAgent()
        self._staff = staff or Staff(setup.human, setup.seed)
        self._cell = Cell(self._cell_config(files), self._staff.worker(1), setup.seed)
        self._every_tick = every_tick
        self._counters = Counters()
        self._task_number = 0
        self._task_state_sent = 0
        self._robot_sequence = 0
        self._robot_told = False  # since its state was looked at
        self._codes: list[int] = []
        self._chooser: AgentDecider | None = None  # decides while decisions are not kept
        self._hidden: Truth | None = None
        self._words: tuple[str, str, str] | None = None  # of the truth that the meter knows
        self._sight = -1
        self._posterior: tuple[float, ...] | None = None

    def _default_decider(self, files: Files) -> Decider:
        first = "proactive" if self._selector else self.setup.policy
        return AgentDecider(files.agent(files.model(first, self.setup.scenario)))

    def _cell_config(self, files: Files) -> CellConfig:
        config = files.cell()
        if self.setup.noise is None:
            return config
        return replace(config, sensing=replace(config.sensing, confusion=self.setup.noise))

    def run_task(self) -> TaskResult:
        """Run the next task to its end."""
        self._chooser = None
        self._play()
        return TaskResult(self._meter.row(), self._meter.decisions(), self._codes)

    def score_task(self) -> tuple[float, list[int]]:
        """Run the next task to its end as `run_task` does, for its discounted reward and the type
        observation codes alone: decisions of the planner's agent are not kept.
        """
        self._chooser = None
        if type(self._decider) is AgentDecider:  # others may do more than choose
            self._chooser = self._decider
        self._play()
        return self._meter.discounted_reward(), self._codes

    def _play(self) -> None:
        self._task_number += 1
        self._cell.worker = self._staff.worker(self._task_number)
        seed = task_seed(self.setup.seed, self._task_number)
        self._manager = TaskManager(
            self._definition, self._task_number, seed, self._counters, self.setup.policy
        )
        self._encoder, self._codes = SignalEncoder(), []
        self._hidden, self._sight, self._posterior = None, -1, None  # what was told last
        self._words = None
        self._belt_due = self._person_due = 0  # ticks in which they have to be told again
        self._choose(seed)
        self._decider.reset()
        self._manager.begin(self._cell.now)
        self._meter = TaskMeter(self._manager.state, self.setup.human, self.setup.policy)
        self._tell_names()
        self._publish_state()
        self._run_to_the_end()
        self._tell_type_belief()

    def event_log(self) -> list[LogRow]:
        """Everything that happened in the last task, as the lines of events.csv."""
        return self._meter.log()

    # -- ticks: the order of docs/time.md ---------------------------------------------------------

    def _run_to_the_end(self) -> None:
        cell, last = self._cell, self._cell.tick + TICKS_LIMIT
        while cell.running:
            self._tick(self._next_moment())
            if cell.tick > last:
                raise RuntimeError(f"task {self._task_number} did not end in {TICKS_LIMIT} ticks")

    def _next_moment(self) -> Moment:
        """The next moment in which anybody has something to do."""
        cell = self._cell
        if self._every_tick:
            self._belt_due = self._person_due = 0
            return cell.advance()
        tick, due = cell.next_tick(), min(self._belt_due, self._person_due)
        if cell.tick < due < tick:
            return cell.pass_to(due)
        cell.skip_to(min(tick, due))
        return cell.advance()

    def _tick(self, moment: Moment) -> None:
        """Tell everybody what is new to them or what they wait for."""
        for result in moment.arm_results:
            self._move(self._motion.on_arm_result(result.number, result.outcome, result.reason))
            self._settle()
        if moment.percept is None:
            return
        if moment.hidden is not self._hidden:
            self._on_truth(moment)
        if self._cell.stock.changes.count != self._sight or self._cell.tick >= self._belt_due:
            self._on_belt(moment)
        if moment.containers is not None:
            self._on_containers(moment)
        news = moment.percept.posterior is not self._posterior
        if news or self._cell.tick >= self._person_due:
            self._on_person(moment)

    def _on_truth(self, moment: Moment) -> None:
        hidden = self._hidden = moment.hidden
        assert hidden is not None
        words = (hidden.state, hidden.anticipated_state, hidden.human_type)
        if words != self._words:
            self._words = words
            self._meter.on_moment(moment.sequence, TrueMoment(moment.t, *words))

    def _on_belt(self, moment: Moment) -> None:
        """Belt and cubes as they are now."""
        stock, seen_before = self._cell.stock, self._sight
        self._sight = stock.changes.count
        self._belt_due = FAR_AWAY
        conveyor = CONVEYOR[stock.belt.at_pick_point is not None]
        self._move(self._motion.on_conveyor(conveyor.cube_at_pick_point), False)
        self._score(moment.t, self._manager.on_conveyor(moment.t, conveyor))
        if self._sight != seen_before or self._every_tick:
            seen = stock.seen()
            cubes = SeenCubes([_seen_cube(c.perceived, w, c.confidence, c.id) for c, w in seen])
            self._move(self._motion.on_cubes(cubes), False)
        self._settle()
        self._belt_due = min(self._belt_due, self._due(self._manager.quiet_until))

    def _on_containers(self, moment: Moment) -> None:
        if self._cell.running:
            self._score(moment.t, self._manager.on_containers(moment.t, moment.containers))
            self._settle()
            self._belt_due = min(self._belt_due, self._due(self._manager.quiet_until))

    def _on_person(self, moment: Moment) -> None:
        percept = moment.percept
        assert percept is not None
        if percept.warning and self._cell.running:
            self._move(self._motion.on_warning())
            self._score(moment.t, self._manager.on_warning(moment.t))
            self._settle()
        if not self._cell.running:
            return
        if percept.posterior is not self._posterior:
            self._posterior = percept.posterior
            person = SeenPerson.of(percept)
            self._reading = self._observer.read(person, person)
        age = reports.single(percept.evidence_age) if percept.evidence_age else 0.0
        self._decide(moment.t, self._observer.on_reading(moment.t, self._reading, age))
        self._settle()
        self._person_due = self._due(self._observer.quiet_until)

    def _due(self, t: float) -> int:
        """The report of the sensors, of those to come, that is the first not before time t, s."""
        soon = self._cell.next_report
        return FAR_AWAY if t == math.inf else max(soon, self._cell.percept_tick_of(t))

    # -- consequences -----------------------------------------------------------------------------

    def _score(self, t: float, events: list[TaskEvent]) -> None:
        belt = self._manager.belt_command
        if belt is not None:
            self._cell.set_conveyor(*belt)
        for event in events:
            self._meter.on_event(event)
            if self._selector:
                self._selector.on_task_event(event)
            self._belt_due = min(self._belt_due, self._cell.next_report)
            self._person_due = 0
            self._decide(t, self._observer.on_task_event(t, event))

    def _decide(self, t: float, observations: list[Observation]) -> None:
        for observation in observations:
            self._codes.append(self._encoder.encode(observation))
            if self._selector:
                self._selector.observe(observation)
            self._meter.on_observation(observation)
            action = self._action_on(observation, self._cell.worker.truth(t))
            self._move(self._motion.on_decision(action, observation.sequence, observation.task_id))
            if self._selector:
                self._reconsider()

    def _action_on(self, observation: Observation, truth: Truth) -> int:
        if self._chooser is not None:
            return self._chooser.choose(observation)
        decision = self._decider.decide(observation, truth)
        decision.header.stamp = observation.header.stamp
        self._meter.on_decision(decision)
        return decision.action

    def _move(self, commands: list[fp.MotionCommand], again: bool = True) -> None:
        """Carry out what the motion agent wants, now that it was told something.

        again: it may now answer otherwise to an empty pick point; that a cube is there it only
        takes note of.
        """
        self._robot_told = True
        for command in commands:
            self._cell.command(command)
        if (again or commands) and self._cell.stock.belt.at_pick_point is None:
            self._belt_due = min(self._belt_due, self._cell.next_report)

    def _settle(self) -> None:
        """What has changed becomes known: the robot's state to the person, the task to all."""
        if self._counters.states != self._task_state_sent:
            self._publish_state()
        if not self._robot_told:
            return
        self._robot_told = False
        sequence = self._motion.state_sequence
        if sequence != self._robot_sequence:
            self._robot_sequence = sequence
            self._cell.on_robot_state(self._motion.state())

    def _publish_state(self) -> None:
        state = self._manager.state
        self._task_state_sent = state.sequence
        self._meter.on_state(state)
        self._move(self._motion.on_task(state))
        if state.status in (TaskState.SHOWING_RULES, TaskState.RUNNING):
            self._observer.start_task(self._cell.now, state)
        self._cell.on_task(state)

    # -- the policy of a task ---------------------------------------------------------------------

    def _choose(self, seed: int) -> None:
        if self._selector is None:
            return
        choice = self._selector.select(self._task_number, seed)
        self._decider.set_model(str(choice.path), False)
        self._choice = choice

    def _reconsider(self) -> None:
        """Inside a task: what is believed of the person's state goes over to the next policy."""
        assert self._selector is not None
        choice = self._selector.reconsider()
        if choice is not None:
            self._decider.set_model(str(choice.path), True)
            self._choice = choice
            self._tell_names()

    def _tell_names(self) -> None:
        states = self._decider.model.states
        self._meter.on_model(ModelInfo(hash=self._decider.model_hash, states=states))
        if self._selector is not None:
            choice = PolicyChoice(task_id=self._task_number, policy=self._choice.policy)
            self._meter.on_policy(choice)

    def _tell_type_belief(self) -> None:
        if self._selector is not None:
            entropy = self._selector.belief.entropy
            self._meter.on_type_belief(TypeBelief(task_id=self._task_number, entropy=entropy))
