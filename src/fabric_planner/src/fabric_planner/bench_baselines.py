# SPDX-License-Identifier: BSD-3-Clause
"""The plain way to do what the planner does, measured beside it in the same run."""

import math
import random
from bisect import bisect_right
from itertools import accumulate

import numpy as np

import fabric_planner as fp


class NumpyFilter:
    """Bayes' rule in NumPy; an impossible observation starts again from the initial belief."""

    def __init__(self, model: fp.Pomdp) -> None:
        self.transition, self.observation = model.transition, model.observation
        self.initial = np.array(model.initial_belief)
        self.belief = self.initial

    def update(self, action: int, observation: int) -> None:
        joint = (self.belief @ self.transition[action]) * self.observation[action][:, observation]
        total = joint.sum()
        self.belief = joint / total if total > 0.0 else self.initial


def value_iteration(model: fp.Pomdp, tolerance: float = 1e-6, rounds: int = 20_000) -> np.ndarray:
    """Q of the fully observable problem, (A, S): Q(a,s) = R(a,s) + gamma sum_s' T max_a' Q(a',s').

    Ends when no value moves by more than `tolerance`, or after `rounds`.
    """
    transition, reward, gamma = model.transition, np.array(model.reward), model.discount
    values = np.zeros(model.n_states)
    for _ in range(rounds):
        q = reward + gamma * transition @ values
        change = np.abs(q.max(axis=0) - values).max()
        values = q.max(axis=0)
        if change <= tolerance:
            break
    return q


class _Node:
    """A history in the tree of PlainPomcp: visits and mean return of each action."""

    __slots__ = ("children", "counts", "values", "visits")

    def __init__(self, actions: int) -> None:
        self.visits = 0
        self.counts = [0] * actions
        self.values = [0.0] * actions
        self.children: dict[tuple[int, int], _Node] = {}


class PlainPomcp:
    """POMCP (Silver & Veness 2010) over a table, in Python without NumPy in its loops.

    UCB1 at every history, one new node a trial, random actions below it.
    """

    def __init__(self, model: fp.Pomdp, exploration: float, seed: int, depth: int = 60) -> None:
        self.random = random.Random(seed)
        self.actions, self.discount = model.n_actions, model.discount
        self.exploration, self.depth = exploration, depth
        self.moves = [_cumulated(rows) for rows in model.transition]
        self.signs = [_cumulated(rows) for rows in model.observation]
        self.rewards = np.array(model.reward).tolist()
        self.ends = model.terminal.tolist()
        self.root = _Node(self.actions)

    def search(self, belief: np.ndarray, trials: int) -> int:
        """The best action after `trials` simulations from draws of the belief (S,)."""
        start = list(accumulate(belief))
        self.root = _Node(self.actions)
        for _ in range(trials):
            self._simulate(self._draw(start), self.root, 0)
        return max(range(self.actions), key=self.root.values.__getitem__)

    def _draw(self, cumulated: list[float]) -> int:
        return min(bisect_right(cumulated, self.random.random()), len(cumulated) - 1)

    def _step(self, state: int, action: int) -> tuple[int, int, float]:
        after = self._draw(self.moves[action][state])
        return after, self._draw(self.signs[action][after]), self.rewards[action][state]

    def _choose(self, node: _Node) -> int:
        if 0 in node.counts:
            return node.counts.index(0)
        log = math.log(node.visits)
        return max(
            range(self.actions),
            key=lambda a: node.values[a] + self.exploration * math.sqrt(log / node.counts[a]),
        )

    def _simulate(self, state: int, node: _Node, depth: int) -> float:
        if depth >= self.depth or self.ends[state]:
            return 0.0
        action = self._choose(node)
        after, observation, reward = self._step(state, action)
        child = node.children.get((action, observation))
        if child is None:
            node.children[action, observation] = _Node(self.actions)
            future = self._rollout(after, depth + 1)
        else:
            future = self._simulate(after, child, depth + 1)
        total = reward + self.discount * future
        node.visits += 1
        node.counts[action] += 1
        node.values[action] += (total - node.values[action]) / node.counts[action]
        return total

    def _rollout(self, state: int, depth: int) -> float:
        total, weight = 0.0, 1.0
        while depth < self.depth and not self.ends[state]:
            action = self.random.randrange(self.actions)
            state, _, reward = self._step(state, action)
            total += weight * reward
            weight *= self.discount
            depth += 1
        return total


def _cumulated(rows: np.ndarray) -> list[list[float]]:
    return rows.cumsum(axis=1).tolist()
