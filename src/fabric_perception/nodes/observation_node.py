#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""ROS node of the observation agent: percepts and task events in, numbered observations out."""

from typing import Any

import rospy

from fabric_msgs.msg import HeadState, HumanActivity, Observation, TaskEvent, TaskState
from fabric_msgs.settings import settings_from
from fabric_msgs.traffic import Traffic
from fabric_perception.joint import JointHysteresis
from fabric_perception.observation_agent import ObservationAgent
from fabric_perception.pairing import Pair, StampPairing
from fabric_perception.parameters import ObservationParameters


class ObservationNode:
    """Acts on a percept when the activity and the head of its moment are both there."""

    def __init__(self, parameters: dict[str, Any]) -> None:
        loaded = settings_from(ObservationParameters, parameters)
        self._agent = ObservationAgent(loaded)
        self._pairing = StampPairing(round(loaded.pairing_tolerance * 1e9), _unseen_head)
        self._joint = JointHysteresis(loaded.joint_percepts)
        self._task_id = 0
        self._newest = 0.0  # s, of all stamps of the task
        self._traffic = Traffic("observation")
        self._observations = self._traffic.publisher("observation", Observation)
        self._traffic.subscribe("task/state", TaskState, self._on_state)
        self._traffic.subscribe("task/event", TaskEvent, self._on_event)
        self._traffic.subscribe("human/activity", HumanActivity, self._on_activity)
        self._traffic.subscribe("human/head", HeadState, self._on_head)

    def _on_state(self, state: TaskState) -> None:
        if state.task_id != self._task_id:
            self._task_id, self._newest = state.task_id, 0.0
        self._agent.start_task(self._time_of(state), state)

    def _on_event(self, event: TaskEvent) -> None:
        self._publish(self._agent.on_task_event(self._time_of(event), event))

    def _on_activity(self, message: HumanActivity) -> None:
        self._on_pairs(self._pairing.add_activity(message.header.stamp.to_nsec(), message))

    def _on_head(self, message: HeadState) -> None:
        self._on_pairs(self._pairing.add_head(message.header.stamp.to_nsec(), message))

    def _on_pairs(self, pairs: list[Pair]) -> None:
        for pair in pairs:
            t = self._time_of(pair.activity)
            reading = self._joint.feed(self._agent.read(pair.activity, pair.head))
            self._publish(self._agent.on_reading(t, reading, pair.activity.evidence_age))

    def _time_of(self, message: Any) -> float:
        """The stamp (s), or the newest so far: real sensors do not deliver in order of time."""
        self._newest = max(self._newest, message.header.stamp.to_sec())
        return self._newest

    def _publish(self, observations: list[Observation]) -> None:
        for observation in observations:
            self._observations.publish(observation)


def _unseen_head(stamp: int) -> HeadState:
    """Not seen is unknown, which is not looking away."""
    head = HeadState(visible=False)
    head.header.stamp = rospy.Time(nsecs=stamp)
    return head


def main() -> None:
    """Run until shutdown; bad parameters end the node at once, naming the value."""
    rospy.init_node("observation")
    ObservationNode(rospy.get_param("~observation"))
    rospy.spin()


if __name__ == "__main__":
    main()
