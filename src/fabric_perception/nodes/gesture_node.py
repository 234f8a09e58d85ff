#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""ROS node of gesture recognition: the tracked hand and cubes in, activity and warnings out."""

import rospy
from std_msgs.msg import Header

from fabric_msgs.msg import CubeArray, HandState, HumanActivity
from fabric_msgs.settings import settings_from
from fabric_msgs.traffic import Traffic
from fabric_perception.gestures.model_file import TrainedGestures, load
from fabric_perception.gestures.places import in_cell
from fabric_perception.gestures.recogniser import (
    GesturePercept,
    GestureRecogniser,
    RecogniserParameters,
)
from fabric_perception.pairing import Pair, StampPairing

FRAME = "cell"


class GestureNode:
    """Answers hand and cubes of one stamp with a percept of it, ten a second.

    They come on two connections, either of which may be the faster; the hand waits for its cubes.
    """

    def __init__(self, trained: TrainedGestures, parameters: RecogniserParameters) -> None:
        self._recogniser = GestureRecogniser(trained, parameters)
        self._pairing = StampPairing()
        self._traffic = Traffic("gesture")
        self._activity = self._traffic.publisher("human/activity", HumanActivity)
        self._warning = self._traffic.publisher("human/warning", Header)
        self._traffic.subscribe("cell/cubes", CubeArray, self._on_cubes)
        self._traffic.subscribe("human/hand", HandState, self._on_hand)
        rospy.Timer(
            rospy.Duration(parameters.silence), self._traffic.serialised(self._on_time), reset=True
        )

    def _on_cubes(self, message: CubeArray) -> None:
        self._on_pairs(self._pairing.add_head(message.header.stamp.to_nsec(), message))

    def _on_hand(self, message: HandState) -> None:
        self._on_pairs(self._pairing.add_activity(message.header.stamp.to_nsec(), message))

    def _on_pairs(self, pairs: list[Pair]) -> None:
        for _, hand, cubes in pairs:
            self._take_cubes(cubes)
            self._take_hand(hand)

    def _take_cubes(self, message: CubeArray) -> None:
        try:
            self._recogniser.on_cubes(message.header.stamp.to_sec(), message.cubes)
        except ValueError as error:
            rospy.logwarn_throttle(5.0, f"gesture: cubes are left out: {error}")

    def _take_hand(self, message: HandState) -> None:
        at = message.position
        hand = (at.x, at.y, at.z) if message.visible else None
        try:
            percept = self._recogniser.on_hand(message.header.stamp.to_sec(), hand)
        except ValueError as error:
            rospy.logwarn_throttle(5.0, f"gesture: a hand is left out: {error}")
            return
        self._publish(percept, message.header.stamp)

    def _on_time(self, _: rospy.timer.TimerEvent) -> None:
        now = rospy.Time.now()
        self._publish(self._recogniser.on_silence(now.to_sec()), now)

    def _publish(self, percept: GesturePercept | None, stamp: rospy.Time) -> None:
        if percept is None:
            return
        header = Header(stamp=stamp, frame_id=FRAME)
        if percept.warning:
            self._warning.publish(header)
        posterior = [float(p) for p in percept.posterior]
        self._activity.publish(
            HumanActivity(header, posterior, percept.detected, float(percept.evidence_age))
        )


def main() -> None:
    """Run until shutdown; a model or parameter that is wrong ends the node at once, by its name."""
    rospy.init_node("gesture")
    trained = load(rospy.get_param("~model_file", "") or None)
    cell_file = rospy.get_param("~cell_file", "")
    if cell_file:  # features are relative, so that a model serves in cells of other places too
        trained = trained._replace(features=in_cell(trained.features, cell_file))
    parameters = settings_from(RecogniserParameters, rospy.get_param("~gestures"))
    GestureNode(trained, parameters)
    rospy.spin()


if __name__ == "__main__":
    main()
