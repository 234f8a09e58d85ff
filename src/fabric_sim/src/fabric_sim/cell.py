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

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from std_msgs.msg import Header

from fabric_dobot_driver import Goal, Limits, load_limits
from fabric_msgs.msg import (
    Container,
    ContainerArray,
    ConveyorState,
    Cube,
    CubeArray,
    GroundTruth,
    HeadState,
    HumanActivity,
    RobotActionState,
    TaskState,
)
from fabric_sim import reports
from fabric_sim.arm import Arm, ArmParameters, ArmResult, goal_of, load_arm
from fabric_sim.belt import check_speed
from fabric_sim.body import BodyMotion
from fabric_sim.character import named_generator
from fabric_sim.commands import Commands
from fabric_sim.geometry import CellGeometry, Point, Tray, load_geometry
from fabric_sim.sensing import (
    Behaviour,
    ColourSensor,
    DirectParameters,
    LoadCells,
    Percept,
    PersonSensor,
    load_sensing,
)
from fabric_sim.stock import CubeState, Deposit, Place, Stock
from fabric_sim.worker_events import (
    HELD_BY_NOBODY,
    HELD_BY_PERSON,
    HELD_BY_ROBOT,
    EventKind,
    RobotView,
    WorkerEvent,
    WorldView,
)

TICK = 0.05  # s
PERCEPT_TICKS = 2  # sensors report at every second tick, 10 Hz
ACTIVITY = {
    "idle": HumanActivity.IDLE,
    "look_around": HumanActivity.IDLE,
    "grasp": HumanActivity.GRASP,
    "warn": HumanActivity.WARN,
    "walk_away": HumanActivity.OTHER,
}
EPISODES = ("grasp", "warn")  # each new one is recognised anew
RUNNING = (TaskState.SHOWING_RULES, TaskState.RUNNING)


@dataclass(frozen=True)
class CellConfig:
    """Everything of the cell that is a number in a file."""

    geometry: CellGeometry
    arm: ArmParameters
    limits: Limits
    sensing: DirectParameters

    @classmethod
    def load(cls, cell: Path, limits: Path, arm: Path, sensing: Path) -> "CellConfig":
        """Read launch/config/cell.yaml, the Dobot's magician.yaml, and this package's arm.yaml and
        sensing.yaml. Raises ValueError naming the file, the entry and its value."""
        return cls(load_geometry(cell), load_arm(arm), load_limits(limits), load_sensing(sensing))


class Stimulus(NamedTuple):
    """Messages that reach the graph together: pairs of topic and message."""

    messages: tuple[tuple[str, Any], ...]


@dataclass
class CellOutput:
    """What a tick brought; None or empty where it brought nothing."""

    t: float  # s
    truth: GroundTruth | None = None
    arm_results: list[ArmResult] = field(default_factory=list)
    conveyor: ConveyorState | None = None
    cubes: CubeArray | None = None
    containers: ContainerArray | None = None
    warning: Header | None = None
    activity: HumanActivity | None = None
    head: HeadState | None = None

    def stimuli(self) -> list[Stimulus]:
        """The messages in the order of docs/time.md, together what is handed on together."""
        groups = (
            [("truth", self.truth)],
            [("arm/move/result", result) for result in self.arm_results],
            [("conveyor/state", self.conveyor), ("cell/cubes", self.cubes)],
            [("cell/containers", self.containers)],
            [("human/warning", self.warning)],
            [("human/activity", self.activity), ("human/head", self.head)],
        )
        filled = [tuple(pair for pair in group if pair[1] is not None) for group in groups]
        return [Stimulus(messages) for messages in filled if messages]


class Cell:
    """Worker, cubes, belt, arm and sensors. Nothing moves while no task runs."""

    def __init__(self, config: CellConfig, worker: Any, seed: int) -> None:
        """worker: as fabric_sim.worker.Worker; may be replaced between tasks."""
        self.worker = worker
        self.arm = Arm(config.arm, config.limits)
        self.stock = Stock(config.geometry, config.arm.floor_time)
        self.body = BodyMotion(config.geometry)
        self.task = TaskState()
        self._config = config
        self._seed = seed
        self._tick = 0
        self._commands = Commands()
        self._robot = RobotView()
        self._truths = 0
        self._container_changes = 0
        self._subtask: int | None = None  # the cube that is the worker's
        self._episode = 0
        self._new_task("inspection", [])

    # -- what it is told ------------------------------------------------------------------------

    def on_task(self, task: TaskState) -> None:
        """Start a task that shows its rules, note that it runs, end it when it is over."""
        fresh = task.task_id != self.task.task_id
        if self.running and (fresh or task.status not in RUNNING):
            self.worker.end_task(self.now, task.status == TaskState.SUCCEEDED)
        if fresh and task.status in RUNNING:
            self.start_task(task)
        elif not fresh:
            self.task = task

    def start_task(self, task: TaskState) -> None:
        """Put out the task's cubes and containers and let the worker begin.

        Raises ValueError for an unknown scenario.
        """
        self.task = task
        self._tick += self._tick % PERCEPT_TICKS  # every task begins in step with the sensors
        self._new_task(task.scenario, list(task.cube_colours))
        rules = {rule.colour: rule.label for rule in task.rules}
        rng = named_generator(self._seed, "worker", task.task_id)
        self.worker.start_task(self.now, task.scenario, rng, rules)

    def command(self, command: Any) -> None:
        """Take a MotionCommand of the motion agent; it acts from the next tick on."""
        kind = getattr(command.kind, "name", command.kind)
        if kind == "MOVE":
            place = (command.x, command.y, command.z)
            self.move(command.number, goal_of(place, command.yaw, command.speed, command.settle))
        elif kind == "CANCEL":
            self.cancel(command.number)
        elif kind in ("SUCTION_ON", "SUCTION_OFF"):
            self.set_suction(kind == "SUCTION_ON")
        else:
            raise ValueError(f"motion command of unknown kind {kind!r}")

    def move(self, number: int, goal: Goal) -> None:
        """Send the tool somewhere (see arm.goal_of); a refusal comes as a result too."""
        self._commands.moves[number] = goal

    def cancel(self, number: int) -> None:
        """Stop the move of that number."""
        self._commands.cancelled.add(number)

    def home(self) -> None:
        """Drive the arm home."""
        self._commands.home = True

    def set_suction(self, on: bool) -> None:
        """Switch the suction cup."""
        self._commands.suction = on

    def set_conveyor(self, speed: float, ignore_sensor: bool) -> None:
        """Run the belt at `speed` m/s. Raises ValueError for a speed that makes no sense."""
        check_speed(speed)
        self._commands.conveyor = (speed, ignore_sensor)

    def on_robot_state(self, state: RobotActionState) -> None:
        """Let the person see what the robot does."""
        self._robot = RobotView(state.current, state.phase)

    # -- what it says ---------------------------------------------------------------------------

    @property
    def geometry(self) -> CellGeometry:
        """Where things are."""
        return self._config.geometry

    @property
    def now(self) -> float:
        """Simulated time, s."""
        return round(self._tick * TICK, 6)

    @property
    def running(self) -> bool:
        """True while a task lets time pass."""
        return self.task.task_id != 0 and self.task.status in RUNNING

    @property
    def cup(self) -> Point:
        """The suction cup, m in the cell."""
        return self.geometry.arm.to_cell(Point(*self.arm.pose[:3]))

    def step(self) -> CellOutput:
        """Advance by one tick."""
        self._tick += 1
        t = self.now
        output = CellOutput(t)
        output.arm_results = self._move_arm(t)
        self.stock.run(t, TICK)
        self._step_worker(t)
        for deposit in self.stock.take_deposits():
            self._on_deposit(t, deposit)
        self._assign(t)
        if self._tick % PERCEPT_TICKS == 0:
            self._perceive(t, output)
        return output

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
        self._commands.conveyor = None
        self.body.reset()

    def _move_arm(self, t: float) -> list[ArmResult]:
        commands, self._commands = self._commands, Commands()
        results = commands.apply(self.arm, self.stock.belt)
        results += self.arm.step(TICK)
        if self.arm.suction:
            p = self._config.arm
            self.stock.cup_takes(self.cup, p.suction_lateral, p.suction_vertical)
        else:
            self.stock.cup_drops(t, self.cup)
        return results

    def _step_worker(self, t: float) -> None:
        for event in self.worker.step(t, self._robot, self._view()):
            self._on_worker_event(t, event)
        behaviour = self._behaviour()
        hand = self._hand_target() if self.stock.held_by_person else None
        self.body.step(TICK, behaviour, self.worker.action == "walk_away", hand)

    def _view(self) -> WorldView:
        """What the person sees. A cube waits for the person only while both hands are free."""
        if self.stock.held_by_person:
            return WorldView(False, HELD_BY_PERSON)
        if self.stock.held_by_robot:
            return WorldView(False, HELD_BY_ROBOT)
        return WorldView(self.stock.at_pick_point is not None, HELD_BY_NOBODY)

    def _on_worker_event(self, t: float, event: WorkerEvent) -> None:
        if event.kind is EventKind.PICKED_CUBE:
            self.stock.person_takes()
        elif event.kind is EventKind.PLACED_CUBE:
            self.stock.person_places(event.container)
        elif event.kind is EventKind.RELEASED:
            self.stock.person_releases(t)
        elif event.kind is EventKind.STARTED_ACTION and event.action in EPISODES:
            self._episode += 1

    def _on_deposit(self, t: float, deposit: Deposit) -> None:
        cube, tray = deposit
        self._load_cells.put(t, tray.id, tray.owner, cube.id)
        if cube.id == self._subtask:
            self._subtask = None
            by_person = tray.owner == Container.OWNER_PERSON
            self.worker.end_subtask(t, self._fits(cube, tray), by_person)

    def _fits(self, cube: CubeState, tray: Tray) -> bool:
        rules = {rule.colour: rule.label for rule in self.task.rules}
        return tray.label == rules.get(cube.colour, "inspected")

    def _assign(self, t: float) -> None:
        """Make the cube whose turn it is the worker's, while the task runs.

        A cube put back behind another one loses its turn, but not while the person still argues
        about it with the robot.
        """
        cube = self.stock.in_play
        if self.task.status != TaskState.RUNNING or cube is None or cube.id == self._subtask:
            return
        arguing = self.worker.action == "warn" or cube.place in (Place.PERSON, Place.ROBOT)
        if self._subtask is None or not arguing:
            self._subtask = cube.id
            self.worker.start_subtask(t, cube.colour)

    def _behaviour(self) -> Behaviour:
        worker = self.worker
        return Behaviour(ACTIVITY[worker.action], worker.looking_around, worker.detected)

    def _hand_target(self) -> Tray:
        mine = [t for t in self.stock.trays if t.owner == Container.OWNER_PERSON]
        return mine[len(mine) // 2]

    # -- sensors --------------------------------------------------------------------------------

    def _perceive(self, t: float, output: CellOutput) -> None:
        percept = self._person_sensor.sense(t, self._behaviour(), self._episode)
        self._truths += 1
        hidden = self.worker.truth(t)
        output.truth = reports.truth(t, self._truths, self.task.task_id, hidden)
        output.conveyor = reports.conveyor(t, self.stock)
        output.cubes = reports.cubes(t, self._visible_cubes())
        output.containers = self._read_load_cells(t)
        self._report_person(t, percept, output)

    def _report_person(self, t: float, percept: Percept, output: CellOutput) -> None:
        output.warning = reports.header(t) if percept.warning else None
        output.activity = reports.activity(t, percept)
        output.head = reports.head(t, percept, self.body)

    def _read_load_cells(self, t: float) -> ContainerArray | None:
        for container, cube in self._load_cells.settled(t):
            self._contents.setdefault(container, []).append(cube)
            self._contents_changed = True
        if not self._contents_changed:
            return None
        self._contents_changed = False
        self._container_changes += 1
        return reports.containers(t, self._container_changes, self.stock, self._contents)

    def _visible_cubes(self) -> list[tuple[CubeState, int, Point]]:
        places = self.stock.belt.places
        lying = self._lying()
        seen = []
        for cube in self.stock.cubes.values():
            if cube.place is Place.BELT:
                stands = cube is self.stock.at_pick_point and self.stock.belt.speed == 0.0
                where = Cube.WHERE_PICK_POINT if stands else Cube.WHERE_BELT
                seen.append((cube, where, self._on_belt(places[cube.id])))
            elif cube.place is Place.PERSON:
                seen.append((cube, Cube.WHERE_PERSON, self.body.hand))
            elif cube.place is Place.ROBOT:
                hanging = Point(self.cup.x, self.cup.y, self.cup.z - self._half)
                seen.append((cube, Cube.WHERE_ROBOT, hanging))
            elif cube.place is Place.CONTAINER:
                seen.append((cube, Cube.WHERE_CONTAINER, lying[cube.id]))
        return seen

    def _lying(self) -> Mapping[int, Point]:
        """Places of the cubes in containers, m in the cell."""
        places = {}
        for tray in self.stock.trays:
            inside = [c.id for c in self.stock.cubes.values() if c.container == tray.id]
            for i, cube in enumerate(inside):
                places[cube] = tray.slot(i, self.geometry.edge)
        return places

    def _on_belt(self, x: float) -> Point:
        return self.geometry.conveyor.to_cell(Point(x, 0.0, self._half))

    @property
    def _half(self) -> float:
        return self.geometry.edge / 2
