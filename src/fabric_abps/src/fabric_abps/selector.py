# SPDX-License-Identifier: BSD-3-Clause
"""Algorithm 1: select a policy, watch the task, update the belief, select again."""

import math
from collections import deque
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincc

from fabric_abps.belief import TypeBelief
from fabric_abps.criteria import make_criterion
from fabric_abps.library import Library
from fabric_abps.models import TrainedModels
from fabric_abps.signals import SignalEncoder
from fabric_msgs.msg import TaskEvent


@dataclass(frozen=True)
class SelectorParameters:
    """How the selector learns and chooses."""

    criterion: str = "expected_improvement"  # or greedy, thompson, random, fixed
    fixed_policy: str = ""  # only with criterion fixed
    forgetting: float = 0.02  # probability that the person changes before a task, [0, 1)
    floor: float = 1e-4  # least belief in a type, (0, 1/n_types)
    effective_observations: float = 8.0  # a task weighs like at most so many, > 0
    alarm_rate: float = 0.01  # of the flag "unlike anyone known" for a known person, (0, 1)
    alarm_window: int = 3  # tasks the flag looks back on, >= 1

    @classmethod
    def load(cls, values: dict) -> "SelectorParameters":
        """From a dictionary of all fields; raises ValueError naming a missing or unknown one."""
        names = [field.name for field in fields(cls)]
        for name in names:
            if name not in values:
                raise ValueError(f"parameter '{name}' is missing")
        for name in values:
            if name not in names:
                raise ValueError(f"parameter '{name}' is unknown")
        return cls(**values)

    def __post_init__(self) -> None:
        if not self.effective_observations > 0:
            raise ValueError(f"effective_observations must be > 0: {self.effective_observations}")
        if not 0 < self.alarm_rate < 1:
            raise ValueError(f"alarm_rate must be in (0, 1): {self.alarm_rate}")
        if not (isinstance(self.alarm_window, int) and self.alarm_window >= 1):
            raise ValueError(f"alarm_window must be a whole number >= 1: {self.alarm_window}")


@dataclass(frozen=True)
class Choice:
    """The policy for a task and why."""

    task_id: int
    policy: str
    path: Path
    reason: str  # a sentence for people
    candidates: list[str]
    score: NDArray  # (n_policies,), the criterion's
    expected_reward: NDArray  # (n_policies,), belief-weighted mean utility, points
    unlike_anyone_known: bool


class Selector:
    """One person at a time; deterministic given the observations and the seeds."""

    def __init__(
        self,
        library: Library,
        models: TrainedModels,
        parameters: SelectorParameters = SelectorParameters(),
    ) -> None:
        """Raises ModelsError when the models were not trained on this library."""
        models.check(library)
        self.library = library
        self.models = models
        self.parameters = parameters
        self.belief = TypeBelief(models.types, parameters.forgetting, parameters.floor)
        self.choice: Choice | None = None
        self._criterion = make_criterion(
            parameters.criterion, library.names, parameters.fixed_policy
        )
        self.reset()

    def reset(self) -> None:
        """A new person: forget the belief, start from the base policy again."""
        self.belief.reset()
        self.tasks_seen = 0
        self._p_values: deque[NDArray] = deque(maxlen=self.parameters.alarm_window)
        self._start_task()
        self.choice = None

    def select(self, task_id: int, seed: int) -> Choice:
        """Line 4: the policy of a task; the seed matters for criteria that draw."""
        self.end_task()
        beta = self.belief.probability
        rng = np.random.default_rng([seed, task_id])
        score = self._criterion.score(beta, self.models.performance, rng)
        expected = self.models.performance.expected(beta)
        name = self.library.names[_best(score, expected)]
        new_person = self.tasks_seen == 0 and self.parameters.criterion not in ("fixed", "random")
        if new_person:
            name = self.library.base
        self.choice = Choice(
            task_id=task_id,
            policy=name,
            path=self.library[name].path,
            reason=self._reason(name, new_person, score, expected),
            candidates=self.library.names,
            score=score,
            expected_reward=expected,
            unlike_anyone_known=self.unlike_anyone_known,
        )
        self._start_task()
        return self.choice

    def observe(self, observation: Any) -> bool:
        """Line 7: take note of an Observation of the selected task; True when this ended it."""
        if self.choice is None or observation.task_id != self.choice.task_id or self._ended:
            return False
        self._codes.append(self._encoder.encode(observation))
        self._final_observation |= observation.task_success or observation.task_failure
        return self._end_when_complete()

    def on_task_event(self, event: Any) -> bool:
        """Take note of a TaskEvent; True when this ended the task and the belief has moved.

        The final event and the final observation reach a node in either order, so a task ends
        with the later of the two. An aborted task says nothing about the person.
        """
        if self.choice is None or event.task_id != self.choice.task_id or self._ended:
            return False
        if event.kind == TaskEvent.TASK_ABORTED:
            self._codes.clear()
            self._ended = True
        self._final_event |= event.kind in (TaskEvent.TASK_SUCCEEDED, TaskEvent.TASK_FAILED)
        return self._end_when_complete()

    def end_task(self) -> bool:
        """Line 8: update the belief by what the task looked like; True when there was anything."""
        if self._ended or not self._codes or self.choice is None:
            return False
        self._ended = True
        policy = self.library.names.index(self.choice.policy)
        model = self.models.observation
        self._p_values.append(model.p_values(self._codes, policy))
        effective = self.parameters.effective_observations
        self.belief.update(model.log_likelihood(self._codes, policy, effective))
        self.tasks_seen += 1
        return True

    @property
    def typicality(self) -> float:
        """Probability that the best fitting type looks this strange in the latest tasks, [0, 1].

        Fisher's method: -2 sum ln p over w tasks is chi-square with 2 w degrees of freedom for a
        person of that type.
        """
        w = len(self._p_values)
        if w == 0:
            return 1.0
        statistic = -np.log(np.array(self._p_values)).sum(axis=0)
        return float(gammaincc(w, statistic).max())

    @property
    def unlike_anyone_known(self) -> bool:
        """The predictive check: true for a known person with probability alarm_rate at most."""
        return self.typicality < self.parameters.alarm_rate

    def _start_task(self) -> None:
        self._codes: list[int] = []
        self._encoder = SignalEncoder()
        self._final_observation = False
        self._final_event = False
        self._ended = False

    def _end_when_complete(self) -> bool:
        return self._final_observation and self._final_event and self.end_task()

    def _reason(self, name: str, new_person: bool, score: NDArray, expected: NDArray) -> str:
        if new_person:
            return f"A new person: starting with the base policy {name}."
        i = self.library.names.index(name)
        tau = self.belief.most_likely
        share = math.floor(100.0 * self.belief.probability.max() + 0.5)
        words = {
            "expected_improvement": f"{100.0 * score[i]:.0f} % likely to earn more than "
            f"{expected.max():.2f}, the best expected reward",
            "greedy": f"the best expected reward, {expected[i]:.2f}",
            "thompson": f"best in a draw from what is known, {score[i]:.2f}",
            "random": "drawn by lot",
            "fixed": "fixed by configuration",
        }[self.parameters.criterion]
        text = f"{name}: {words}; the person is most like {tau} ({share} %)."
        if self.unlike_anyone_known:
            text += f" But the person is unlike anyone known (p = {self.typicality:.1g})."
        return text


def _best(score: NDArray, expected: NDArray) -> int:
    """Index of the largest score; of equals the one with the larger expected reward, then first."""
    candidates = np.flatnonzero(score >= score.max() - 1e-12)
    return int(candidates[np.argmax(expected[candidates])])
