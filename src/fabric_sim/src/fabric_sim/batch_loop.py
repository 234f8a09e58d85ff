# SPDX-License-Identifier: BSD-3-Clause
"""The whole loop in one process, without ROS: the same classes as the nodes, in the same order.

run = HeadlessRun(RunSetup(scenario="inspection", human="random", policy="reactive", seed=1))
results = [run.run_task() for _ in range(10)]
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

import rospkg
import yaml

import fabric_planner as fp
from fabric_abps import Library, Selector, SelectorParameters, SignalEncoder, TrainedModels
from fabric_msgs.msg import (
    ConveyorState,
    CubeArray,
    Decision,
    HeadState,
    ModelInfo,
    Observation,
    PolicyChoice,
    TaskState,
    TypeBelief,
)
from fabric_perception.observation_agent import ObservationAgent
from fabric_sim import reports
from fabric_sim.batch_decider import AgentDecider, Decider
from fabric_sim.cell import Cell, CellConfig, Moment
from fabric_sim.staff import Staff
from fabric_sim.worker import Worker
from fabric_study.meter import TaskMeter, TrueMoment
from fabric_study.task_manager import Counters, TaskManager
from fabric_study.tasks import load_definition, task_seed

CONVEYOR = {there: ConveyorState(cube_at_pick_point=there) for there in (False, True)}
TICKS_LIMIT = 100_000  # of one task; more means that a rule of the task can no longer be met


@dataclass(frozen=True)
class RunSetup:
    """What defines a run; equal setups give equal results."""

    scenario: str = "inspection"
    human: str = "random"  # as the launch argument human
    policy: str = "proactive"  # as the launch argument policy
    seed: int = 1
    noise: float | None = None  # probability in place of `confusion` in sensing.yaml

    def __post_init__(self) -> None:
        if self.noise is not None and not 0.0 <= self.noise <= 1.0:  # refuses NaN as well
            raise ValueError(f"noise is {self.noise}; it must lie in 0..1")


class People(Protocol):
    """Who works in which task, as fabric_sim.staff.Staff."""

    def worker(self, task_number: int) -> Worker:
        """The worker of a task, numbered from 1."""


@dataclass(frozen=True)
class TaskResult:
    """One finished task."""

    row: dict[str, Any]  # as in results.csv
    decisions: list[Decision]
    codes: list[int]  # type observation codes in order, 0..63


@dataclass
class Files:
    """Where the packages keep their models and numbers."""

    share: Callable[[str], Path] = field(
        default_factory=lambda: lambda package: Path(rospkg.RosPack().get_path(package))
    )

    def cell(self) -> CellConfig:
        """Geometry, limits, arm and sensors."""
        sim = self.share("fabric_sim") / "config"
        return CellConfig.load(
            self.share("fabric_bringup") / "config/cell.yaml",
            self.share("fabric_dobot_driver") / "config/magician.yaml",
            sim / "arm.yaml",
            sim / "sensing.yaml",
        )

    def model(self, policy: str, scenario: str) -> Path:
        """The model file of a policy; a path stands for itself."""
        if policy.endswith((".pomdpx", ".pomdp")):
            return Path(policy)
        models = self.share("fabric_planner") / "models"
        return models / (f"{policy}.pomdpx" if policy == "none" else f"{scenario}_{policy}.pomdpx")

    def agent(self, model: Path) -> fp.DecisionAgent:
        """What decides, set up as the decision node is."""
        path = self.share("fabric_planner") / "config/decision.yaml"
        values = yaml.safe_load(path.read_text(encoding="utf-8"))
        policy = fp.load_policy(values["policy"], fp.load(model)) if values["policy"] else None
        return fp.DecisionAgent(
            str(model),
            fp.PlannerOptions(values["deadline"], values["gap"], values["max_nodes"]),
            map_path=values["observation_map"],
            solver=values["solver"],
            policy=policy,
            fallback=values["fallback_action"],
        )

    def motion(self) -> Path:
        """Places and speeds of the robot's actions."""
        return self.share("fabric_planner") / "config/motion.yaml"

    def selector(self, scenario: str) -> Selector:
        """ABPS over the shipped library with its trained models."""
        package = self.share("fabric_abps")
        config = package / "config"
        library = Library.load(config / "library.yaml", scenario)
        models = TrainedModels.load(package / f"models/{scenario}.npz")
        values = yaml.safe_load((config / "selector.yaml").read_text(encoding="utf-8"))
        return Selector(library, models, SelectorParameters.load(values))


class HeadlessRun:
    """One run: a sequence of tasks with one policy and one person (or a person a task)."""

    def __init__(
        self,
        setup: RunSetup,
        files: Files | None = None,
        staff: People | None = None,
        decider: Decider | None = None,
        every_tick: bool = False,
    ) -> None:
        """staff, decider: in place of what `setup.human` and `setup.policy` say, which then are
        only names in the results. every_tick: go through all ticks, also those in which nothing can
        happen; the results are the same. Raises ValueError naming the word of the setup or the file
        that cannot be used."""
        self.setup = setup
        files = files or Files()
        self._definition = load_definition(setup.scenario)
        self._selector = files.selector(setup.scenario) if setup.policy == "abps" else None
        self._decider = decider or self._default_decider(files)
        self._motion = fp.MotionAgent(str(files.motion()))
        self._observer = ObservationAgent()
        self._staff = staff or Staff(setup.human, setup.seed)
        self._cell = Cell(self._cell_config(files), self._staff.worker(1), setup.seed)
        self._every_tick = every_tick
        self._counters = Counters()
        self._task_number = 0
        self._task_state_sent = 0
        self._robot_sequence = 0

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
        self._task_number += 1
        self._cell.worker = self._staff.worker(self._task_number)
        seed = task_seed(self.setup.seed, self._task_number)
        self._manager = TaskManager(self._definition, self._task_number, seed, self._counters)
        self._encoder, self._codes = SignalEncoder(), []
        self._hidden = self._sight = self._posterior = None
        self._choose(seed)
        self._decider.reset()
        self._manager.begin(self._cell.now)
        self._meter = TaskMeter(self._manager.state, self.setup.human, self.setup.policy)
        self._tell_names()
        self._publish_state()
        last = self._cell.tick + TICKS_LIMIT
        while self._cell.running:
            if not self._every_tick:
                self._cell.skip_to(self._next_tick())
            self._tick(self._cell.advance())
            if self._cell.tick > last:
                raise RuntimeError(f"task {self._task_number} did not end in {TICKS_LIMIT} ticks")
        self._tell_type_belief()
        return TaskResult(self._meter.row(), self._meter.decisions(), self._codes)

    # -- one tick: the order of docs/time.md ------------------------------------------------------

    def _next_tick(self) -> int:
        """The next tick in which anybody can have something to do."""
        tick = self._cell.next_tick()
        if tick == self._cell.tick + 1:
            return tick
        quiet = min(self._observer.quiet_until, self._manager.quiet_until)
        if quiet == math.inf:
            return tick
        return min(tick, max(int(self._cell.percept_tick_of(quiet)), self._cell.tick + 1))

    def _tick(self, moment: Moment) -> None:
        for result in moment.arm_results:
            self._move(self._motion.on_arm_result(result.number, result.outcome, result.reason))
            self._settle()
        if moment.percept is None:
            return
        for report in (self._on_truth, self._on_belt, self._on_containers, self._on_person):
            report(moment)
            if not self._cell.running:
                return

    def _on_truth(self, moment: Moment) -> None:
        hidden = moment.hidden
        if hidden is not self._hidden:
            self._hidden = hidden
            words = (hidden.state, hidden.anticipated_state, hidden.human_type)
            self._meter.on_moment(moment.sequence, TrueMoment(moment.t, *words))

    def _on_belt(self, moment: Moment) -> None:
        stock = self._cell.stock
        conveyor = CONVEYOR[stock.at_pick_point is not None]
        self._move(self._motion.on_conveyor(conveyor.cube_at_pick_point))
        self._score(moment.t, self._manager.on_conveyor(moment.t, conveyor))
        sight = (stock.moved, conveyor.cube_at_pick_point, stock.belt.speed)
        if sight != self._sight:
            self._sight = sight
            self._move(self._motion.on_cubes(CubeArray(cubes=reports.plain_cubes(stock.seen()))))
        self._settle()

    def _on_containers(self, moment: Moment) -> None:
        if moment.containers is not None:
            self._score(moment.t, self._manager.on_containers(moment.t, moment.containers))
            self._settle()

    def _on_person(self, moment: Moment) -> None:
        percept = moment.percept
        if percept.warning:
            self._move(self._motion.on_warning())
            self._score(moment.t, self._manager.on_warning(moment.t))
            self._settle()
        if percept.posterior is not self._posterior:
            self._posterior = percept.posterior
            head = HeadState(
                visible=percept.behaviour.present,
                looking_around=percept.behaviour.present and percept.behaviour.looking_around,
            )
            self._reading = self._observer.read(reports.activity(moment.t, percept), head)
        age = reports.single(percept.evidence_age)
        self._decide(moment.t, self._observer.on_reading(moment.t, self._reading, age))
        self._settle()

    # -- consequences -----------------------------------------------------------------------------

    def _score(self, t: float, events: list[Any]) -> None:
        belt = self._manager.belt_command
        if belt is not None:
            self._cell.set_conveyor(*belt)
        for event in events:
            self._meter.on_event(event)
            if self._selector:
                self._selector.on_task_event(event)
            self._decide(t, self._observer.on_task_event(t, event))

    def _decide(self, t: float, observations: list[Observation]) -> None:
        for observation in observations:
            self._codes.append(self._encoder.encode(observation))
            if self._selector:
                self._selector.observe(observation)
            self._meter.on_observation(observation)
            decision = self._decider.decide(observation, self._cell.worker.truth(t))
            decision.header.stamp = observation.header.stamp
            self._meter.on_decision(decision)
            self._move(
                self._motion.on_decision(decision.action, decision.sequence, decision.task_id)
            )

    def _move(self, commands: list[Any]) -> None:
        for command in commands:
            self._cell.command(command)

    def _settle(self) -> None:
        """What has changed becomes known: the robot's state to the person, the task to all."""
        if self._counters.states != self._task_state_sent:
            self._publish_state()
        state = self._motion.state()
        if state.sequence != self._robot_sequence:
            self._robot_sequence = state.sequence
            self._cell.on_robot_state(state)

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
