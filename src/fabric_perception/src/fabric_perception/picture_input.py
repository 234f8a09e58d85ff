# SPDX-License-Identifier: BSD-3-Clause
"""What comes in from one camera: which camera it is, and which of its pictures are of now.

source = CameraSource("head/camera/camera_info", look_up, LookupError)
source.told(camera_info)
camera = source.camera("head_camera_optical_frame")

times = PictureTimes(oldest=0.5)
times.accept(now, stamp)  # raises StampError
"""

import math
from collections.abc import Callable
from typing import Any

from fabric_perception.camera import Camera, CameraError
from fabric_perception.camera_poses import pose_of

NEW_TIME = 2.0  # s; time that jumps back further begins anew, as when a bag is played again


class StampError(ValueError):
    """A picture is of another time than it should be; the message says how far."""


class CameraSource:
    """The camera behind a topic of pictures: its calibration as told, its place as looked up."""

    def __init__(self, topic: str, look_up: Callable[[str], Any], unknown: type[Exception]) -> None:
        """topic: where its camera_info comes. look_up: returns the TransformStamped that takes
        points of a frame to the cell, and raises `unknown` when there is none."""
        self._topic, self._look_up, self._unknown = topic, look_up, unknown
        self._info: Any = None

    def told(self, info: Any) -> bool:
        """Take a CameraInfo; return whether it is of another lens than the last."""
        other = self._info is None or _lens(info) != _lens(self._info)
        self._info = info
        return other

    def placed(self) -> bool:
        """Whether it is known where the camera is whose CameraInfo has come."""
        if self._info is None:
            return False
        try:
            self._look_up(self._info.header.frame_id)
        except self._unknown:
            return False
        return True

    def camera(self, frame: str) -> Camera:
        """Return the camera that takes pictures in this frame.

        Raises CameraError saying what is missing: the calibration, or where the camera is.
        """
        if self._info is None:
            raise CameraError(f"nothing has come yet on {self._topic}")
        try:
            found = self._look_up(frame).transform
        except self._unknown as error:
            raise CameraError(f"where the camera '{frame}' is, is not known: {error}") from None
        p, q = found.translation, found.rotation
        return Camera.from_camera_info(self._info, pose_of((p.x, p.y, p.z), (q.x, q.y, q.z, q.w)))


class PictureTimes:
    """Judges the stamps of one camera's pictures; times in s."""

    def __init__(self, oldest: float) -> None:
        """oldest: age from which on a picture is of no use, and so is one as far ahead of time."""
        self._oldest = oldest
        self._newest = -math.inf

    def accept(self, now: float, t: float) -> bool:
        """Take a picture stamped t; return whether time has begun anew with it.

        Raises StampError for one that is stale, ahead of time, or not after the last.
        """
        age = now - t
        if not abs(age) <= self._oldest:
            when = "old" if age > 0.0 else "ahead of time"
            raise StampError(f"it is {abs(age):.2f} s {when}; {self._oldest:g} s are allowed")
        anew = self._newest - t > NEW_TIME
        if t <= self._newest and not anew:
            raise StampError(f"it is of {t:.3f} s and came after one of {self._newest:.3f} s")
        self._newest = t
        return anew


def _lens(info: Any) -> tuple:
    return tuple(info.K), tuple(info.D), info.distortion_model, info.width, info.height
