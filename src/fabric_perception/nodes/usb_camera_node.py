#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""ROS node of a USB camera, a video file or a folder of pictures: image_raw and camera_info."""

import sys
from typing import Any

import numpy as np
import rospy
from sensor_msgs.msg import CameraInfo, Image

from fabric_perception.camera import CameraError
from fabric_perception.camera_info import load_camera_info
from fabric_perception.images import fill
from fabric_perception.picture_sources import Source, SourceError, Wanted, open_source

AGAIN = 1.0  # s until a camera that was unplugged is tried again
SETTINGS = ("width", "height", "rate", "pixel_format", "exposure", "loop")


class UsbCamera:
    """Sends what a source delivers, stamped when it was delivered, less the known latency."""

    def __init__(self, parameters: dict[str, Any]) -> None:
        self._name = str(parameters["source"])
        self._frame = str(parameters["frame"])
        self._latency = rospy.Duration(float(parameters["latency"]))
        self._wanted = Wanted(**{name: parameters[name] for name in SETTINGS})
        self._info = self._load(str(parameters["camera_info"]))
        self._images = rospy.Publisher("image_raw", Image, queue_size=2)
        self._infos = rospy.Publisher("camera_info", CameraInfo, queue_size=2)

    def run(self) -> None:
        """Until shutdown or the end of a file. Raises SourceError when it cannot even begin."""
        source: Source | None = open_source(self._name, self._wanted)
        while source is not None and not rospy.is_shutdown():
            try:
                self._send_all(source)
                break
            except SourceError as error:
                rospy.logerr_throttle(10.0, f"{error}; trying again")
                source.close()
                source = self._open_again()
        if source is not None:
            source.close()

    def _send_all(self, source: Source) -> None:
        due = rospy.Time.now()
        while not rospy.is_shutdown():
            picture = source.read()
            if picture is None:
                rospy.loginfo(f"{self._name} has come to its end")
                return
            self._send(picture)
            if source.period:
                due = max(due + rospy.Duration(source.period), rospy.Time.now())
                rospy.sleep(due - rospy.Time.now())

    def _open_again(self) -> Source | None:
        while not rospy.is_shutdown():
            rospy.sleep(AGAIN)
            try:
                return open_source(self._name, self._wanted)
            except SourceError as error:
                rospy.logerr_throttle(10.0, f"{error}; trying again")
        return None

    def _send(self, picture: np.ndarray) -> None:
        message = fill(Image(), picture)
        message.header.stamp = rospy.Time.now() - self._latency
        message.header.frame_id = self._frame
        if self._info is not None:
            size = (self._info.width, self._info.height)
            if size != (message.width, message.height):
                raise CameraError(
                    f"the calibration is of {size[0]}x{size[1]} pixels, the pictures of "
                    f"{self._name} are {message.width}x{message.height}"
                )
            self._info.header = message.header
            self._infos.publish(self._info)
        self._images.publish(message)

    def _load(self, path: str) -> CameraInfo | None:
        if path:
            return load_camera_info(path, self._frame)
        rospy.logwarn(
            f"{self._name} has no calibration: no camera_info, so nothing can be measured"
        )
        return None


def load_parameters() -> dict[str, Any]:
    """Private parameters, all required; raises ValueError naming one that is missing."""
    names = ("source", "frame", "latency", "camera_info", *SETTINGS)
    for name in names:
        if not rospy.has_param("~" + name):
            raise ValueError(f"parameter {rospy.resolve_name('~' + name)} is missing")
    return {name: rospy.get_param("~" + name) for name in names}


def main() -> None:
    """Run until shutdown; a source or calibration that cannot be used ends the node at once."""
    rospy.init_node("camera")
    try:
        UsbCamera(load_parameters()).run()
    except (ValueError, SourceError) as error:
        sys.exit(f"{rospy.get_name()}: {error}")
    except rospy.ROSInterruptException:
        pass


if __name__ == "__main__":
    main()
