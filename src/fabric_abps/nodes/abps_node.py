#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Serves abps/select and abps/reset; learns from observation and task/event, and switches inside a
task after a decision; keeps what it knows of a person in a file."""

import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import rospy

from fabric_abps import (
    Choice,
    Library,
    Memory,
    Selector,
    SelectorParameters,
    TrainedModels,
    fingerprint,
)
from fabric_abps.library import MODELS
from fabric_msgs.msg import Decision, Observation, PolicyChoice, TaskEvent, TypeBelief
from fabric_msgs.srv import (
    ResetTypes,
    ResetTypesResponse,
    SelectPolicy,
    SelectPolicyRequest,
    SelectPolicyResponse,
    SetModel,
)
from fabric_msgs.traffic import Traffic


class AbpsNode:
    """Messages in, selector, messages out, one after the other.

    While the planner is asked for another policy the next message waits, but not behind the lock:
    the heartbeat goes on, and tells that the message which led to the question is not dealt with.
    """

    def __init__(self, selector: Selector, memory: Memory | None) -> None:
        self._selector, self._memory = selector, memory
        self._person = str(rospy.get_param("~person"))
        self._observed = self._decided = 0  # newest sequences; a decision has that of its cause
        self._traffic = Traffic("abps")
        self._answered = threading.Condition(self._traffic.lock)
        self._asking = False  # the planner; its answer is not there yet
        self._policy = self._traffic.publisher("abps/policy", PolicyChoice, latch=True)
        self._belief = rospy.Publisher("abps/type_belief", TypeBelief, latch=True, queue_size=10)
        self._set_model = rospy.ServiceProxy("planner/set_model", SetModel)
        for topic, kind, callback in (
            ("observation", Observation, self._on_observation),
            ("decision", Decision, self._on_decision),
            ("task/event", TaskEvent, self._on_event),
        ):
            self._traffic.subscribe(topic, kind, self._in_turn(callback))
        locked = self._traffic.serialised
        rospy.Service("abps/select", SelectPolicy, locked(self._in_turn(self._select)))
        rospy.Service("abps/reset", ResetTypes, locked(self._in_turn(self._reset)))
        locked(self._publish_belief)()

    def _in_turn(self, callback: Callable[[Any], Any]) -> Callable[[Any], Any]:
        """`callback`, to be called with the lock held, after the planner's answer."""

        def waiting(message: Any) -> Any:
            self._answered.wait_for(lambda: not self._asking)
            return callback(message)

        return waiting

    def _on_observation(self, message: Observation) -> None:
        if self._selector.observe(message):
            self._tell_belief()
        self._observed = message.sequence
        self._reconsider()

    def _on_decision(self, message: Decision) -> None:
        self._decided = message.observation_sequence
        self._reconsider()

    def _reconsider(self) -> None:
        """When the newest observation is decided on: the two reach this node in either order."""
        if self._observed != self._decided:
            return
        before, choice = self._selector.choice, self._selector.reconsider()
        if before is None or choice is None:
            return
        refused = self._refused(choice)
        if refused:
            rospy.logerr_throttle(60.0, f"abps: {before.policy} stays: {refused}")
            self._selector.take_back(before)
        else:
            self._publish_choice(choice, choice.reason)

    def _refused(self, choice: Choice) -> str:
        """Ask the planner for a policy; why it does not take it, or nothing.

        A thread of its own asks, and the lock is free until the answer is there.
        """
        answers: list[str] = []

        def ask() -> None:
            answer = self._answer(choice)
            with self._answered:
                answers.append(answer)
                self._answered.notify_all()

        self._asking = True
        threading.Thread(target=ask, daemon=True).start()
        self._answered.wait_for(lambda: answers)
        self._asking = False
        self._answered.notify_all()
        return answers[0]

    def _answer(self, choice: Choice) -> str:
        try:
            response = self._set_model(str(choice.path), True)
        except Exception as error:  # whatever it is: a callback waits for the answer
            return f"planner/set_model failed: {error}"
        return "" if response.accepted else response.reason or "refused"

    def _on_event(self, message: TaskEvent) -> None:
        if self._selector.on_task_event(message):
            self._tell_belief()

    def _select(self, request: SelectPolicyRequest) -> SelectPolicyResponse:
        if self._selector.end_task():
            self._tell_belief()
        choice = self._selector.select(request.task_id, request.seed)
        reason = f"{choice.reason} {self._selector.explain()}".rstrip()
        self._publish_choice(choice, reason)
        return SelectPolicyResponse(True, reason, choice.policy, str(choice.path))

    def _reset(self, _request: object) -> ResetTypesResponse:
        """Forget the person; when ~person names somebody else by now, go on with what is kept."""
        person, before = str(rospy.get_param("~person")), self._selector.state()
        self._selector.reset()
        if person != self._person:
            try:
                self._memory = load_memory(self._selector)
            except (OSError, ValueError) as error:
                self._selector.restore(before)
                return ResetTypesResponse(False, str(error))
            self._person = person
        self._tell_belief()
        seen = self._selector.tasks_seen
        return ResetTypesResponse(True, f"known from {seen} tasks" if seen else "a new person")

    def _publish_choice(self, choice: Choice, reason: str) -> None:
        message = PolicyChoice(
            task_id=choice.task_id,
            policy=choice.policy,
            reason=reason,
            candidates=choice.candidates,
            score=choice.score.tolist(),
            expected_reward=choice.expected_reward.tolist(),
            unlike_anyone_known=choice.unlike_anyone_known,
        )
        message.header.stamp = rospy.Time.now()
        self._policy.publish(message)

    def _tell_belief(self) -> None:
        """Keep it first: what was published survives a crash."""
        if self._memory is not None:
            try:
                self._memory.save(self._selector)
            except OSError as error:
                rospy.logerr_throttle(60.0, f"abps: the person is not kept: {error}")
        self._publish_belief()

    def _publish_belief(self) -> None:
        belief = self._selector.belief
        message = TypeBelief(
            task_id=self._selector.choice.task_id if self._selector.choice else 0,
            types=belief.types,
            probability=belief.probability.tolist(),
            entropy=belief.entropy,
        )
        message.header.stamp = rospy.Time.now()
        self._belief.publish(message)


def models_file() -> Path:
    """What was trained on the library; it lies in its folder."""
    return Path(rospy.get_param("~library")) / MODELS


def load_selector() -> Selector:
    """From the private parameters library (a folder), scenario and selector."""
    library = Library.load(rospy.get_param("~library"), rospy.get_param("~scenario"))
    models = TrainedModels.load(models_file())
    return Selector(library, models, SelectorParameters.load(rospy.get_param("~selector")))


def load_memory(selector: Selector) -> Memory | None:
    """From the private parameters person and memory; none when person is empty."""
    person = str(rospy.get_param("~person"))
    if not person:
        return None
    models = fingerprint(models_file())
    memory = Memory(rospy.get_param("~memory"), person, selector.library.scenario, models)
    if memory.load(selector):
        rospy.loginfo(f"abps: {person} is known from {selector.tasks_seen} tasks")
    return memory


def main() -> None:
    rospy.init_node("abps")
    try:
        selector = load_selector()
        memory = load_memory(selector)
    except KeyError as error:
        sys.exit(f"abps: parameter {error.args[0]} is missing")
    except (OSError, ValueError, TypeError) as error:
        sys.exit(f"abps: {error}")
    AbpsNode(selector, memory)
    rospy.spin()


if __name__ == "__main__":
    main()
