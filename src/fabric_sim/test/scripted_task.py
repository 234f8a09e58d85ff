# SPDX-License-Identifier: BSD-3-Clause
"""Inspection tasks without a cell: a person alone, or beside a robot that follows a script."""

from worker_bench import LIBRARY, PARAMETERS, TICK

from fabric_sim.character import named_generator
from fabric_sim.experiments.observed_worker import ObservedWorker
from fabric_sim.worker_events import (
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
    WorldView,
)

T_MAX = 52.0  # s until the belt takes the package away
TAKES_OVER = 12.0  # s; when the scripted robot begins to prepare


class ScriptedRobot:
    """Prepares and takes the package over, whatever the person does; cancels when warned."""

    PIECES = (  # duration s, action, phase
        (3.0, ROBOT_PLANNING, PHASE_REST),
        (4.0, ROBOT_GRASP, PHASE_APPROACH),
        (1.0, ROBOT_GRASP, PHASE_CONTACT),
        (6.0, ROBOT_GRASP, PHASE_CARRY),
    )
    CANCELS_FOR, WAITS_FOR = 1.0, 10.0  # s

    def __init__(self, start):
        self._start = start
        self._cancelled = None
        self.placed = False

    def warned(self, t):
        """Stop, and try again later."""
        if self._cancelled is None:
            self._cancelled = t
            self._start = t + self.CANCELS_FOR + self.WAITS_FOR

    def at(self, t, cube_free):
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


def new_person(character):
    """Return an observed worker without history."""
    rng = named_generator(0, "each task brings its own")
    return ObservedWorker(character, rng, PARAMETERS, LIBRARY)


def run_alone(worker, seed):
    """Run one task without a robot; returns its record. Skips the time in which nothing happens."""
    world, t, success = WorldView(), 0.0, None
    _begin(worker, seed)
    while success is None:
        for event in worker.step(t, RobotView(), world):
            world = _after(event, world)
            success = True if event.kind is EventKind.PLACED_CUBE else success
        if success is None and t >= T_MAX and world.held_by != HELD_BY_PERSON:
            success = False
        if success is None:
            t = max(t, min(worker.next_wakeup, T_MAX if t < T_MAX else worker.next_wakeup))
    return _end(worker, t, success, by_person=success)


def run_helped(worker, seed, start=TAKES_OVER):
    """Run one task beside the scripted robot; returns its record."""
    robot, world, success, tick = ScriptedRobot(start), WorldView(), None, 0
    by_person = False
    _begin(worker, seed)
    while success is None:
        t = round(tick * TICK, 6)
        seen = robot.at(t, world.held_by != HELD_BY_PERSON)
        holds = seen.current == ROBOT_GRASP and seen.phase == PHASE_CARRY
        if world.held_by != HELD_BY_PERSON:
            world = WorldView(not holds, HELD_BY_ROBOT if holds else HELD_BY_NOBODY)
        for event in worker.step(t, seen, world):
            world = _after(event, world)
            by_person = by_person or event.kind is EventKind.PLACED_CUBE
            if event.kind is EventKind.WARNED:
                robot.warned(t)
        if by_person or robot.placed:
            success = True
        elif t >= T_MAX and world.held_by != HELD_BY_PERSON:
            success = False
        tick += 1
    return _end(worker, t, success, by_person)


def _begin(worker, seed):
    worker.start_task(0.0, "inspection", named_generator(seed, "worker"))
    worker.start_subtask(0.0)


def _after(event, world):
    return WorldView(False, HELD_BY_PERSON) if event.kind is EventKind.PICKED_CUBE else world


def _end(worker, t, success, by_person):
    worker.end_subtask(t, success, by_person=by_person)
    worker.end_task(t, success)
    return worker.record


def mean(values):
    """Mean of some numbers or truths."""
    values = list(values)
    return sum(values) / len(values)


def first_left(record):
    """Time in s at which the person walked away first, or None."""
    walks = (e.t for e in record.events if e.action == "walk_away")
    return next(walks, None)


def day_alone(character, people, seed):
    """Return the success rates alone in tasks 1-10, 11-20, 21-30 and 31-40 of a working day."""
    rates = [0.0] * 4
    for person in range(people):
        worker = new_person(character)
        for number in range(40):
            record = run_alone(worker, seed + 1000 * person + number)
            rates[number // 10] += record.success / (10.0 * people)
    return rates
