#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Serves abps/select and abps/reset; learns from observation and task/event."""

import sys

import rospy

from fabric_abps import Choice, Library, Selector, SelectorParameters, TrainedModels
from fabric_msgs.msg import Observation, PolicyChoice, TaskEvent, TypeBelief
from fabric_msgs.srv import (
    ResetTypes,
    ResetTypesResponse,
    SelectPolicy,
    SelectPolicyRequest,
    SelectPolicyResponse,
)
from fabric_msgs.traffic import Traffic


class AbpsNode:
    """Messages in, selector, messages out."""

    def __init__(self, selector: Selector) -> None:
        self._selector = selector
        self._traffic = Traffic("abps")
        self._policy = self._traffic.publisher("abps/policy", PolicyChoice, latch=True)
        self._belief = rospy.Publisher("abps/type_belief", TypeBelief, latch=True, queue_size=10)
        self._traffic.subscribe("observation", Observation, self._on_observation)
        self._traffic.subscribe("task/event", TaskEvent, self._on_event)
        locked = self._traffic.serialised
        rospy.Service("abps/select", SelectPolicy, locked(self._select))
        rospy.Service("abps/reset", ResetTypes, locked(self._reset))
        locked(self._publish_belief)()

    def _on_observation(self, message: Observation) -> None:
        if self._selector.observe(message):
            self._publish_belief()

    def _on_event(self, message: TaskEvent) -> None:
        if self._selector.on_task_event(message):
            self._publish_belief()

    def _select(self, request: SelectPolicyRequest) -> SelectPolicyResponse:
        if self._selector.end_task():
            self._publish_belief()
        choice = self._selector.select(request.task_id, request.seed)
        self._publish_choice(choice)
        return SelectPolicyResponse(True, choice.reason, choice.policy, str(choice.path))

    def _reset(self, _request: object) -> ResetTypesResponse:
        self._selector.reset()
        self._publish_belief()
        return ResetTypesResponse(True, "a new person: all types are as likely as at the start")

    def _publish_choice(self, choice: Choice) -> None:
        message = PolicyChoice(
            task_id=choice.task_id,
            policy=choice.policy,
            reason=choice.reason,
            candidates=choice.candidates,
            score=choice.score.tolist(),
            expected_reward=choice.expected_reward.tolist(),
            unlike_anyone_known=choice.unlike_anyone_known,
        )
        message.header.stamp = rospy.Time.now()
        self._policy.publish(message)

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


def load_selector() -> Selector:
    """From the private parameters library, scenario, models and selector."""
    library = Library.load(rospy.get_param("~library"), rospy.get_param("~scenario"))
    models = TrainedModels.load(rospy.get_param("~models"))
    return Selector(library, models, SelectorParameters.load(rospy.get_param("~selector")))


def main() -> None:
    rospy.init_node("abps")
    try:
        selector = load_selector()
    except KeyError as error:
        sys.exit(f"abps: parameter {error.args[0]} is missing")
    except (ValueError, TypeError) as error:
        sys.exit(f"abps: {error}")
    AbpsNode(selector)
    rospy.spin()


if __name__ == "__main__":
    main()
