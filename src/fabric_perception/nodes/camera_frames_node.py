#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""ROS node that says where the cameras are: poses out of files, as static frames of `cell`."""

import os

import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped

from fabric_perception.camera import CameraError
from fabric_perception.camera_poses import PARENT, load_poses, quaternion_of


def frames_of(paths: list[str]) -> list[TransformStamped]:
    """The frames of every camera in the files. Raises CameraError; a camera may be there once."""
    frames: dict[str, TransformStamped] = {}
    for path in paths:
        for name, pose in load_poses(path).items():
            if name in frames:
                raise CameraError(f"{path}: the camera '{name}' is in another file too")
            frame = TransformStamped(child_frame_id=name)
            frame.header.frame_id, frame.header.stamp = PARENT, rospy.Time.now()
            place, turn = frame.transform.translation, frame.transform.rotation
            place.x, place.y, place.z = (float(v) for v in pose[:3, 3])
            turn.x, turn.y, turn.z, turn.w = quaternion_of(pose[:3, :3])
            frames[name] = frame
    return list(frames.values())


def main() -> None:
    """Run until shutdown; a file that cannot be used ends the node at once."""
    rospy.init_node("camera_frames")
    frames = frames_of(rospy.get_param("~files").split(os.pathsep))
    broadcaster = tf2_ros.StaticTransformBroadcaster()
    broadcaster.sendTransform(frames)
    rospy.spin()


if __name__ == "__main__":
    main()
