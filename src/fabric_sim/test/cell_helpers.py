# SPDX-License-Identifier: BSD-3-Clause
"""What the tests of the cell share: the shipped configuration, tasks, a worker by script."""

from collections import deque
from dataclasses import dataclass, field
from pathlib import Path

from fabric_msgs.msg import Cube, SortingRule, TaskState
from fabric_sim.cell import Cell, CellConfig
from fabric_sim.cell_output import CellOutput
from fabric_sim.truth import Truth
from fabric_sim.worker_events import EventKind, WorkerEvent

SRC = Path(__file__).resolve().parents[2]
CONFIG = CellConfig.load(
    SRC.parent / "launch" / "config" / "cell.yaml",
    SRC / "fabric_dobot_driver" / "config" / "magician.yaml",
    SRC / "fabric_sim" / "config" / "arm.yaml",
    SRC / "fabric_sim" / "config" / "sensing.yaml",
)
R, G, B = Cube.COLOUR_RED, Cube.COLOUR_GREEN, Cube.COLOUR_BLUE
LABELS = {R: "red", G: "green", B: "blue"}
ITEMS = {R: 0, G: 1, B: 2}  # of the rules, by colour


@dataclass
class ScriptedWorker:
    """Does what a test tells it; notes what the cell tells it."""

    orders: deque = field(default_factory=deque)
    told: list = field(default_factory=list)
    views: list = field(default_factory=list)
    action: str = "idle"
    looking_around: bool = False
    detected: bool = True

    def start_task(self, t, scenario, rng, rules, load, on_call):
        self.told.append(("start_task", scenario, rules, load))

    def start_subtask(self, t, item):
        self.told.append(("start_subtask", item))

    def end_subtask(self, t, success, by_person):
        self.told.append(("end_subtask", success, by_person))

    def end_task(self, t, success):
        self.told.append(("end_task", success))

    def step(self, t, robot, world):
        self.views.append(world)
        orders, self.orders = list(self.orders), deque()
        return [WorkerEvent(t, kind, "state", self.action, container) for kind, container in orders]

    def truth(self, t):
        return Truth("scripted", "evaluating", self.action, "needs_help", 1.0, 1.0, 1.0, 0.1, 0, 0)

    def pick(self):
        self.orders.append((EventKind.PICKED_CUBE, None))

    def place(self, label):
        self.orders.append((EventKind.PLACED_CUBE, label))

    def release(self):
        self.orders.append((EventKind.RELEASED, None))


def task(scenario: str = "sorting", task_id: int = 1, colours=(R, G, B)) -> TaskState:
    rules = [
        SortingRule(colour=c, label=LABELS[c] if scenario == "sorting" else "inspected")
        for c in LABELS
    ]
    return TaskState(
        task_id=task_id,
        scenario=scenario,
        rules=rules,
        cube_colours=list(colours),
        cube_rules=[ITEMS[c] for c in colours],
        load=1.0,
        status=TaskState.RUNNING,
    )


def ended(state: TaskState, status: int = TaskState.SUCCEEDED) -> TaskState:
    return TaskState(task_id=state.task_id, scenario=state.scenario, status=status)


def start(
    scenario: str = "sorting", colours=(R, G, B), seed: int = 1
) -> tuple[Cell, ScriptedWorker]:
    """A cell in a running task with the belt on."""
    worker = ScriptedWorker()
    cell = Cell(CONFIG, worker, seed)
    cell.on_task(task(scenario, colours=colours))
    cell.set_conveyor(0.05, False)
    return cell, worker


def run(cell: Cell, seconds: float) -> list[CellOutput]:
    return [cell.step() for _ in range(round(seconds / 0.05))]


def until(cell: Cell, condition, limit: float = 60.0) -> list[CellOutput]:
    """Step until the condition holds."""
    outputs = []
    for _ in range(round(limit / 0.05)):
        outputs.append(cell.step())
        if condition():
            return outputs
    raise AssertionError(f"not so within {limit} s of simulated time")


def containers(outputs: list[CellOutput]) -> dict[int, list[int]]:
    """Cube ids by container id as last published."""
    last = [o.containers for o in outputs if o.containers is not None][-1]
    return {c.id: list(c.cube_ids) for c in last.containers if c.cube_ids}
