#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Cell and cameras in a graph: a task is filmed, picture by picture, with calibration and place."""

import sys
import threading
import unittest
from collections import defaultdict

import numpy as np
import rosgraph
import rospy
import rostest
import tf2_ros
from sensor_msgs.msg import CameraInfo, Image

from fabric_msgs.msg import SortingRule, TaskState
from fabric_msgs.srv import SetConveyor

LIMIT = 120.0  # s, wall time
PICTURES = 30
CAMERAS = {
    "cell/camera/rgb/image_raw": ("cell/camera/rgb/camera_info", "bgr8"),
    "cell/camera/depth/image": ("cell/camera/depth/camera_info", "32FC1"),
    "head/camera/image_raw": ("head/camera/camera_info", "bgr8"),
}
LABELS = ("cell/cubes", "cell/containers", "human/activity", "human/head", "human/warning")


class Film:
    """Everything that the cameras published."""

    def __init__(self) -> None:
        self.changed = threading.Condition()
        self.stamps = defaultdict(list)
        self.latest = {}
        for picture, (info, _) in CAMERAS.items():
            rospy.Subscriber(picture, Image, self._take, callback_args=picture, buff_size=2**24)
            rospy.Subscriber(info, CameraInfo, self._take, callback_args=info)

    def wait_for(self, count: int) -> bool:
        """Until there are so many pictures of every camera."""
        with self.changed:
            return self.changed.wait_for(
                lambda: all(len(self.stamps[topic]) >= count for topic in CAMERAS), LIMIT
            )

    def _take(self, message, topic: str) -> None:
        with self.changed:
            self.stamps[topic].append(message.header.stamp.to_nsec())
            self.latest[topic] = message
            self.changed.notify_all()


class TestCameras(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.film = Film()
        cls.frames = tf2_ros.Buffer()
        cls.listener = tf2_ros.TransformListener(cls.frames)
        publisher = rospy.Publisher("task/state", TaskState, latch=True, queue_size=1)
        labels = ("red", "green", "blue")
        rules = [SortingRule(colour=n, label=label) for n, label in enumerate(labels, 1)]
        task = TaskState(task_id=1, scenario="sorting", rules=rules, cube_colours=[1, 2, 3])
        task.cube_rules, task.status = [0, 1, 2], TaskState.RUNNING
        publisher.publish(task)
        rospy.wait_for_service("conveyor/set_speed", LIMIT)
        rospy.ServiceProxy("conveyor/set_speed", SetConveyor)(0.05, False)
        cls.enough = cls.film.wait_for(PICTURES)

    def test_every_camera_takes_ten_pictures_a_second_of_the_cell_s_time(self):
        self.assertTrue(self.enough)
        for topic in CAMERAS:
            steps = np.diff(self.film.stamps[topic])
            self.assertEqual(set(steps.tolist()), {100_000_000}, topic)

    def test_pictures_fit_their_calibration(self):
        for topic, (info, encoding) in CAMERAS.items():
            picture, calibration = self.film.latest[topic], self.film.latest[info]
            self.assertEqual(picture.encoding, encoding)
            self.assertEqual((picture.width, picture.height), (640, 480))
            self.assertEqual((calibration.width, calibration.height), (640, 480))
            self.assertEqual(picture.header.frame_id, calibration.header.frame_id)
            self.assertGreater(calibration.K[0], 100.0)

    def test_pictures_show_something(self):
        depth = np.frombuffer(self.film.latest["cell/camera/depth/image"].data, np.float32)
        self.assertLess(np.isnan(depth).mean(), 0.4)
        self.assertAlmostEqual(float(np.nanmedian(depth)), 1.07, delta=0.1)
        for topic in ("cell/camera/rgb/image_raw", "head/camera/image_raw"):
            picture = np.frombuffer(self.film.latest[topic].data, np.uint8)
            self.assertGreater(picture.std(), 20.0)

    def test_the_cameras_have_their_places(self):
        for picture in ("cell/camera/rgb/image_raw", "head/camera/image_raw"):
            frame = self.film.latest[picture].header.frame_id
            patience = rospy.Duration(LIMIT)
            place = self.frames.lookup_transform("cell", frame, rospy.Time(0), patience)
            self.assertGreater(place.transform.translation.z, 0.5)

    def test_nobody_publishes_labels(self):
        publishers = dict(rosgraph.Master("/camera_graph").getSystemState()[0])
        for topic in LABELS:
            self.assertNotIn(rospy.resolve_name(topic), publishers)


if __name__ == "__main__":
    rospy.init_node("camera_graph")
    rostest.rosrun("fabric_sim", "camera_graph", TestCameras, sys.argv)
