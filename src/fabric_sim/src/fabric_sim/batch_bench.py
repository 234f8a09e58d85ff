# SPDX-License-Identifier: BSD-3-Clause
"""Measures simulated tasks: `./fabric bench training [--quick] [--repeats N] [--json]`.

Whole tasks of the headless runner, with another person in every task and a robot whose policy was
solved beforehand: in one process, in two at once, and as the baseline of the same run in one that
goes through every tick. The repetitions of all three take turns, so that a busy machine hits them
alike; figures are medians over the repetitions. Then how long a full training of ABPS takes, told
from a share of it. With --json each figure is one JSON object on its own line, the first of them
the hardware.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import statistics
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection

import fabric_planner as fp
from fabric_abps import Library
from fabric_msgs.msg import Decision, Observation
from fabric_planner.bench_record import Figure, beside, figure, hardware
from fabric_planner.bench_report import line, table
from fabric_sim.batch_decider import AgentDecider
from fabric_sim.batch_files import Files
from fabric_sim.batch_loop import HeadlessRun, RunSetup
from fabric_sim.batch_train import measure as measure_training
from fabric_sim.truth import Truth

POLICY = "proactive"
SEED = 101
TASKS = {"inspection": 400, "sorting": 40}  # of a repetition in one process
TICKING_SHARE = 0.1  # of them in the baseline
TARGET = {"inspection": 2000.0}  # tasks/s of two processes
FULL = 16 * 20 * 90  # tasks of a full training: types, policies, tasks of each pair
SHARE = {"inspection": 4, "sorting": 12}  # one chunk in so many of a training is run
TRAINING_TARGET = {"sorting": 60.0}  # s with two processes


class TimedDecider(AgentDecider):
    """The planner's agent, with the CPU time that its decisions take."""

    def __init__(self, agent: fp.DecisionAgent) -> None:
        super().__init__(agent)
        self.seconds, self.decisions = 0.0, 0

    def decide(self, observation: Observation, truth: Truth) -> Decision:
        """Return what the agent decides."""
        begin = time.thread_time()
        decision = super().decide(observation, truth)
        self.seconds += time.thread_time() - begin
        self.decisions += 1
        return decision


@dataclass
class Work:
    """What a process did."""

    tasks: int = 0
    subtasks: int = 0
    decisions: int = 0
    deciding: float = 0.0  # s of CPU time
    cpu: float = 0.0  # s of CPU time
    wall: float = 0.0  # s from the first start to the last end


class Bench:
    """One scenario in one process: a run that leaves ticks out, and one that does not."""

    def __init__(self, scenario: str, seed: int, files: Files, solved: fp.AlphaVectors) -> None:
        self._setup = RunSetup(scenario, "mixed", POLICY, seed)
        self._files, self._solved = files, solved
        self._runs = {every_tick: self._run(every_tick) for every_tick in (False, True)}

    def work(self, tasks: int, every_tick: bool) -> Work:
        """Run tasks on, and say what it took."""
        run, decider = self._runs[every_tick]
        decider.seconds, decider.decisions = 0.0, 0
        wall, cpu, subtasks = time.perf_counter(), time.process_time(), 0
        for _ in range(tasks):
            subtasks += _subtasks(run.run_task().row)
        cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
        return Work(tasks, subtasks, decider.decisions, decider.seconds, cpu, wall)

    def _run(self, every_tick: bool) -> tuple[HeadlessRun, TimedDecider]:
        model = self._files.model(POLICY, self._setup.scenario)
        decider = TimedDecider(self._files.offline_agent(model, self._solved))
        return HeadlessRun(self._setup, self._files, None, decider, every_tick), decider


def _subtasks(row: dict) -> int:
    names = ("human_succeeded", "human_failed", "robot_succeeded", "robot_failed")
    return sum(row[name] for name in names)


def serve(bench: Bench, orders: Connection) -> None:
    """A process: work as ordered until the pipe closes."""
    while True:
        try:
            orders.send(bench.work(*orders.recv()))
        except EOFError:
            return


class Crew:
    """Two processes that wait for orders."""

    def __init__(self, scenario: str) -> None:
        files = Files()
        solved = files.solve(POLICY, scenario)
        fork = multiprocessing.get_context("fork")
        self._pipes = []
        for seed in (SEED, SEED + 1):
            here, there = fork.Pipe()
            bench = Bench(scenario, seed, files, solved)
            fork.Process(target=serve, args=(bench, there), daemon=True).start()
            self._pipes.append(here)

    def work(self, processes: int, tasks: int, every_tick: bool = False) -> Work:
        """Have the first `processes` run `tasks` each at once; the sum of what they did."""
        begin, total = time.perf_counter(), Work()
        for pipe in self._pipes[:processes]:
            pipe.send((tasks, every_tick))
        for pipe in self._pipes[:processes]:
            done = pipe.recv()
            for name in ("tasks", "subtasks", "decisions", "deciding", "cpu"):
                setattr(total, name, getattr(total, name) + getattr(done, name))
        total.wall = time.perf_counter() - begin
        return total

    def close(self) -> None:
        """Let the processes end."""
        for pipe in self._pipes:
            pipe.close()


def measure(scenario: str, repeats: int, tasks: int) -> Iterator[Figure]:
    """The figures of tasks of a scenario."""
    crew = Crew(scenario)
    ticking = max(1, round(TICKING_SHARE * tasks))
    crew.work(2, tasks)  # fills what is worked out once
    crew.work(1, ticking, True)
    ones, twos, slow = [], [], []
    for _ in range(repeats):
        ones.append(crew.work(1, tasks))
        twos.append(crew.work(2, tasks))
        slow.append(crew.work(1, ticking, True))
    crew.close()
    yield from figures(scenario, ones, twos, slow)


def everything(scenario: str, repeats: int, tasks: int, quick: bool) -> Iterator[Figure]:
    """All figures of a scenario, on a tenth of the work if quick."""
    less = 10 if quick else 1
    yield from measure(scenario, repeats, tasks // less)
    yield full_training(scenario, SHARE[scenario] * less)


def full_training(scenario: str, share: int) -> Figure:
    """How long a full training with twenty policies takes, told from every share-th chunk of it."""
    library = Library.load(Files().share("fabric_abps") / "library" / scenario, scenario)
    found = measure_training(library, 2, share, SEED)
    return _figure(
        "full_training", scenario, FULL / found.rate, "s", at_most=TRAINING_TARGET.get(scenario),
        detail="2 processes", policies=len(library.names), tasks_run=found.tasks,
    )  # fmt: skip


def figures(
    scenario: str, ones: Sequence[Work], twos: Sequence[Work], slow: Sequence[Work]
) -> Iterator[Figure]:
    """The figures of repetitions in one process, in two, and through every tick."""
    about = {"policy": POLICY, "repeats": len(ones), "tasks_a_repeat": ones[0].tasks}
    yield _figure("throughput", scenario, _rate(ones), "tasks/s", detail="1 process", **about)
    yield _figure(
        "throughput", scenario, _rate(twos), "tasks/s",
        at_least=TARGET.get(scenario), detail="2 processes", **about,
    )  # fmt: skip
    speed_up = statistics.median(
        two.tasks / two.wall / (one.tasks / one.wall) for one, two in zip(ones, twos, strict=True)
    )
    yield _figure("speed_up", scenario, speed_up, "x", detail="1 to 2 processes")
    for detail, works in (("1 process", ones), ("2 processes", twos)):
        yield _figure("subtasks", scenario, _rate(works, "subtasks"), "subtasks/s", detail=detail)
    ours = _figure("throughput", scenario, _cpu_rate(ones), "tasks/s", detail="a CPU second")
    ratio = _cpu_rate(ones) / _cpu_rate(slow)
    yield beside(ours, "every tick", _cpu_rate(slow)) | {"times_every_tick": ratio}
    for detail, works in (("1 process", ones), ("2 processes", twos)):
        deciding = statistics.median(1e6 * work.deciding / work.decisions for work in works)
        yield _figure("decision", scenario, deciding, "us", detail=detail)
    yield _figure("decisions", scenario, ones[-1].decisions / ones[-1].tasks, "a task")


def _rate(works: Sequence[Work], what: str = "tasks") -> float:
    return statistics.median(getattr(work, what) / work.wall for work in works)


def _cpu_rate(works: Sequence[Work]) -> float:
    return statistics.median(work.tasks / work.cpu for work in works)


def _figure(name: str, scenario: str, value: float, unit: str, **more: object) -> Figure:
    return figure(name, scenario, value, unit, bench="training", **more)


def parser() -> argparse.ArgumentParser:
    """What can be said on the command line."""
    result = argparse.ArgumentParser(prog="fabric bench training", description="Simulated tasks.")
    result.add_argument("--repeats", type=int, default=7, help="repetitions, taking turns")
    result.add_argument("--quick", action="store_true", help="a tenth of the work, worse figures")
    result.add_argument("--json", action="store_true", help="one JSON object a line")
    return result


def main(argv: Sequence[str] | None = None) -> int:
    """Measure; return the exit code."""
    arguments = parser().parse_args(argv)
    if arguments.repeats < 1:
        print(f"--repeats is {arguments.repeats}; it must be 1 at least", file=sys.stderr)
        return 2
    measured = [
        hardware() | {"bench": "training", "time": "wall time, decisions CPU time, medians"}
    ]
    print(json.dumps(measured[0]) if arguments.json else line(measured[0]), flush=True)
    for scenario, tasks in TASKS.items():
        for found in everything(scenario, arguments.repeats, tasks, arguments.quick):
            print(json.dumps(found) if arguments.json else line(found), flush=True)
            measured.append(found)
    if not arguments.json:
        print("\n" + table(measured))
    return 0


if __name__ == "__main__":
    sys.exit(main())
