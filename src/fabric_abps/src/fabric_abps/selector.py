# SPDX-License-Identifier: BSD-3-Clause
"""Algorithm 1: select a policy, watch the task, update the belief, select again."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fabric_abps.belief import TypeBelief
from fabric_abps.change import ChangeDetector
from fabric_abps.criteria import make_criterion
from fabric_abps.evidence import TaskEvidence
from fabric_abps.explain import Explanation, in_words, moves
from fabric_abps.familiarity import Familiarity
from fabric_abps.kept import whole
from fabric_abps.library import Library
from fabric_abps.models import TrainedModels
from fabric_abps.parameters import SelectorParameters
from fabric_msgs.msg import Observation, TaskEvent

PERCEPTS = (
    Observation.TRIGGER_ACTION_CHANGE,
    Observation.TRIGGER_WARNING,
    Observation.TRIGGER_TIMEOUT,
)  # an observation with one of these is alone in its moment


@dataclass(frozen=True)
class Choice:
    """The policy for a task, or for the rest of one, and why."""

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
        parameters: SelectorParameters | None = None,
    ) -> None:
        """Raises ModelsError when the models were not trained on this library."""
        models.check(library)
        parameters = parameters or SelectorParameters()
        self.library = library
        self.models = models
        self.parameters = parameters
        self.belief = TypeBelief(models.types, parameters.forgetting, parameters.floor)
        self.familiarity = Familiarity(parameters.alarm_rate, parameters.alarm_window)
        self._change = ChangeDetector(
            len(models.types), parameters.change_rate, parameters.change_window
        )
        self._criterion = make_criterion(
            parameters.criterion, library.names, parameters.fixed_policy
        )
        self.reset()

    def reset(self) -> None:
        """A new person: forget everything, start from the base policy again."""
        self.belief.reset()
        self.familiarity.reset()
        self._change.reset()
        self._criterion.reset()
        self.tasks_seen = 0
        self.choice: Choice | None = None
        self._changed = False  # with the last task, somebody else seems to have come
        self._learnt_from, self._before = TaskEvidence(0), self.belief.probability
        self._start_task(0)

    def tell(self, utility: ArrayLike) -> None:
        """Tell an oracle what each policy earns with this person, (n_policies,) points."""
        self._criterion.tell(utility)

    def select(self, task_id: int, seed: int) -> Choice:
        """Line 4: the policy of a task; the seed matters for criteria that draw."""
        self.end_task()
        self._rng = np.random.default_rng([seed, task_id])
        beta = self.belief.probability
        score, expected, i = self._score(beta)
        new_person = self.tasks_seen == 0 and self._criterion.starts_from_base
        if new_person:
            i = self.library.names.index(self.library.base)
            why = f"A new person: starting with the base policy {self.library.base}."
        else:
            why = self._why(i, beta, score, expected)
        self._start_task(i)
        return self._choose(task_id, i, why, score, expected)

    def observe(self, observation: Any) -> bool:
        """Line 7: take note of an Observation of the selected task; True when this ended it."""
        if self.choice is None or observation.task_id != self.choice.task_id or self._ended:
            return False
        self._evidence.observe(observation)
        self._alone = observation.trigger in PERCEPTS
        self._final_observation |= observation.task_success or observation.task_failure
        return self._end_when_complete()

    def reconsider(self) -> Choice | None:
        """Call after the decision on an observation: another policy for the rest of the task, in
        force from the next observation on, or None.

        Only with `switch_inside`, when the criterion's favourite under what is believed by now
        promises `switch_margin` more than the present policy. A criterion that draws would change
        with the dice, so it stays. Not after observations of containers: several of these can
        come in one moment, and which of them a switch precedes must not depend on the network.
        """
        if not self._may_switch():
            return None
        assert self.choice is not None
        log_likelihood, weight = self._looks()
        beta = self.belief.foresee(weight * log_likelihood)
        score, expected, i = self._score(beta)
        present = self.library.names.index(self.choice.policy)
        gain = expected[i] - expected[present]
        if i == present or gain < self.parameters.switch_margin:
            return None
        self._evidence.switch(i)
        why = f"Switching inside the task, {gain:.2f} points better than {self.choice.policy}. "
        why += self._why(i, beta, score, expected)
        return self._choose(self.choice.task_id, i, why, score, expected)

    def take_back(self, before: Choice) -> None:
        """The planner refused what `reconsider` chose: the policy of before stays in force."""
        self.choice = before
        self._evidence.switch(self.library.names.index(before.policy))

    def on_task_event(self, event: Any) -> bool:
        """Take note of a TaskEvent; True when this ended the task and the belief has moved.

        The final event and the final observation reach a node in either order, so a task ends
        with the later of the two. An aborted task says nothing about the person.
        """
        if self.choice is None or event.task_id != self.choice.task_id or self._ended:
            return False
        if event.kind == TaskEvent.TASK_ABORTED:
            self._ended = True
        self._final_event |= event.kind in (TaskEvent.TASK_SUCCEEDED, TaskEvent.TASK_FAILED)
        return self._end_when_complete()

    def end_task(self, utility: float | None = None) -> bool:
        """Line 8: update the belief by what the task looked like; True when there was anything.

        utility: what the task earned, points, for a criterion that learns from rewards; it may
        also come after the belief has moved.
        """
        if self.choice is None:
            return False
        if utility is not None and not self._rewarded:
            self._rewarded = True
            self._criterion.learn(self.library.names.index(self.choice.policy), utility)
        if self._ended or self._evidence.count == 0:
            return False
        self._ended = True
        self._learn()
        return True

    def explain(self) -> Explanation:
        """Why the last choice was made and what moved the belief in the last task."""
        ranking: list[tuple[str, float, float]] = []
        if self.choice is not None:
            order = np.argsort(-self.choice.score, kind="stable")
            columns = (self.choice.candidates, self.choice.score, self.choice.expected_reward)
            ranking = [tuple(column[i] for column in columns) for i in order]
        told = moves(
            self._learnt_from,
            self.models.observation,
            self.parameters.effective_observations,
            self.belief.types,
            self._before,
            self.belief.probability,
        )
        flag = self.familiarity
        return Explanation(
            tuple(ranking), told, flag.typicality, flag.alarm, flag.rate, self._changed
        )

    @property
    def typicality(self) -> float:
        """Probability that the best fitting type looks this strange in the latest tasks, [0, 1]."""
        return self.familiarity.typicality

    @property
    def unlike_anyone_known(self) -> bool:
        """The predictive check: true for a known person with probability alarm_rate at most."""
        return self.familiarity.alarm

    def state(self) -> dict:
        """What is known of the person between two tasks, as plain lists, numbers and text."""
        return {
            "types": self.belief.types,
            "tasks_seen": self.tasks_seen,
            "log_belief": self.belief.log_probability.tolist(),
            "p_values": self.familiarity.state(),
            "change": self._change.state(),
            "criterion": self.parameters.criterion,
            "criterion_memory": self._criterion.memory,
        }

    def restore(self, state: dict) -> None:
        """Go on with the person of a `state`, between two tasks.

        Raises ValueError, KeyError, TypeError or OverflowError when it does not fit; the selector
        is as after `reset` then.
        """
        self.reset()
        if state["types"] != self.belief.types:
            raise ValueError("types: are not those that the models know")
        try:
            self.familiarity.restore(state["p_values"], len(self.belief.types))
            self._change.restore(state["change"])
            if state["criterion"] == self.parameters.criterion:
                self._criterion.memory = state["criterion_memory"]
            tasks_seen = whole("tasks_seen", state["tasks_seen"])
            self.belief.log_probability = state["log_belief"]
        except (ValueError, KeyError, TypeError, OverflowError):
            self.reset()
            raise
        self.tasks_seen = tasks_seen

    def _start_task(self, policy: int) -> None:
        self._evidence = TaskEvidence(policy)
        self._alone = self._final_observation = self._final_event = False
        self._ended = self._rewarded = False

    def _score(self, beta: NDArray) -> tuple[NDArray, NDArray, int]:
        """Score and expected reward of every policy, (n_policies,), and the criterion's pick."""
        performance = self.models.performance
        score = self._criterion.score(beta, performance, self._rng)
        expected = performance.expected(beta)
        return score, expected, self._criterion.pick(score, expected, self._rng)

    def _choose(self, task_id: int, i: int, why: str, score: NDArray, expected: NDArray) -> Choice:
        policy = self.library.policies[i]
        self.choice = Choice(
            task_id=task_id,
            policy=policy.name,
            path=policy.path,
            reason=why,
            candidates=self.library.names,
            score=score,
            expected_reward=expected,
            unlike_anyone_known=self.unlike_anyone_known,
        )
        return self.choice

    def _may_switch(self) -> bool:
        return (
            self.parameters.switch_inside
            and self.choice is not None
            and self._alone
            and not (self._ended or self._final_event or self._criterion.draws)
        )

    def _end_when_complete(self) -> bool:
        return self._final_observation and self._final_event and self.end_task()

    def _looks(self) -> tuple[NDArray, float]:
        """ln P(sigma | tau, pi), (n_types,) nats, and the share of it that the belief takes."""
        weight = self._evidence.weight(self.parameters.effective_observations)
        return self._evidence.log_likelihood(self.models.observation), weight

    def _learn(self) -> None:
        """Eq. 5.1; after an alarm of the change detection the person begins with the change.

        That test takes the whole log-likelihood: it weighs people against each other who are
        mixtures of types, and needs no guard against being too sure of one.
        """
        log_likelihood, weight = self._looks()
        self._learnt_from, self._before = self._evidence, self.belief.probability
        self.belief.update(weight * log_likelihood)
        self.tasks_seen += 1
        self._changed = self._change.update(log_likelihood, weight)
        if self._changed:
            self.belief.reset()
            self.belief.update(self._change.evidence)
            self.familiarity.reset()
            self.tasks_seen = self._change.tasks
        p_values = self._evidence.p_values(self.models.observation)
        if p_values is not None:
            self.familiarity.take(p_values)

    def _why(self, i: int, beta: NDArray, score: NDArray, expected: NDArray) -> str:
        tau = self.belief.types[int(np.argmax(beta))]
        share = math.floor(100.0 * beta.max() + 0.5)
        words = self._criterion.words(i, score, expected)
        person = f"the person is most like {in_words(tau)} ({share} %)"
        text = f"{self.library.names[i]}: {words}; {person}."
        if self.unlike_anyone_known:
            text += (
                f" But the person is unlike anyone known (p = {self.typicality:.1g}; a known one "
                f"looks so in {100 * self.parameters.alarm_rate:g} % of cases at most)."
            )
        return text
