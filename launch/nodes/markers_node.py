#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Publishes `markers` at 10 Hz; also while the simulated clock stands still."""

import threading
import time

import rospy
from std_msgs.msg import Header
from visualization_msgs.msg import MarkerArray

from fabric_bringup import layout, scene

PERIOD = 0.1  # s


def main() -> None:
    rospy.init_node("markers_node")
    picture = scene.Scene(layout.load(rospy.get_param("~cell")))
    lock = threading.Lock()

    def take(message: object, topic: str) -> None:
        with lock:
            picture.take(topic, message)

    def warn(_: Header) -> None:
        with lock:
            picture.warn(time.monotonic())

    for topic, kind in scene.TOPICS.items():
        rospy.Subscriber(topic, kind, take, callback_args=topic, queue_size=1)
    rospy.Subscriber("human/warning", Header, warn, queue_size=1)
    publisher = rospy.Publisher("markers", MarkerArray, queue_size=1)

    stop = threading.Event()
    rospy.on_shutdown(stop.set)
    while not stop.wait(PERIOD):
        if publisher.get_num_connections() == 0:
            continue
        with lock:
            array = MarkerArray(picture.markers(time.monotonic()))
        publisher.publish(array)


if __name__ == "__main__":
    main()
