# SPDX-License-Identifier: BSD-3-Clause
"""What the worker tests share: parameters, one library of models, and a worker at a pick point."""

from hypothesis import settings

from fabric_sim.character import Character, named_generator
from fabric_sim.worker import Worker
from fabric_sim.worker_events import (
    HELD_BY_NOBODY,
    HELD_BY_PERSON,
    PHASE_APPROACH,
    PHASE_REST,
    ROBOT_CANCEL,
    ROBOT_GRASP,
    ROBOT_IDLE,
    ROBOT_PLANNING,
    ROBOT_POINT,
    EventKind,
    RobotView,
    WorldView,
)
from fabric_sim.worker_model import ModelLibrary
from fabric_sim.worker_parameters import WorkerParameters

settings.register_profile("worker", database=None, derandomize=True, deadline=None)
settings.load_profile("worker")

PARAMETERS = WorkerParameters.load()
LIBRARY = ModelLibrary(PARAMETERS.model)
TICK = 0.05
RULES = {1: "red", 2: "green", 3: "blue"}

RESTING = RobotView(ROBOT_IDLE, PHASE_REST)
TAKING_OVER = RobotView(ROBOT_GRASP, PHASE_APPROACH)
CANCELLING = RobotView(ROBOT_CANCEL, PHASE_REST)
POINTING = RobotView(ROBOT_POINT, PHASE_APPROACH)
PREPARING = RobotView(ROBOT_PLANNING, PHASE_APPROACH)

EXPERT = Character(1, 1, 1, 1)
MIDDLING = Character(0.5, 0.5, 0.5, 0.5)


def new_worker(character: Character = MIDDLING, seed: int = 1) -> Worker:
    """Return a worker without history, the models being shared."""
    return Worker(character, named_generator(seed, "test"), PARAMETERS, LIBRARY)


class Bench:
    """A worker with a package in front; the package follows what the worker does."""

    def __init__(self, character=MIDDLING, seed=1, scenario="inspection", cube=True):
        self.worker = new_worker(character, seed)
        self.tick = 0
        self.robot = RESTING
        self.world = WorldView(cube, HELD_BY_NOBODY)
        self.events = []
        rules = RULES if scenario == "sorting" else None
        self.worker.start_task(0.0, scenario, named_generator(seed, "worker"), rules)
        self.worker.start_subtask(0.0, 1)

    @property
    def t(self):
        """Time in s."""
        return round(self.tick * TICK, 6)

    def step(self):
        """One tick; returns its events."""
        events = self.worker.step(self.t, self.robot, self.world)
        for event in events:
            if event.kind is EventKind.PICKED_CUBE:
                self.world = WorldView(False, HELD_BY_PERSON)
            elif event.kind in (EventKind.PLACED_CUBE, EventKind.RELEASED):
                self.world = WorldView(False, HELD_BY_NOBODY)
        self.events += events
        self.tick += 1
        return events

    def run(self, seconds):
        """Run for some time; returns the events of it."""
        return [event for _ in range(round(seconds / TICK)) for event in self.step()]

    def run_until(self, reached, seconds=200.0):
        """Run until `reached(worker)` or fail."""
        for _ in range(round(seconds / TICK)):
            if reached(self.worker):
                return
            self.step()
        raise AssertionError(f"not reached within {seconds} s; state {self.worker.state}")

    def kinds(self):
        """Kinds of all events so far."""
        return [event.kind for event in self.events]


def bench_where(reached, character, first_seed=1, **options):
    """Return a bench whose worker comes to `reached` within a minute, trying seeds in order."""
    for seed in range(first_seed, first_seed + 500):
        bench = Bench(character, seed, **options)
        try:
            bench.run_until(reached, 60.0)
        except AssertionError:
            continue
        return bench, seed
    raise AssertionError("no seed leads there")
