# SPDX-License-Identifier: BSD-3-Clause
"""Figures of the planners for generative models on the standard problems.

Each problem runs in a process of its own (bench_episodes), as many side by side as there are cores
but at most two; their deadlines count the thread's own CPU time.
"""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

from fabric_planner.bench_record import Figure, figure

BUDGET = 0.01  # s of CPU time a decision


@dataclass(frozen=True)
class Run:
    """A planner on a problem, with the targets and what the reference planner reached."""

    problem: str
    planner: str = "DESPOT"
    episodes: int = 200
    target: float | None = None  # mean discounted return
    reference: float | None = None
    reference_at: str = "at 10 ms"  # its budget for a step
    trials_target: float | None = None  # trials per second
    trials_reference: float | None = None
    memory_target: float | None = None  # MB
    memory_reference: float | None = None
    step_reference: float | None = None  # ms of CPU time a step

    @property
    def name(self) -> str:
        return f"{self.problem} {self.planner}"


RUNS = (
    Run("Tag", episodes=500, target=-6.3, reference=-8.96, trials_target=5000.0,
        trials_reference=100.0, memory_reference=14.0, step_reference=17.0),
    Run("RockSample(7,8)", target=20.0, reference=11.84, trials_target=7000.0,
        trials_reference=140.0, memory_reference=54.0, step_reference=13.0),
    Run("RockSample(11,11)", target=20.5, reference=9.88, memory_reference=51.0,
        step_reference=14.0),
    Run("LaserTag", target=-9.0, reference=-10.1, memory_reference=13.0, step_reference=266.0),
    Run("RockSample(15,15)", episodes=100, reference=21.4, reference_at="at 100 ms",
        memory_target=60.0, memory_reference=625.0, step_reference=286.0),
    Run("Tag", "POMCP", reference=-11.9, reference_at="at 100 ms"),
    Run("RockSample(7,8)", "POMCP"),
)  # fmt: skip


def standard(runs: Sequence[Run], share: float, until: float) -> Iterator[Figure]:
    """The figures of each run, in the order in which they end.

    share: of the episodes to run; until: time.monotonic() at which all must be done. Runs that
    are short of time simulate fewer episodes and say so.
    """
    workers = min(2, len(os.sched_getaffinity(0)))
    with ThreadPoolExecutor(workers) as pool:
        waves = -(-len(runs) // workers)
        futures: list[Future] = []
        for place, run in enumerate(runs):
            futures.append(pool.submit(_measure, run, share, until, waves - place // workers))
        for run, future in zip(runs, futures, strict=True):
            yield from figures_of(run, future.result())


def _measure(run: Run, share: float, until: float, waves_left: int) -> dict:
    """What the worker process says about one run; its part of the time left is even."""
    seconds = max(1.0, (until - time.monotonic()) / waves_left)
    episodes = max(4, round(share * run.episodes))
    command = [sys.executable, "-m", "fabric_planner.bench_episodes", run.problem, run.planner]
    command += [str(BUDGET), str(episodes), f"{seconds:.1f}"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(command)}: {done.stderr.strip()}")
    return json.loads(done.stdout)


def figures_of(run: Run, found: dict) -> Iterator[Figure]:
    """The figures of one run from what its worker told."""
    detail = f"{run.planner}, {1e3 * BUDGET:g} ms a step"
    budget = {} if run.reference is None else {"reference_at": run.reference_at}
    yield figure(
        "return", run.problem, found["mean"], "reward", at_least=run.target,
        reference=run.reference, detail=detail, standard_error=found["standard_error"],
        episodes=found["episodes"], steps=found["steps"], recoveries=found["recoveries"],
        **budget,
    )  # fmt: skip
    yield figure(
        "trials", run.problem, found["trials_per_second"], "/s", at_least=run.trials_target,
        reference=run.trials_reference, detail=run.planner,
    )  # fmt: skip
    yield figure(
        "step_p99", run.problem, 1e3 * found["step_p99"], "ms", at_most=1.01e3 * BUDGET,
        reference=run.step_reference, detail=run.planner, median_ms=1e3 * found["step_median"],
        max_ms=1e3 * found["step_max"],
    )  # fmt: skip
    yield figure(
        "memory", run.problem, found["memory_mb"], "MB", at_most=run.memory_target,
        reference=run.memory_reference, detail=run.planner,
    )  # fmt: skip
