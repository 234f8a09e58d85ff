# SPDX-License-Identifier: BSD-3-Clause
"""Figures of the exact planner: beliefs, decisions, bounds and deadlines on tabular models."""

import statistics
import time
from collections.abc import Iterator

import numpy as np

import fabric_planner as fp
from fabric_planner.bench_baselines import NumpyFilter, PlainPomcp, value_iteration
from fabric_planner.bench_record import Figure, beside, cpu_seconds, figure, median_cpu

UPDATES = 100_000
DEADLINES = (1e-3, 5e-3, 20e-3)  # s
ON_BASE = "on base"  # the model that the reference figures were measured on, whatever ours is
AMPLE = 1e6  # s: a deadline that never ends a search
POMCP_TRIALS = 20_000
COLD = fp.PlannerOptions(deadline=0.01, preparation=fp.Preparation.QUICK)


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


def random_run(model: fp.Pomdp, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Random actions and the observations they bring, starting again where an episode ends."""
    rng = np.random.default_rng(seed)
    transition, emission = model.transition.cumsum(axis=2), model.observation.cumsum(axis=2)
    start, ends = int(np.argmax(model.initial_belief)), model.terminal & ~model.terminal.all()
    actions = rng.integers(model.n_actions, size=count)
    observations = np.zeros(count, dtype=int)
    state = start
    for i, action in enumerate(actions):
        state = draw(transition[action, start if ends[state] else state], rng)
        observations[i] = draw(emission[action, state], rng)
    return actions, observations


def draw(cumulative: np.ndarray, rng: np.random.Generator) -> int:
    last = len(cumulative) - 1
    return min(int(np.searchsorted(cumulative, rng.random(), side="right")), last)


def met_beliefs(model: fp.Pomdp, count: int, seed: int) -> list[np.ndarray]:
    """Beliefs met by an observer of random_run(), who starts afresh with every episode."""
    belief_filter, beliefs = fp.BeliefFilter(model), []
    over = model.terminal & ~model.terminal.all()
    for action, observation in zip(*random_run(model, count, seed), strict=True):
        if belief_filter.belief[over].sum() > 0.5:
            belief_filter.reset()
        beliefs.append(belief_filter.belief)
        belief_filter.update(int(action), int(observation))
    return beliefs


class Solutions:
    """Solutions of models, each found once."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self.found: dict[int, fp.Solution] = {}

    def of(self, model: fp.Pomdp) -> fp.Solution:
        if id(model) not in self.found:
            self.found[id(model)] = fp.solve(model, time=self.seconds, gap=0.0)
        return self.found[id(model)]


def belief_update(model: fp.Pomdp) -> Iterator[Figure]:
    """One exact update, beside the same in NumPy."""
    actions, observations = random_run(model, 2000, seed=1)
    belief_filter = fp.BeliefFilter(model)
    repeats = UPDATES // len(actions)
    many, seen = np.tile(actions, repeats), np.tile(observations, repeats)
    ours = median_cpu(lambda: belief_filter.update_many(many, seen), 5) / len(many)
    plain = NumpyFilter(model)

    def with_numpy() -> None:
        for action, observation in zip(actions, observations, strict=True):
            plain.update(action, observation)

    result = figure(
        "belief_update", model.name, 1e6 * ours, "us", at_most=0.2, reference=2900.0,
        reference_at=ON_BASE, states=model.n_states,
    )  # fmt: skip
    yield beside(result, "numpy", 1e6 * median_cpu(with_numpy, 3) / len(actions))


def deadline_overrun(model: fp.Pomdp, decisions: int) -> Iterator[Figure]:
    """By how much decisions overrun their deadline in the thread's own time: p99 of those that
    the deadline ended. Wall time is told beside it; other processes have a share in that."""
    beliefs = met_beliefs(model, decisions, seed=2)
    for deadline in DEADLINES:
        options = fp.PlannerOptions(deadline=deadline, gap=0.0, max_nodes=200_000)
        planner = fp.OnlinePlanner(model, options)
        own, wall = [], []
        for belief in beliefs:
            begin = time.thread_time()
            decision = planner.decide(belief)
            if decision.ended_by == fp.EndedBy.DEADLINE:
                own.append(max(0.0, time.thread_time() - begin - deadline))
                wall.append(decision.planning_time - deadline)
        yield _overrun(model.name, deadline, own, wall)


def _overrun(name: str, deadline: float, own: list[float], wall: list[float]) -> Figure:
    worst = 1e3 * float(np.percentile(own, 99)) if own else None
    return figure(
        "deadline_overrun", name, worst, "ms", at_most=1e3 * max(0.01 * deadline, 1e-4),
        reference=1e3 * 0.28 * deadline, reference_at="(28 % of it)",
        detail=f"at {1e3 * deadline:g} ms", ended_by_deadline=len(own),
        wall_p99_ms=1e3 * float(np.percentile(wall, 99)) if wall else None,
    )  # fmt: skip


def warm_decision(
    model: fp.Pomdp, reference: fp.AlphaVectors, episodes: int, cv_target: float | None
) -> Iterator[Figure]:
    """CPU time of a decision that looks one step ahead, and what such decisions are worth; then
    the same without looking ahead.

    Without a target of its own `cv` is held against the reference policy, whose value at the
    initial belief it must reach within two standard errors.
    """
    q, belief = value_iteration(model), np.array(model.initial_belief)
    plain = statistics.median(cpu_seconds(lambda: (q @ belief).argmax()) for _ in range(1000))
    qmdp = fp.AlphaVectors(q, list(range(model.n_actions)))
    plain_cv = fp.evaluate(model, qmdp, episodes=episodes, seed=1, reference=reference).cv
    for nodes, detail in ((1, "one step ahead"), (0, "policy alone")):
        options = fp.PlannerOptions(AMPLE, 0.0, nodes, fp.Preparation.QUICK)
        planner = fp.OnlinePlanner(model, options)
        found = fp.evaluate(model, planner, episodes=episodes, seed=1, reference=reference)
        time_taken = figure(
            "warm_decision", model.name, 1e6 * found.median_decision_time, "us", at_most=20.0,
            reference=1.578e6, reference_at=ON_BASE, detail=detail, decisions=found.decisions,
        )  # fmt: skip
        yield beside(time_taken, "QMDP in numpy", 1e6 * plain)
        promised = reference.value(belief) - 2.0 * found.cv_standard_error
        worth = figure(
            "policy_cv", model.name, found.cv, "reward", detail=detail,
            at_least=promised if cv_target is None else cv_target, episodes=episodes,
            standard_error=found.cv_standard_error, mean_return=found.mean_return,
            return_standard_error=found.standard_error,
        )  # fmt: skip
        yield beside(worth, "QMDP in numpy", plain_cv)


def cold(path: str) -> Iterator[Figure]:
    """From the file to the first action, five times afresh."""
    model = fp.load(path)

    def ours() -> None:
        loaded = fp.load(path)
        fp.OnlinePlanner(loaded, COLD).decide(loaded.initial_belief)

    def plain() -> None:
        loaded = fp.load(path)
        (value_iteration(loaded) @ loaded.initial_belief).argmax()

    result = figure(
        "cold", model.name, 1e3 * median_cpu(ours, 5), "ms", at_most=50.0, reference=1600.0,
        reference_at=ON_BASE, detail="load, solve, first action",
    )  # fmt: skip
    yield beside(result, "load, value iteration in numpy", 1e3 * median_cpu(plain, 3))


def bounds_in_time(
    model: fp.Pomdp, solution: fp.Solution, lower_target: float | None
) -> Iterator[Figure]:
    """How soon the lower bound is good, and how far the bounds are apart then.

    Without a target of its own the lower bound has to come within 0.5 % of its last value.
    """
    history = solution.history[:, [0, 2, 3]]
    last = history[-1]
    wanted = last[1] - 5e-3 * abs(last[1]) if lower_target is None else lower_target
    reached = history[history[:, 1] >= wanted - 1e-9, 0]
    yield figure(
        "lower_bound_time", model.name, float(reached[0]) if len(reached) else None, "s",
        at_most=0.2, reference=60.0, reference_at=ON_BASE, detail=f"to {wanted:.5g}",
        lower_after_0_2_s=_at(history, 0.2)[1], history=_thinned(history).tolist(),
    )  # fmt: skip
    for seconds, target in ((1.0, 4.0), (10.0, 2.0)):
        if seconds > 2.0 * last[0] and seconds > 1.0:
            continue
        _, lower, upper = _at(history, seconds)
        yield figure(
            "certified_gap", model.name, 100.0 * (upper - lower) / max(abs(lower), 1e-9), "%",
            at_most=target, reference=6.8, reference_at=f"after 60 s {ON_BASE}",
            detail=f"after {seconds:g} s", lower=lower, upper=upper,
        )  # fmt: skip


def _at(history: np.ndarray, seconds: float) -> list[float]:
    """Time, lower and upper bound as they were then."""
    then = max(0, int(np.searchsorted(history[:, 0], seconds, side="right")) - 1)
    return [float(number) for number in history[then]]


def _thinned(history: np.ndarray, rows: int = 40) -> np.ndarray:
    return history[np.unique(np.linspace(0, len(history) - 1, rows).astype(int))]


def pomcp_trials(model: fp.Pomdp) -> Iterator[Figure]:
    """Simulations a second of POMCP on the model, beside the same in plain Python."""
    compiled = fp.compile_model(model)
    options = fp.PomcpOptions(deadline=AMPLE, max_simulations=POMCP_TRIALS)
    planner, belief = fp.Pomcp(compiled, options), fp.make_belief(compiled, seed=1)
    ours = POMCP_TRIALS / median_cpu(lambda: planner.decide(belief), 5)
    low, high = float(np.min(model.reward)), float(np.max(model.reward))
    plain = PlainPomcp(model, exploration=high - low, seed=1)
    trials = POMCP_TRIALS // 10
    initial = np.array(model.initial_belief)
    slow = trials / median_cpu(lambda: plain.search(initial, trials), 3)
    result = figure("pomcp_trials", model.name, ours, "/s", reference=134_000.0,
                    reference_at=ON_BASE)  # fmt: skip
    yield beside(result, "plain Python", slow)
