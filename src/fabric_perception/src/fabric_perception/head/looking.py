# SPDX-License-Identifier: BSD-3-Clause
"""Whether a face is turned away from the work area (O4 of Table 6.2)."""

import math

import numpy as np

from fabric_perception.head.parameters import HeadParameters
from fabric_perception.recognition import Debounced


class LookingAround:
    """Looking around begins when the face leaves the cone and ends when it is well inside again.

    The cone stands around the way from the head to the middle of the work area, so it goes with
    the person. Pictures without a helmet are not fed, and change nothing for `memory` seconds;
    after that the first picture is believed.
    """

    def __init__(self, parameters: HeadParameters) -> None:
        self._parameters = parameters
        self._work = np.array((parameters.work_x, parameters.work_y, parameters.work_z))
        self.reset()

    def reset(self) -> None:
        """Forget what was seen."""
        self._time = -math.inf
        self._away: Debounced[bool] = Debounced(self._parameters.look_frames)

    def step(self, t: float, pose: np.ndarray) -> bool:
        """Take the pose (4, 4) of the helmet in cell at time t (s); return what is believed."""
        if t - self._time > self._parameters.memory:
            self.reset()
        self._time = t
        aside, above = offsets(pose, self._work)
        self._away.feed(self._reading(abs(aside), abs(above)))
        return bool(self._away.value)

    def _reading(self, aside: float, above: float) -> bool:
        p = self._parameters
        if aside > p.yaw_limit or above > p.pitch_limit:
            return True
        if aside < p.yaw_limit - p.margin and above < p.pitch_limit - p.margin:
            return False
        return bool(self._away.value)


def offsets(pose: np.ndarray, work: np.ndarray) -> tuple[float, float]:
    """Return how far a face points aside (to its left) and above of a place, rad.

    pose: (4, 4) of the helmet in cell. work: (3,) m in cell. Both angles are those of the face's
    x axis in a frame that looks from the head to the place and has its y axis level; straight
    below or above the head, where no level is defined, the frame is turned as the cell.
    """
    ahead = work - pose[:3, 3]
    ahead /= max(float(np.linalg.norm(ahead)), 1e-9)
    left = np.array((-ahead[1], ahead[0], 0.0))
    length = float(np.linalg.norm(left))
    left = left / length if length > 1e-6 else np.array((0.0, 1.0, 0.0))
    up = np.cross(ahead, left)
    face = pose[:3, 0]
    x, y, z = float(face @ ahead), float(face @ left), float(face @ up)
    return math.atan2(y, x), math.atan2(z, math.hypot(x, y))
