# SPDX-License-Identifier: BSD-3-Clause
"""Pictures from a topic, for calibrating without files. ROS is imported only when it is asked."""

import math
import queue
import time
from typing import Any

import numpy as np

from fabric_perception.images import grey_of


class NoPictures(RuntimeError):
    """A topic that does not send what is needed; the message is a sentence."""


def pictures_of(
    topic: str, count: int, every: float, patience: float
) -> tuple[list[np.ndarray], str]:
    """Return `count` grey pictures of an image topic and their frame.

    every: s, least time between two. patience: s of wall time to wait for each. Raises NoPictures
    or ImageError.
    """
    from sensor_msgs.msg import Image

    messages = _subscribed(topic, Image)
    pictures, frame, next_at = [], "", -math.inf
    while len(pictures) < count:
        message = _next(messages, topic, patience + every)
        stamp = message.header.stamp.to_sec()
        if stamp >= next_at:
            pictures.append(grey_of(message))
            frame, next_at = message.header.frame_id, stamp + every
    return pictures, frame


def camera_info_of(topic: str, patience: float) -> Any:
    """Return one sensor_msgs/CameraInfo of a topic; raises NoPictures."""
    from sensor_msgs.msg import CameraInfo

    return _next(_subscribed(topic, CameraInfo), topic, patience)


def _subscribed(topic: str, kind: Any) -> "queue.Queue[Any]":
    import rosgraph
    import rospy

    if not rosgraph.is_master_online():
        raise NoPictures(f"there is no ROS master at {rosgraph.get_master_uri()}")
    if not rospy.core.is_initialized():
        rospy.init_node("calibrate", anonymous=True, disable_signals=True)
    messages: queue.Queue[Any] = queue.Queue(maxsize=2)
    rospy.Subscriber(topic, kind, lambda message: _keep_newest(messages, message), queue_size=1)
    return messages


def _keep_newest(messages: "queue.Queue[Any]", message: Any) -> None:
    while True:
        try:
            messages.put_nowait(message)
            return
        except queue.Full:
            try:
                messages.get_nowait()
            except queue.Empty:
                continue


def _next(messages: "queue.Queue[Any]", topic: str, patience: float) -> Any:
    began = time.monotonic()
    try:
        return messages.get(timeout=patience)
    except queue.Empty:
        waited = time.monotonic() - began
        raise NoPictures(f"nothing came on {topic} within {waited:.0f} s") from None
