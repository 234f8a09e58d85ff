#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""ROS node of the head tracker: pictures of the helmet in, the head's pose and looks out."""

import cv2
import rospy
from geometry_msgs.msg import Point, Pose, Quaternion
from sensor_msgs.msg import Image

from fabric_msgs.msg import HeadState
from fabric_msgs.settings import settings_from
from fabric_msgs.traffic import PICTURES, Traffic
from fabric_perception.camera import Camera
from fabric_perception.camera_listener import CameraListener
from fabric_perception.camera_poses import PARENT, quaternion_of
from fabric_perception.head.helmet import Helmet, load_helmet
from fabric_perception.head.overlay import draw_overlay
from fabric_perception.head.parameters import HeadParameters
from fabric_perception.head.tracker import HeadPercept, HeadTracker
from fabric_perception.images import colour_of, fill, grey_of
from fabric_perception.picture_input import PictureTimes, StampError

IMAGE, INFO = "head/camera/image_raw", "head/camera/camera_info"
OVERLAY = "head/camera/overlay"


class HeadNode:
    """Answers every picture with a head state of its stamp: unknown when it is of no use."""

    def __init__(self, helmet: Helmet, parameters: HeadParameters) -> None:
        self._helmet = helmet
        self._parameters = parameters
        self._camera: Camera | None = None
        self._tracker: HeadTracker | None = None
        self._times = PictureTimes(parameters.picture_age)
        self._traffic = Traffic("head")
        self._heads = self._traffic.publisher("human/head", HeadState)
        self._overlay = rospy.Publisher(OVERLAY, Image, queue_size=1)
        self._source = CameraListener(self._traffic, INFO, self._forget_camera)
        self._traffic.subscribe(IMAGE, Image, self._on_image, **PICTURES)

    def _forget_camera(self) -> None:
        self._camera = self._tracker = None

    def _on_image(self, message: Image) -> None:
        t = message.header.stamp.to_sec()
        try:
            anew = self._times.accept(rospy.get_time(), t)
        except StampError as error:  # nobody waits any more for what a picture of that time shows
            rospy.logwarn_throttle(5.0, f"head: a picture is left out: {error}")
            return
        if anew:
            rospy.logwarn(f"head: time begins anew at {t:.2f} s")
            self._tracker = None
        percept = self._percept(t, message)
        self._heads.publish(_state(message.header.stamp, percept))
        if percept is not None and self._overlay.get_num_connections():
            self._show(message, percept)

    def _percept(self, t: float, message: Image) -> HeadPercept | None:
        """What a picture shows; None when it or its camera is of no use."""
        try:
            return self._look(t, message)
        except ValueError as error:
            rospy.logwarn_throttle(5.0, f"head: a picture is left out: {error}")
            return None

    def _look(self, t: float, message: Image) -> HeadPercept:
        """Raises ValueError when camera or picture are of no use."""
        if self._tracker is None:
            self._camera = self._source.camera(message.header.frame_id)
            self._tracker = HeadTracker(self._camera, self._helmet, self._parameters)
        return self._tracker.step(t, grey_of(message))

    def _show(self, message: Image, percept: HeadPercept) -> None:
        drawn = draw_overlay(colour_of(message), self._camera, percept)
        self._overlay.publish(fill(Image(header=message.header), drawn))


def _state(stamp: rospy.Time, percept: HeadPercept | None) -> HeadState:
    """A message of what was seen; None stands for a picture of no use."""
    state = HeadState(pose=Pose(Point(0.0, 0.0, 0.0), Quaternion(0.0, 0.0, 0.0, 1.0)))
    state.header.stamp, state.header.frame_id = stamp, PARENT
    if percept is not None and percept.visible:
        state.visible, state.looking_around = True, percept.looking_around
        state.pose.position = Point(*(float(v) for v in percept.pose[:3, 3]))
        state.pose.orientation = Quaternion(*quaternion_of(percept.pose[:3, :3]))
    return state


def main() -> None:
    """Run until shutdown; bad parameters end the node at once, naming the value."""
    rospy.init_node("head")
    cv2.setNumThreads(1)  # more wait for each other in the kernel, and take the others' cores
    helmet = load_helmet(rospy.get_param("~helmet_file"))
    HeadNode(helmet, settings_from(HeadParameters, rospy.get_param("~head")))
    rospy.spin()


if __name__ == "__main__":
    main()
