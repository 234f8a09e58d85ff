# SPDX-License-Identifier: BSD-3-Clause
"""Workers in figures: success, time and answers of types beside the recorded values.

    python -m fabric_sim.worker_table [--tasks 400] [--seed 1] [--json]

Inspection tasks, each with a fresh person: alone, and beside a scripted robot that prepares at 12 s
and takes the package over at 15 s, whatever the person does, and cancels when warned.
"""

from __future__ import annotations

import argparse
import itertools
import json
from dataclasses import asdict, dataclass, field

from .character import CORNERS, Character, named_generator
from .worker import Worker
from .worker_events import (
    HELD_BY_NOBODY,
    HELD_BY_PERSON,
    HELD_BY_ROBOT,
    PHASE_APPROACH,
    PHASE_CARRY,
    PHASE_CONTACT,
    PHASE_REST,
    ROBOT_CANCEL,
    ROBOT_GRASP,
    ROBOT_IDLE,
    ROBOT_PLANNING,
    EventKind,
    RobotView,
    WorkerEvent,
    WorldView,
)  # fmt: skip
from .worker_model import ModelLibrary, Solver, planner_solver
from .worker_parameters import WorkerParameters

TICK = 0.05  # s
T_MAX = 52.0  # s until the belt takes the package away
RECORDED_STEP = 4.5  # s, a person's idle step in the recordings (ORIGINAL: action and decision)

#: (character, success, done by the robot, time s, warn per interfered step, success per grasp)
RECORDED = {
    "beginner rested": (Character(0, 1, 1, 1), 0.782, 0.34, 36.5, (0.09, 0.13), (0.29, 0.33)),
    "beginner tired nonc.": (Character(0, 0, 1, 0), 0.786, 0.52, 35.6, (0.47, 0.57), (0.29, 0.33)),
    "distracted": (Character(0.5, 0.5, 0, 1), 0.937, 0.55, 29.3, (0.09, 0.13), (0.62, 0.73)),
    "expert rested": (Character(1, 1, 1, 1), 0.996, 0.04, 11.1, (0.09, 0.13), (1.0, 1.0)),
    "expert tired": (Character(1, 0, 1, 1), 0.988, 0.30, 17.9, (0.09, 0.13), (0.86, 0.89)),
}  # fmt: skip


class ScriptedRobot:
    """Plays fixed (duration s, action, phase) pieces from a start time; cancels when warned."""

    PIECES = (
        (3.0, ROBOT_PLANNING, PHASE_REST),
        (4.0, ROBOT_GRASP, PHASE_APPROACH),
        (1.0, ROBOT_GRASP, PHASE_CONTACT),
        (6.0, ROBOT_GRASP, PHASE_CARRY),
    )
    CANCELS_FOR, WAITS_FOR = 1.0, 10.0  # s

    def __init__(self, start: float) -> None:
        self._start = start
        self._cancelled: float | None = None
        self.placed = False

    def warned(self, t: float) -> None:
        """Stop, and try again later."""
        if self._cancelled is None:
            self._cancelled = t
            self._start = t + self.CANCELS_FOR + self.WAITS_FOR

    def at(self, t: float, cube_free: bool) -> RobotView:
        """Return what is seen of the robot at time t (s)."""
        if self._cancelled is not None and t >= self._cancelled + self.CANCELS_FOR:
            self._cancelled = None
        if self._cancelled is not None:
            return RobotView(ROBOT_CANCEL, PHASE_REST)
        since = t - self._start
        for duration, action, phase in self.PIECES if since >= 0.0 else ():
            if since < duration:
                return RobotView(action, phase) if cube_free else RobotView()
            since -= duration
        self.placed = self._start <= t and cube_free
        return RobotView(ROBOT_IDLE, PHASE_REST)


@dataclass
class TaskResult:
    """One inspection task; `watched`: s spent watching the robot after accepting its help."""

    success: bool
    by_robot: bool
    duration: float
    decisions: int
    warned: int
    interferences: int
    refusals: int
    watched: float
    first_left: float | None
    events: list[WorkerEvent] = field(repr=False, default_factory=list)


def run_inspection(worker: Worker, seed: int, robot_starts: float | None = None) -> TaskResult:
    """Run one task from the moment the package stops; `robot_starts` in s, None for no robot."""
    robot = ScriptedRobot(robot_starts) if robot_starts is not None else None
    seen, world, events = RobotView(), WorldView(), []
    interferences, refusals = worker.interferences, worker.refusals
    worker.start_task(0.0, "inspection", named_generator(seed, "worker"))
    worker.start_subtask(0.0)
    watched, tick, by_robot, success = 0, 0, False, None
    while success is None:
        t = round(tick * TICK, 6)
        if robot:
            seen = robot.at(t, world.held_by != HELD_BY_PERSON)
            holds = seen.current == ROBOT_GRASP and seen.phase == PHASE_CARRY
            if world.held_by != HELD_BY_PERSON:
                world = WorldView(not holds, HELD_BY_ROBOT if holds else HELD_BY_NOBODY)
            by_robot = robot.placed
        for event in worker.step(t, seen, world):
            events.append(event)
            if event.kind is EventKind.PICKED_CUBE:
                world = WorldView(False, HELD_BY_PERSON)
            elif event.kind is EventKind.PLACED_CUBE:
                success = True
            elif event.kind is EventKind.WARNED and robot:
                robot.warned(t)
        if success is None and by_robot:
            success = True
        if success is None and t >= T_MAX and world.held_by != HELD_BY_PERSON:
            success = False
        watched += worker.state == "robot_interfered"
        tick += 1
    placed_by_person = any(event.kind is EventKind.PLACED_CUBE for event in events)
    worker.end_subtask(t, success, by_person=placed_by_person)
    worker.end_task(t, success)
    left = [event.t for event in events if event.kind is EventKind.STARTED_ACTION
            and event.action == "walk_away"]  # fmt: skip
    return TaskResult(
        success, success and not placed_by_person, t,
        sum(event.kind is EventKind.STARTED_ACTION for event in events),
        sum(event.kind is EventKind.WARNED for event in events),
        worker.interferences - interferences, worker.refusals - refusals, watched * TICK,
        left[0] if left else None, events,
    )  # fmt: skip


@dataclass
class TypeFigures:
    """Figures of one type; times in s, the rest rates; None where nothing happened."""

    name: str
    success_alone: float
    time_alone: float
    success_per_grasp: float | None
    decisions_alone: float
    success_with_robot: float
    by_robot: float
    time_with_robot: float
    refused: float | None
    warned_per_step: float | None


def figures(
    name: str, character: Character, tasks: int, seed: int, p: WorkerParameters, lib: ModelLibrary
) -> TypeFigures:
    """Run `tasks` tasks alone and as many beside the scripted robot, each with a fresh person."""

    def run(number: int, robot_starts: float | None) -> TaskResult:
        worker = Worker(character, named_generator(seed, "unused"), p, lib)
        return run_inspection(worker, seed * 1_000_003 + number, robot_starts)

    alone = [run(number, None) for number in range(tasks)]
    helped = [run(number, 12.0) for number in range(tasks)]
    interferences = sum(result.interferences for result in helped)
    refusals = sum(result.refusals for result in helped)
    steps = refusals + sum(result.watched for result in helped) / RECORDED_STEP
    return TypeFigures(
        name,
        _mean([result.success for result in alone]),
        _mean([result.duration for result in alone]),
        _success_per_grasp(alone),
        _mean([result.decisions for result in alone]),
        _mean([result.success for result in helped]),
        _mean([result.by_robot for result in helped]),
        _mean([result.duration for result in helped]),
        refusals / interferences if interferences else None,
        refusals / steps if steps else None,
    )


def _success_per_grasp(results: list[TaskResult]) -> float | None:
    """Share of the grasps begun while evaluating that lifted the package."""
    lifted = [
        after.kind is EventKind.PICKED_CUBE
        for result in results
        for event, after in itertools.pairwise(result.events)
        if event.kind is EventKind.STARTED_ACTION
        and (event.state, event.action) == ("evaluating", "grasp")
    ]
    return _mean(lifted) if lifted else None


def _mean(values: list) -> float:
    return sum(values) / len(values)


def decay(
    character: Character, people: int, seed: int, p: WorkerParameters, lib: ModelLibrary
) -> list[float]:
    """Return the success rate alone in tasks 1-10, 11-20, 21-30 and 31-40 of a working day."""
    rates = [0.0] * 4
    for person in range(people):
        worker = Worker(character, named_generator(seed, "unused"), p, lib)
        for number in range(40):
            result = run_inspection(worker, seed + 1000 * person + number)
            rates[number // 10] += result.success / (10.0 * people)
    return rates


def _cell(value: float | None, width: int, digits: int = 2) -> str:
    return ("-" if value is None else f"{value:.{digits}f}").rjust(width)


def _row(f: TypeFigures) -> str:
    return (
        f"{f.name:<48}{_cell(f.success_alone, 6)}{_cell(f.time_alone, 7, 1)}"
        f"{_cell(f.decisions_alone, 6, 1)}{_cell(f.success_per_grasp, 8)}   "
        f"{_cell(f.success_with_robot, 6)}{_cell(f.by_robot, 7)}{_cell(f.time_with_robot, 7, 1)}"
        f"{_cell(f.refused, 8)}{_cell(f.warned_per_step, 8)}"
    )


_HEAD = (
    f"{'':<48}{'alone':<30}{'beside the scripted robot'}\n"
    f"{'type':<48}{'succ':>6}{'time':>7}{'acts':>6}{'s|grasp':>8}   "
    f"{'succ':>6}{'byrob':>7}{'time':>7}{'refuse':>8}{'w|step':>8}"
)


def print_tables(tasks: int, seed: int, as_json: bool, solver: Solver = planner_solver) -> None:
    """Print the figures of the recorded types, of the 16 corners, and the decay over 40 tasks."""
    p = WorkerParameters.load()
    lib = ModelLibrary(p.model, solver)
    recorded = [figures(n, r[0], tasks, seed, p, lib) for n, r in RECORDED.items()]
    corners = [figures(n, c, tasks, seed, p, lib) for n, c in CORNERS.items()]
    days = {n: decay(r[0], max(2, tasks // 20), seed, p, lib) for n, r in RECORDED.items()}
    if as_json:
        for row in recorded + corners:
            print(json.dumps(asdict(row)))
        for name, rates in days.items():
            print(json.dumps({"name": name, "success_alone_by_ten_tasks": rates}))
        return
    print(_HEAD)
    for row, (_, success, by_robot, time, warn, grasp) in zip(
        recorded, RECORDED.values(), strict=True
    ):
        print(_row(row))
        print(
            f"{'    recorded, average over its robots':<48}{'':6}{'':7}{'':6}"
            f"{f'{grasp[0]:.2f}-{grasp[1]:.2f}':>11}{success:6.2f}{by_robot:7.2f}{time:7.1f}{'':8}"
            f"{f'{warn[0]:.2f}-{warn[1]:.2f}':>11}"
        )
    print()
    for row in corners:
        print(_row(row))
    print(f"\n{'success alone in tasks':<48}{'1-10':>6}{'11-20':>7}{'21-30':>7}{'31-40':>7}")
    for name, rates in days.items():
        print(f"{name:<48}{rates[0]:6.2f}" + "".join(f"{rate:7.2f}" for rate in rates[1:]))
    print(
        "\nrefuse: share of the robot's grasps answered by a warning. w|step: the same per "
        f"{RECORDED_STEP} s step\nin which the person was interfered with, as in the recordings. "
        f"Times in s; a lost package counts {T_MAX:.0f} s."
    )


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Figures of the simulated workers")
    parser.add_argument("--tasks", type=int, default=400, help="tasks per type and condition")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", action="store_true", help="one object a line")
    arguments = parser.parse_args()
    print_tables(arguments.tasks, arguments.seed, arguments.json)


if __name__ == "__main__":
    main()
