# SPDX-License-Identifier: BSD-3-Clause
"""How a node learns of its camera: calibration messages and static frames, counted when used."""

from collections.abc import Callable

import rospy
import tf2_ros
from sensor_msgs.msg import CameraInfo
from tf2_msgs.msg import TFMessage

from fabric_msgs.traffic import Traffic
from fabric_perception.camera import Camera
from fabric_perception.camera_poses import PARENT
from fabric_perception.picture_input import CameraSource


class CameraListener:
    """Follows the `CameraInfo` of one topic and where its frame is; `on_change` forgets the old.

    A calibration counts as handled in `traffic` when it is known, too, where the camera is.
    """

    def __init__(self, traffic: Traffic, topic: str, on_change: Callable[[], None]) -> None:
        self._traffic, self._topic, self._on_change = traffic, topic, on_change
        self._infos = 0
        frames = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(frames)
        self._source = CameraSource(
            rospy.resolve_name(topic),
            lambda frame: frames.lookup_transform(PARENT, frame, rospy.Time()),
            tf2_ros.TransformException,
        )
        traffic.declare_handled(topic)
        locked = traffic.serialised
        rospy.Subscriber(topic, CameraInfo, locked(self._on_info), tcp_nodelay=True)
        # rospy calls the subscribers of a topic in their order: the listener's, then this
        rospy.Subscriber("/tf_static", TFMessage, locked(lambda _: self._count()))

    def camera(self, frame: str) -> Camera:
        """The camera of pictures in this frame. Raises ValueError when it is not known or unfit."""
        return self._source.camera(frame)

    def _on_info(self, info: CameraInfo) -> None:
        if self._source.told(info):
            self._on_change()
        self._infos += 1
        self._count()

    def _count(self) -> None:
        if self._source.placed():
            self._traffic.handled(self._topic, self._infos)
