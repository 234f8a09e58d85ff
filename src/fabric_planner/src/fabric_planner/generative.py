# SPDX-License-Identifier: BSD-3-Clause
"""Planning with generative models: those in C++ and those written in Python."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fabric_planner import _core


class GenerativeModel:
    """A model of any size, by what it does in one step. Subclass it.

    Set `n_actions`, `discount` in (0, 1) and `reward_range` (low, high), define `initial_state`
    and `step`, and whatever of the following is known; none of them exists unless defined:

    * `action_names`: list of n_actions strings
    * `observation_probability(next_state, action, observation)`: P(o | a, s'); without it beliefs
      keep the particles that give the observation themselves
    * `upper_bound(state)`: at least the optimal value; or sharper `action_upper_bounds(state)`,
      n_actions numbers, each at least the value of taking the action and the best after it
    * `default_action(states)`: what to do when all that is known are these equally likely states;
      its simulation is Despot's lower bound
    * `lower_bound_at_horizon(state)`: at most what the default policy earns from there
    * `legal(state, action)`: may the action be taken?

    States and observations are any hashable values. Two equal states are one. A step in Python is
    at least ten times slower than one in C++, since each call takes the interpreter's lock; give
    Despot fewer scenarios. What a method raises reaches the caller of the planner.
    """

    n_actions: int
    discount: float
    reward_range: tuple[float, float]

    def initial_state(self, random: _core.Random) -> Hashable:
        """A draw from the initial belief; all chance comes from `random`."""
        raise NotImplementedError("initial_state")

    def step(self, state: Any, action: int, u: float) -> tuple[Hashable, float, Hashable, bool]:
        """(next state, reward, observation, terminal): a function of the arguments, u in [0, 1).

        A step that needs several random numbers takes them from `fp.random_of(u)`.
        """
        raise NotImplementedError("step")


Model = GenerativeModel | _core.CompiledModel | _core.Pomdp
Options = _core.DespotOptions | _core.PomcpOptions


def compile_model(model: Model) -> _core.CompiledModel:
    """The model as planners see it; the same object at every call for a GenerativeModel.

    A Pomdp is compiled each time: compile it once when it is used more than once.
    """
    if isinstance(model, _core.CompiledModel):
        return model
    if isinstance(model, _core.Pomdp):
        return _core._tabular_model(model)
    if not isinstance(model, GenerativeModel):
        raise TypeError(f"no generative model: {type(model).__name__}")
    compiled = model.__dict__.get("_compiled")
    if compiled is None:
        compiled = _core._python_model(model)
        model._compiled = compiled
    return compiled


def random_of(u: float) -> _core.Random:
    """The stream of random numbers that belongs to u."""
    return _core._random_of(u)


class _Belief:
    """What is believed about the state of a generative model."""

    def __init__(self, model: Model, inner: _core.GenerativeBelief) -> None:
        self._model = model  # a Python model lives as long as what calls it
        self._inner = inner

    def reset(self, seed: int) -> None:
        """Back to the initial belief."""
        self._inner.reset(seed)

    def update(self, action: int, observation: Hashable) -> _core.UpdateStatus:
        """Conditions on what was done and seen. An impossible observation gives RECOVERED."""
        return self._inner.update(action, observation)

    def sample(self, count: int, seed: int) -> list[Any]:
        """A list of `count` states, spread evenly over the belief."""
        return self._inner.sample(count, seed)

    @property
    def recoveries(self) -> int:
        """Updates since the last reset that needed the recovery."""
        return self._inner.recoveries


class ParticleBelief(_Belief):
    """A belief as a cloud of equally likely states, at the model's initial belief."""

    def __init__(
        self, model: Model, seed: int, particles: int = 5000, recovery_tries: int = 10
    ) -> None:
        inner = compile_model(model)._make_particles(seed, particles, recovery_tries)
        super().__init__(model, inner)


def make_belief(model: Model, seed: int) -> _Belief:
    """The model's own belief, exact for most examples and every Pomdp, else particles."""
    return _Belief(model, compile_model(model)._make_belief(seed))


class _Planner:
    def __init__(self, model: Model, options: Options) -> None:
        self._model = model
        self._inner = compile_model(model)._make_planner(options)
        self.options = options

    def decide(self, belief: _Belief) -> _core.Decision:
        """What to do at the belief. Threads may call; calls wait for one another."""
        return self._inner.decide(belief._inner)

    def reset(self, seed: int) -> None:
        """Starts the random numbers again and forgets what was searched."""
        self._inner.reset(seed)

    @property
    def memory(self) -> int:
        """Bytes of the tree, whether used or not."""
        return self._inner.memory


class Despot(_Planner):
    """Determinised sparse partially observable trees (Ye et al. 2017).

    The bounds of its decisions are those of the scenarios drawn, not certificates.
    """

    def __init__(self, model: Model, options: _core.DespotOptions | None = None) -> None:
        super().__init__(model, options or _core.DespotOptions())


class Pomcp(_Planner):
    """Monte-Carlo tree search over histories (Silver & Veness 2010), the baseline.

    `value` is a mean return; the bounds are infinite.
    """

    def __init__(self, model: Model, options: _core.PomcpOptions | None = None) -> None:
        super().__init__(model, options or _core.PomcpOptions())

    def advance(self, action: int, observation: Hashable) -> None:
        """Keeps the part of the tree below what happened; call it after each step."""
        self._inner.advance(action, observation)


@dataclass(frozen=True)
class Episodes:
    """What happened in simulated episodes, one entry each."""

    returns: np.ndarray  # (episodes,): discounted
    undiscounted: np.ndarray  # (episodes,)
    steps: np.ndarray  # (episodes,)
    terminal: np.ndarray  # (episodes,) of bool; False: max_steps was reached
    recoveries: np.ndarray  # (episodes,): of the belief
    planning_time: np.ndarray  # (all steps,): s of the thread's CPU time
    belief_time: float  # s of CPU time a step, mean
    trials_per_step: float
    memory: int  # bytes of the planner's tree

    @property
    def mean(self) -> float:
        """Mean discounted return."""
        return float(self.returns.mean())

    @property
    def standard_error(self) -> float:
        """Of the mean; nan with one episode."""
        n = len(self.returns)
        return float(self.returns.std(ddof=1) / np.sqrt(n)) if n > 1 else float("nan")


def evaluate_episodes(
    model: Model, options: Options, episodes: int, seed: int, max_steps: int = 90
) -> Episodes:
    """Simulates episodes with the planner of the options and the belief of make_belief().

    Episode i has the seed `seed + i`: the same for every planner that does the same. C++ models
    run without the interpreter's lock, so that threads run side by side.
    """
    runs: Sequence[_core.Episode] = compile_model(model)._evaluate(
        options, episodes, seed, max_steps
    )
    steps = sum(run.steps for run in runs)
    return Episodes(
        returns=np.array([run.discounted for run in runs]),
        undiscounted=np.array([run.undiscounted for run in runs]),
        steps=np.array([run.steps for run in runs]),
        terminal=np.array([run.terminal for run in runs]),
        recoveries=np.array([run.recoveries for run in runs]),
        planning_time=np.concatenate([run.planning_time for run in runs]),
        belief_time=sum(run.belief_time for run in runs) / steps,
        trials_per_step=sum(run.trials for run in runs) / steps,
        memory=options.memory,
    )
