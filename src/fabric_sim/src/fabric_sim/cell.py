# SPDX-License-Identifier: BSD-3-Clause
"""The pretend cell: person, belt, arm and sensors advance together, one tick of 0.05 s at a time.

    cell = Cell(config, worker, seed)
    cell.on_task(task_state)                 # SHOWING_RULES starts, the end of the task freezes
    while cell.running:
        for stimulus in cell.step().stimuli():
            if cell.running:
                ...                          # hand the messages to whom they concern

The same object stands behind the ROS node and in the headless runner.
"""

import math
from functools import lru_cache
from typing import Any

from fabric_dobot_driver import Goal
from fabric_msgs.msg import Container, ContainerArray, HumanActivity, RobotActionState, TaskState
from fabric_sim import reports
from fabric_sim.arm import Arm, ArmResult, goal_of
from fabric_sim.belt import check_speed
from fabric_sim.body import BodyMotion
from fabric_sim.cell_config import CellConfig
from fabric_sim.cell_output import CellOutput, Moment, Stimulus, output_of
from fabric_sim.cell_rules import CubeRules
from fabric_sim.character import named_generator
from fabric_sim.commands import Commands
from fabric_sim.geometry import CellGeometry, Point, Tray
from fabric_sim.sensing import Behaviour, ColourSensor, LoadCells, PersonSensor
from fabric_sim.stock import CubeState, Deposit, Place, Stock
from fabric_sim.truth import Truth
from fabric_sim.worker_events import (
    HELD_BY_NOBODY,
    HELD_BY_PERSON,
    HELD_BY_ROBOT,
    EventKind,
    RobotView,
    WorkerEvent,
    WorldView,
)

__all__ = ["TICK", "Cell", "CellConfig", "CellOutput", "Moment", "Stimulus"]

ON_CALL = "on_call"  # policy under which people call the robot
TICK = 0.05  # s
TICKS_A_SECOND = 20
PERCEPT_TICKS = 2  # sensors report at every second tick, 10 Hz
ACTIVITY = {
    "idle": HumanActivity.IDLE,
    "look_around": HumanActivity.IDLE,
    "grasp": HumanActivity.GRASP,
    "warn": HumanActivity.WARN,
    "walk_away": HumanActivity.OTHER,
}
EPISODES = ("grasp", "warn")  # each new one is recognised anew
IN_HAND = WorldView(False, HELD_BY_PERSON)
AT_CUP = WorldView(False, HELD_BY_ROBOT)
WAITING = WorldView(True, HELD_BY_NOBODY)
NOT_THERE = WorldView(False, HELD_BY_NOBODY)
FAR = 1000  # ticks to pass at most when nothing is in sight
TICK_SLACK = 1e-6  # ticks; forgives rounding when a time is counted in ticks
RUNNING = (TaskState.SHOWING_RULES, TaskState.RUNNING)


class Cell:
    """Worker, cubes, belt, arm and sensors. Nothing moves while no task runs.

    tick: number of the present tick. now: its time, s. running: whether a task lets time pass.
    steps: ticks gone through, not skipped. episode: number of the latest grasp or warning.
    """

    def __init__(self, config: CellConfig, worker: Any, seed: int) -> None:
        """worker: as fabric_sim.worker.Worker; may be replaced between tasks."""
        self.worker = worker
        self.arm = Arm(config.arm, config.limits)
        self.stock = Stock(config.geometry, config.arm.floor_time)
        self.body = BodyMotion(config.geometry)
        self.task = TaskState()
        self._config = config
        self._seed = seed
        self.tick = 0
        self.steps = 0
        self.now = 0.0
        self.running = False
        self._stirred = True  # something was said since the last tick, or to the worker in it
        self._viewed = NOT_THERE  # by the person in the last tick
        self._hidden: Truth | None = None  # as in the last report
        self._reported = -1  # changes of the stock
        self._commands: Commands | None = Commands()
        self._robot = RobotView()
        self._truths = 0
        self._container_changes = 0
        self._subtask: int | None = None  # the cube that is the worker's
        self.episode = 0
        self._rules = CubeRules([], [])
        self._new_task("inspection", [])

    # -- what it is told ------------------------------------------------------------------------

    def on_task(self, task: TaskState) -> None:
        """Start a task that shows its rules, note that it runs, end it when it is over."""
        self._stirred = True
        fresh = task.task_id != self.task.task_id
        if self.running and (fresh or task.status not in RUNNING):
            self.worker.end_task(self.now, task.status == TaskState.SUCCEEDED)
        if fresh and task.status in RUNNING:
            self.start_task(task)
        elif not fresh:
            self.task = task
        self.running = self.task.task_id != 0 and self.task.status in RUNNING

    def start_task(self, task: TaskState) -> None:
        """Put out the task's cubes and containers and let the worker begin.

        Raises ValueError for an unknown scenario and for a cube without a rule.
        """
        self.task = task
        self.tick += self.tick % PERCEPT_TICKS  # every task begins in step with the sensors
        self.now = _time_of(self.tick)
        self._rules = CubeRules.of(task)
        self._new_task(task.scenario, list(task.cube_colours))
        rng = named_generator(self._seed, "worker", task.task_id)
        rules, on_call = self._rules.by_item, task.policy == ON_CALL
        self.worker.start_task(self.now, task.scenario, rng, rules, task.load, on_call)

    def command(self, command: Any) -> None:
        """Take a MotionCommand of the motion agent; it acts from the next tick on."""
        kind, number, x, y, z, yaw, speed, settle = command.parts
        if kind == "MOVE":
            self.move(number, _goal_of((x, y, z), yaw, speed, settle))
        elif kind == "CANCEL":
            self.cancel(number)
        elif kind in ("SUCTION_ON", "SUCTION_OFF"):
            self.set_suction(kind == "SUCTION_ON")
        else:
            raise ValueError(f"motion command of unknown kind {kind!r}")

    def move(self, number: int, goal: Goal) -> None:
        """Send the tool somewhere (see arm.goal_of); a refusal comes as a result too."""
        self._orders().moves[number] = goal

    def cancel(self, number: int) -> None:
        """Stop the move of that number."""
        self._orders().cancelled.add(number)

    def home(self) -> None:
        """Drive the arm home."""
        self._orders().home = True

    def set_suction(self, on: bool) -> None:
        """Switch the suction cup."""
        self._orders().suction = on

    def set_conveyor(self, speed: float, ignore_sensor: bool) -> None:
        """Run the belt at `speed` m/s. Raises ValueError for a speed that makes no sense."""
        check_speed(speed)
        self._orders().conveyor = (speed, ignore_sensor)

    def on_robot_state(self, state: RobotActionState) -> None:
        """Let the person see what the robot does."""
        robot = _robot_view(state.current, state.phase)
        self._stirred |= robot != self._robot
        self._robot = robot

    def _orders(self) -> Commands:
        if self._commands is None:
            self._commands = Commands()
        return self._commands

    # -- what it says ---------------------------------------------------------------------------

    @property
    def geometry(self) -> CellGeometry:
        """Where things are."""
        return self._config.geometry

    @property
    def cup(self) -> Point:
        """The suction cup, m in the cell."""
        return self.geometry.arm.to_cell(Point(*self.arm.pose[:3]))

    def step(self) -> CellOutput:
        """Advance by one tick; report as the devices do."""
        moment = self.advance()
        self.body.step(TICK, self.behaviour, self.worker.action == "walk_away", self._hand_target())
        return output_of(self, moment)

    def advance(self) -> Moment:
        """Advance by one tick, for those who need no messages and do not look at the body."""
        self.tick += 1
        self.steps += 1
        self.now = t = _time_of(self.tick)
        self._stirred = False
        moment = Moment(t, self._move_arm(t))
        self.stock.run(t, TICK)
        self._viewed = self._view()
        for event in self.worker.step(t, self._robot, self._viewed):
            self._on_worker_event(t, event)
        for deposit in self.stock.take_deposits():
            self._on_deposit(t, deposit)
        self._assign(t)
        if self.tick % PERCEPT_TICKS == 0:
            self._perceive(t, moment)
        return moment

    # -- ticks in which nothing happens ---------------------------------------------------------

    @property
    def next_report(self) -> int:
        """The next tick in which the sensors report."""
        return self.tick + PERCEPT_TICKS - self.tick % PERCEPT_TICKS

    def next_tick(self) -> int:
        """The next tick in which anything can happen in the cell if nobody tells it anything.

        Rather too early than too late. When anything has changed since the sensors reported, they
        report next.
        """
        soon = self.tick + 1
        if self._stirred or self._commands is not None:
            return soon
        if self.tick % PERCEPT_TICKS and self._worth_a_look():
            return soon
        if self._view() is not self._viewed or (self.arm.suction and not self.stock.held_by_robot):
            return soon
        ends = min(self.worker.next_wakeup, self.now + self.arm.rest, self.stock.tidy_at)
        sensed = min(self._person_sensor.wakeup, self._load_cells.wakeup)
        quiet = self.stock.belt.quiet_steps(TICK)
        tick = soon + (FAR if quiet > FAR else int(quiet))
        if ends < math.inf:
            tick = min(tick, self.tick_of(ends))
        if sensed < math.inf:
            tick = min(tick, self.percept_tick_of(sensed))
        return max(soon, tick)

    def _worth_a_look(self) -> bool:
        """Whether the next report will say anything that the last one did not."""
        if self.stock.changes.count != self._reported or self._contents_changed:
            return True
        if not self._person_sensor.knows(self.behaviour, self.episode):
            return True
        # asked now with the time of the report, because the answer holds from the first question on
        hidden = self.worker.truth(_time_of(self.tick + 1))
        return hidden is not self._hidden and hidden != self._hidden

    def skip_to(self, tick: int) -> None:
        """Let the ticks before `tick` pass, which is not later than `next_tick`."""
        passed = tick - 1 - self.tick
        if passed <= 0:
            return
        self.arm.skip(passed * TICK)
        self.stock.belt.skip(passed, TICK)
        last = (tick - 1) // PERCEPT_TICKS  # report that is left out
        if last > self.tick // PERCEPT_TICKS:
            self._truths += last - self.tick // PERCEPT_TICKS
            self._person_sensor.pass_time(_time_of(last * PERCEPT_TICKS))
        self.tick = tick - 1
        self.now = _time_of(self.tick)

    def pass_to(self, tick: int) -> Moment:
        """Let time pass to `tick`, which is earlier than `next_tick` and one in which the sensors
        report: they say what they said."""
        self.skip_to(tick + 1)
        t = self.now
        return Moment(t, [], self._person_sensor.still(t), self._hidden, self._truths)

    @staticmethod
    def tick_of(t: float) -> int:
        """The first tick not before time t, s."""
        return math.ceil(t * TICKS_A_SECOND - TICK_SLACK)

    @staticmethod
    def percept_tick_of(t: float) -> int:
        """The first tick not before time t, s, in which the sensors report."""
        return PERCEPT_TICKS * math.ceil(t * (TICKS_A_SECOND / PERCEPT_TICKS) - TICK_SLACK)

    # -- one tick -------------------------------------------------------------------------------

    def _new_task(self, scenario: str, colours: list[int]) -> None:
        names = ("colour", "person_sensor", "load_cells")
        rngs = {n: named_generator(self._seed, n, self.task.task_id) for n in names}
        camera = ColourSensor(self._config.sensing, rngs["colour"])
        cubes = [CubeState(i, c, *camera.read(c)) for i, c in enumerate(colours, start=1)]
        self.stock.load(self.geometry.trays(scenario), cubes)
        self._person_sensor = PersonSensor(self._config.sensing, rngs["person_sensor"])
        self._load_cells = LoadCells(self._config.sensing, rngs["load_cells"])
        self._contents: dict[int, list[int]] = {}
        self._contents_changed = True
        self._subtask = None
        if self._commands is not None:
            self._commands.conveyor = None
        self.body.reset()

    def _move_arm(self, t: float) -> list[ArmResult]:
        results = []
        if self._commands is not None:
            commands, self._commands = self._commands, None
            results = commands.apply(self.arm, self.stock.belt)
        results += self.arm.step(TICK)
        held = self.stock.held_by_robot
        if self.arm.suction and not held:
            p = self._config.arm
            self.stock.cup_takes(self.cup, p.suction_lateral, p.suction_vertical)
        elif held and not self.arm.suction:
            self.stock.cup_drops(t, self.cup)
        return results

    def _view(self) -> WorldView:
        """What the person sees. A cube waits for the person only while both hands are free."""
        if self.stock.held_by_person:
            return IN_HAND
        if self.stock.held_by_robot:
            return AT_CUP
        return WAITING if self.stock.belt.at_pick_point is not None else NOT_THERE

    def _on_worker_event(self, t: float, event: WorkerEvent) -> None:
        if event.kind is EventKind.PICKED_CUBE:
            self.stock.person_takes()
        elif event.kind is EventKind.PLACED_CUBE:
            assert event.container is not None
            self.stock.person_places(event.container)
        elif event.kind is EventKind.RELEASED:
            self.stock.person_releases(t)
        elif event.kind is EventKind.STARTED_ACTION and event.action in EPISODES:
            self.episode += 1

    def _on_deposit(self, t: float, deposit: Deposit) -> None:
        cube, tray = deposit
        self._load_cells.put(t, tray.id, tray.owner, cube.id)
        if cube.id == self._subtask:
            self._subtask = None
            self._stirred = True
            by_person = tray.owner == Container.OWNER_PERSON
            self.worker.end_subtask(t, tray.label == self._rules.label(cube.id), by_person)

    def _assign(self, t: float) -> None:
        """Make the cube whose turn it is the worker's, while the task runs.

        A cube put back behind another one loses its turn, but not while the person still argues
        about it with the robot.
        """
        if self.task.status != TaskState.RUNNING:
            return
        cube = self.stock.in_play
        if cube is None or cube.id == self._subtask:
            return
        arguing = self.worker.action == "warn" or cube.place in (Place.PERSON, Place.ROBOT)
        if self._subtask is None or not arguing:
            self._subtask = cube.id
            self._stirred = True
            self.worker.start_subtask(t, self._rules.items[cube.id - 1])

    @property
    def behaviour(self) -> Behaviour:
        """What the person really does."""
        who = self.worker
        return _behaviour_of(who.action, who.looking_around, who.detected)

    def _hand_target(self) -> Tray | None:
        mine = [t for t in self.stock.trays if t.owner == Container.OWNER_PERSON]
        return mine[len(mine) // 2] if self.stock.held_by_person else None

    # -- sensors --------------------------------------------------------------------------------

    def _perceive(self, t: float, moment: Moment) -> None:
        self._truths += 1
        moment.sequence = self._truths
        moment.percept = self._person_sensor.sense(t, self.behaviour, self.episode)
        moment.hidden = self._hidden = self.worker.truth(t)
        self._reported = self.stock.changes.count
        moment.containers = self._read_load_cells(t)

    def _read_load_cells(self, t: float) -> ContainerArray | None:
        if self._load_cells.wakeup < t + TICK:
            for container, cube in self._load_cells.settled(t):
                self._contents.setdefault(container, []).append(cube)
                self._contents_changed = True
        if not self._contents_changed:
            return None
        self._contents_changed = False
        self._container_changes += 1
        return reports.containers(t, self._container_changes, self.stock, self._contents)


_goal_of = lru_cache(1024)(goal_of)  # the places of the cell are few


@lru_cache
def _robot_view(current: int, phase: int) -> RobotView:
    return RobotView(current, phase)


@lru_cache
def _behaviour_of(action: str, looking_around: bool, detected: bool) -> Behaviour:
    return Behaviour(ACTIVITY[action], looking_around, detected)


def _time_of(tick: int) -> float:
    return tick / TICKS_A_SECOND  # the double that is nearest, as round(tick * TICK, 6)
