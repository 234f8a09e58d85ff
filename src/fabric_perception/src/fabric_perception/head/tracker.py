# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of the helmet in, the head's pose and looking around out."""

import math
from typing import Any, NamedTuple

import cv2
import numpy as np

from fabric_perception.camera import Camera
from fabric_perception.head.aruco import Marker, MarkerFinder
from fabric_perception.head.continuity import Continuity
from fabric_perception.head.helmet import Helmet
from fabric_perception.head.looking import LookingAround
from fabric_perception.head.parameters import HeadParameters
from fabric_perception.head.pose import Candidate, candidates
from fabric_perception.images import check_grey

Area = tuple[int, int, int, int]


class HeadPercept(NamedTuple):
    """What one picture says of the head; without a marker in view nothing is known."""

    t: float  # s, of the picture
    visible: bool
    looking_around: bool  # False when not visible, which does not mean that it is known
    pose: np.ndarray  # (4, 4), frame helmet to cell, m; the identity when not visible
    error: float  # pixels, root mean square of the corners; NaN when not visible
    markers: tuple[Marker, ...]  # all of the helmet that were found

    @property
    def yaw(self) -> float:
        """Where the face points about the cell's z axis, rad; 0 along x."""
        return math.atan2(self.pose[1, 0], self.pose[0, 0])

    @property
    def pitch(self) -> float:
        """How far the face points down, rad (REP-103)."""
        return -math.asin(max(-1.0, min(1.0, float(self.pose[2, 0]))))


class HeadTracker:
    """One helmet in front of one camera.

    Raises ValueError when the helmet's dictionary is unknown or lacks one of its markers. library:
    OpenCV's aruco module.
    """

    def __init__(
        self,
        camera: Camera,
        helmet: Helmet,
        parameters: HeadParameters | None = None,
        library: Any = cv2.aruco,
    ) -> None:
        self._camera = camera
        self._helmet = helmet
        self._parameters = parameters or HeadParameters()
        self._finder = MarkerFinder(
            helmet.dictionary, self._parameters.window, list(helmet.markers), library
        )
        up = camera.pose_in_cell[2, :3]  # the cell's z axis, seen from the camera
        self._continuity = Continuity(self._parameters, up)
        self._looking = LookingAround(self._parameters)
        self.reset()

    def reset(self) -> None:
        """Forget what was seen, when time begins anew."""
        self._time = -math.inf
        self._last: tuple[float, Area] | None = None
        self._continuity.reset()
        self._looking.reset()

    def step(self, t: float, grey: np.ndarray) -> HeadPercept:
        """Take the grey picture (H, W) uint8 of time t (s).

        Raises ImageError for a picture that is none of the camera's, ValueError when t is not
        after the last one; nothing has changed then.
        """
        check_grey(grey, self._camera.width, self._camera.height)
        if not math.isfinite(t) or t <= self._time:
            raise ValueError(f"a picture of {t} s does not come after one of {self._time} s")
        self._time = t
        markers = self._find(t, grey)
        p = self._parameters
        found = candidates(self._camera, self._helmet, markers, p.largest_error)
        if not found:
            return HeadPercept(t, False, False, np.eye(4), math.nan, tuple(markers))
        return self._seen(t, self._continuity.choose(t, found), markers)

    def _seen(self, t: float, chosen: Candidate, markers: list[Marker]) -> HeadPercept:
        pose = self._camera.pose_in_cell @ chosen.pose
        self._last = (t, self._around(pose))
        looking = self._looking.step(t, pose)
        return HeadPercept(t, True, looking, pose, chosen.error, tuple(markers))

    def _find(self, t: float, grey: np.ndarray) -> list[Marker]:
        """Where the helmet was first, then everywhere."""
        if self._last is not None and t - self._last[0] <= self._parameters.memory:
            found = self._finder.find(grey, self._last[1])
            if found:
                return found
        return self._finder.find(grey)

    def _around(self, pose: np.ndarray) -> Area:
        """The part of the picture to search next."""
        pixels = self._camera.project(self._helmet.corners @ pose[:3, :3].T + pose[:3, 3])
        low, high = np.nanmin(pixels, axis=0), np.nanmax(pixels, axis=0)
        margin = self._parameters.search_growth * float((high - low).max())
        limit = 4.0 * max(self._camera.width, self._camera.height)
        box = np.clip([*(low - margin), *(high + margin)], -limit, limit)
        return int(box[0]), int(box[1]), int(box[2]), int(box[3])
