# SPDX-License-Identifier: BSD-3-Clause
"""The worker of bench_standard: episodes of one planner on one problem, told as a JSON object.

    python3 -m fabric_planner.bench_episodes PROBLEM PLANNER BUDGET EPISODES SECONDS

BUDGET: s of CPU time a decision. After SECONDS of wall time no further episode begins.
"""

import json
import re
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import fabric_planner as fp

CHUNK = 4  # episodes between two looks at the clock
SEED = 1


def make_model(problem: str) -> fp.CompiledModel:
    """The example of that name. Raises KeyError for others."""
    rocks = re.fullmatch(r"RockSample\((\d+),(\d+)\)", problem)
    if rocks:
        return fp.examples.rock_sample(int(rocks[1]), int(rocks[2]))
    return {"Tag": fp.examples.tag, "LaserTag": fp.examples.laser_tag,
            "Tiger": fp.examples.tiger}[problem]()  # fmt: skip


def make_options(planner: str, budget: float) -> fp.DespotOptions | fp.PomcpOptions:
    """With a deadline in CPU time. Raises KeyError for other planners."""
    options = {"DESPOT": fp.DespotOptions, "POMCP": fp.PomcpOptions}[planner]()
    options.deadline = budget
    options.cpu_time = True
    return options


def memory_mb(field: str) -> float:
    """VmRSS, what this process has now, or VmHWM, the most it has had."""
    status = Path("/proc/self/status").read_text()
    return int(re.search(rf"{field}:\s+(\d+) kB", status)[1]) / 1024.0


def measure(problem: str, planner: str, budget: float, episodes: int, seconds: float) -> dict:
    """Runs the episodes with the seeds SEED, SEED + 1 and so on."""
    begin, before = time.monotonic(), memory_mb("VmRSS")
    model, options = make_model(problem), make_options(planner, budget)
    parts = []
    done = 0
    while done < episodes and (done < 2 or time.monotonic() < begin + seconds):
        count = min(CHUNK, episodes - done)
        parts.append(fp.evaluate_episodes(model, options, count, SEED + done))
        done += count
    return summary(parts) | {"memory_mb": memory_mb("VmHWM") - before}


def summary(parts: Sequence[fp.Episodes]) -> dict:
    returns = np.concatenate([part.returns for part in parts])
    times = np.concatenate([part.planning_time for part in parts])
    trials = sum(part.trials_per_step * len(part.planning_time) for part in parts)
    return {
        "mean": float(returns.mean()),
        "standard_error": float(returns.std(ddof=1) / np.sqrt(len(returns))),
        "episodes": len(returns),
        "steps": len(times) / len(returns),
        "recoveries": int(sum(part.recoveries.sum() for part in parts)),
        "trials_per_second": float(trials / times.sum()),
        "step_median": float(np.median(times)),
        "step_p99": float(np.percentile(times, 99)),
        "step_max": float(times.max()),
        "belief_time": float(np.mean([part.belief_time for part in parts])),
    }


def main(argv: Sequence[str]) -> int:
    problem, planner, budget, episodes, seconds = argv
    print(json.dumps(measure(problem, planner, float(budget), int(episodes), float(seconds))))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
