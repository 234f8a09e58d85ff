# SPDX-License-Identifier: BSD-3-Clause
"""Measures the planner: `./fabric bench planner [--json]`.

Every figure that is a time stands beside a baseline measured in the same run; machines differ,
ratios less so. With --json each figure is one JSON object on its own line.
"""

import argparse
import json
import statistics
import sys
import time
from collections.abc import Callable, Iterator, Sequence

import numpy as np

import fabric_planner as fp
from fabric_planner.paths import shipped_models

UPDATES = 100_000
DECISIONS = 200
DEADLINE = 5e-3  # s, of the overrun figure
AMPLE = 1e6  # s: a deadline that never ends a search


def tiger() -> fp.Pomdp:
    """The tiger problem (Kaelbling, Littman and Cassandra 1998), discount 0.95."""
    stays, half = np.eye(2), np.full((2, 2), 0.5)
    ear = np.array([[0.85, 0.15], [0.15, 0.85]])
    reward = np.array([[-1.0, -1.0], [-100.0, 10.0], [10.0, -100.0]])
    return fp.Pomdp(
        ["left", "right"], ["listen", "open_left", "open_right"], ["left", "right"],
        np.array([stays, half, half]), np.array([ear, half, half]), reward, 0.95,
        np.array([0.5, 0.5]), name="tiger",
    )  # fmt: skip


def benched_models() -> list[fp.Pomdp]:
    return [tiger()] + [fp.load_pomdpx(path) for path in shipped_models()]


def median_time(call: Callable[[], object], repeats: int) -> float:
    """Median duration in seconds."""
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        call()
        times.append(time.perf_counter() - begin)
    return statistics.median(times)


def simulate(model: fp.Pomdp, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Random actions and the observations they bring, starting again where an episode ends."""
    rng = np.random.default_rng(seed)
    transition, emission = model.transition.cumsum(axis=2), model.observation.cumsum(axis=2)
    actions = rng.integers(model.n_actions, size=count)
    observations = np.zeros(count, dtype=int)
    state = int(np.argmax(model.initial_belief))
    for i, action in enumerate(actions):
        if model_ended(model, state):
            state = int(np.argmax(model.initial_belief))
        state = draw(transition[action, state], rng)
        observations[i] = draw(emission[action, state], rng)
    return actions, observations


def model_ended(model: fp.Pomdp, state: int) -> bool:
    return bool(model.terminal[state]) and not model.terminal.all()


def draw(cumulative: np.ndarray, rng: np.random.Generator) -> int:
    last = len(cumulative) - 1
    return min(int(np.searchsorted(cumulative, rng.random(), side="right")), last)


def bench_filter(model: fp.Pomdp) -> dict:
    """One exact belief update, beside the same in NumPy."""
    actions, observations = simulate(model, 2000, seed=1)
    times = UPDATES // len(actions)
    belief_filter = fp.BeliefFilter(model)
    many, seen = np.tile(actions, times), np.tile(observations, times)
    ours = median_time(lambda: belief_filter.update_many(many, seen), 5) / len(many)
    transition, emission = model.transition, model.observation

    def with_numpy() -> None:
        belief = model.initial_belief
        for action, observation in zip(actions, observations, strict=True):
            joint = (belief @ transition[action]) * emission[action][:, observation]
            total = joint.sum()
            belief = joint / total if total > 0.0 else model.initial_belief

    baseline = median_time(with_numpy, 3) / len(actions)
    return {
        "figure": "belief_update", "model": model.name, "time_ns": 1e9 * ours,
        "baseline": "numpy", "baseline_ns": 1e9 * baseline, "baseline_over_ours": baseline / ours,
    }  # fmt: skip


def bench_bounds(model: fp.Pomdp) -> dict:
    """The offline bounds at the initial belief and the time to make a planner."""
    belief = model.initial_belief
    seconds = median_time(lambda: fp.OnlinePlanner(model), 3)
    offline = fp.OnlinePlanner(model, fp.PlannerOptions(0.0)).decide(belief)
    qmdp_time = median_time(lambda: fp.qmdp(model), 3)
    return {
        "figure": "offline_bounds", "model": model.name,
        "blind": float((fp.blind_bound(model) @ belief).max()),
        "lower": offline.lower_bound, "upper": offline.upper_bound,
        "fast_informed": float((fp.fast_informed_bound(model) @ belief).max()),
        "qmdp": float((fp.qmdp(model) @ belief).max()),
        "time_s": seconds, "baseline": "qmdp", "baseline_s": qmdp_time,
        "ours_over_baseline": seconds / qmdp_time,
    }  # fmt: skip


def bench_decision(model: fp.Pomdp) -> dict:
    """One decision at the initial belief until the gap is 1e-3 or the nodes are used up."""
    belief, q = model.initial_belief, fp.qmdp(model)
    planner = fp.OnlinePlanner(model, fp.PlannerOptions(deadline=AMPLE, gap=1e-3))
    decision = planner.decide(belief)
    seconds = median_time(lambda: planner.decide(belief), 3)
    baseline = median_time(lambda: int((q @ belief).argmax()), 1000)
    return {
        "figure": "decision", "model": model.name, "action": model.actions[decision.action],
        "lower": decision.lower_bound, "upper": decision.upper_bound,
        "gap": decision.upper_bound - decision.lower_bound,
        "ended_by": decision.ended_by.name, "nodes": decision.nodes, "time_ms": 1e3 * seconds,
        "nodes_per_s": decision.nodes / seconds, "baseline": "qmdp action in numpy",
        "baseline_ms": 1e3 * baseline, "ours_over_baseline": seconds / baseline,
    }  # fmt: skip


def bench_deadline(model: fp.Pomdp) -> dict:
    """Decisions along a simulated run under a deadline that ends them, and by how much it is
    overrun (below zero: time left); by the thread's own time, too, in which others do not count."""
    options = fp.PlannerOptions(deadline=DEADLINE, gap=0.0, max_nodes=100_000)
    planner, belief_filter = fp.OnlinePlanner(model, options), fp.BeliefFilter(model)
    late, own, missed, stopped = [], [], 0, 0
    for action, observation in zip(*simulate(model, DECISIONS, seed=2), strict=True):
        begin = time.thread_time()
        decision = planner.decide(belief_filter.belief)
        if decision.ended_by == fp.EndedBy.DEADLINE:
            stopped += 1
            own.append(time.thread_time() - begin - DEADLINE)
            late.append(decision.planning_time - DEADLINE)
        missed += decision.deadline_missed
        belief_filter.update(int(action), int(observation))
    late, own = late or [0.0], own or [0.0]
    return {
        "figure": "deadline", "model": model.name, "deadline_ms": 1e3 * DEADLINE,
        "decisions": DECISIONS, "ended_by_deadline": stopped, "missed": missed,
        "late_p99_ms": 1e3 * float(np.percentile(late, 99)), "late_max_ms": 1e3 * max(late),
        "late_max_own_time_ms": 1e3 * max(own),
    }  # fmt: skip


def figures() -> Iterator[dict]:
    models = benched_models()
    for bench in (bench_filter, bench_bounds, bench_decision, bench_deadline):
        for model in models:
            yield {"bench": "planner"} | bench(model)


def shown(figure: dict) -> str:
    """One figure as a line of words and numbers."""
    numbers = [
        f"{key}={value:.5g}" if isinstance(value, float) else f"{key}={value}"
        for key, value in figure.items()
        if key not in ("bench", "figure", "model")
    ]
    return f"{figure['figure']:<15} {figure['model']:<22} " + " ".join(numbers)


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="fabric bench planner", description="Planner figures.")
    parser.add_argument("--json", action="store_true", help="one JSON object a line")
    arguments = parser.parse_args(argv)
    for figure in figures():
        print(json.dumps(figure) if arguments.json else shown(figure), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
