# SPDX-License-Identifier: BSD-3-Clause
"""The yellow glove: which patch it is, and where it moves. A yellow object is not a glove."""

from collections.abc import Iterable
from typing import NamedTuple

import cv2
import numpy as np

from fabric_perception.tracking.contours import Patch
from fabric_perception.tracking.kalman import PointFilter
from fabric_perception.tracking.measuring import Measuring, View
from fabric_perception.tracking.parameters import TrackingParameters


class HandTrack(NamedTuple):
    """The hand at one moment, frame cell.

    stamp: s. position: (3,) m, middle of the glove. velocity: (3,) m/s. visible: seen in the
    picture of the stamp. age: s since it was last seen. While it is out of view position is
    where it was seen last, and velocity zero.
    """

    stamp: float
    position: np.ndarray
    velocity: np.ndarray
    visible: bool
    age: float


class Glove(NamedTuple):
    """A patch that can be the glove: (3,) m in the cell, area m^2."""

    position: np.ndarray
    area: float
    patch: Patch


class Refusal(NamedTuple):
    """Why a yellow patch is no glove."""

    patch: Patch
    reason: str


def judge(patch: Patch, measuring: Measuring, view: View, p: TrackingParameters) -> Glove | Refusal:
    """Measure a yellow patch and say whether it is a glove: by depth, size and shape."""
    surface = measuring.surface(patch, view)
    if np.isnan(surface.depth):
        return Refusal(patch, "no depth")
    area, longer, shorter = measuring.size(patch, surface.depth)
    if not p.glove_area[0] <= area <= p.glove_area[1]:
        return Refusal(patch, f"area {1e4 * area:.0f} cm^2")
    if not p.glove_length[0] <= longer <= p.glove_length[1]:
        return Refusal(patch, f"length {100 * longer:.0f} cm")
    if longer > p.glove_elongation * shorter:
        return Refusal(patch, f"{longer / shorter:.1f} times longer than wide")
    solidity = cv2.contourArea(patch.contour) / max(
        1.0, cv2.contourArea(cv2.convexHull(patch.contour))
    )
    if solidity < p.glove_solidity:
        return Refusal(patch, f"fills {solidity:.0%} of its hull")
    position = measuring.place(patch, surface.depth + p.hand_thickness)
    above = surface.height - measuring.workspace.support(*position[:2])
    if above < p.glove_height:
        return Refusal(patch, f"only {100 * above:.1f} cm high")
    if surface.relief < p.glove_relief:
        return Refusal(patch, f"flat to {1000 * surface.relief:.0f} mm")
    return Glove(position, area, patch)


class HandTracker:
    """Follows one glove."""

    def __init__(self, measuring: Measuring, parameters: TrackingParameters) -> None:
        self._measuring, self._parameters = measuring, parameters
        self.reset()

    def reset(self) -> None:
        """Forget the hand."""
        self._filter: PointFilter | None = None
        self._seen = 0.0
        self.refusals: list[Refusal] = []
        self.glove: Glove | None = None

    def step(self, t: float, patches: Iterable[Patch], view: View) -> HandTrack | None:
        """Return the hand at time t (s), None before it was ever seen."""
        judged = [judge(p, self._measuring, view, self._parameters) for p in patches]
        self.refusals = [entry for entry in judged if isinstance(entry, Refusal)]
        self.glove = self._choose(t, [entry for entry in judged if isinstance(entry, Glove)])
        if self.glove is not None:
            self._take(t, self.glove.position)
        if self._filter is None:
            return None
        visible = self.glove is not None
        velocity = self._filter.velocity if visible else np.zeros(3)
        return HandTrack(t, self._filter.position, velocity, visible, t - self._seen)

    def _choose(self, t: float, gloves: list[Glove]) -> Glove | None:
        """The glove nearest to where the hand is expected; the largest when nothing is known."""
        if not gloves:
            return None
        if self._filter is None or t - self._seen > self._parameters.hand_lost:
            return max(gloves, key=lambda glove: glove.area)
        ahead = self._filter.position + self._filter.velocity * (t - self._filter.t)
        distances = [float(np.linalg.norm(glove.position - ahead)) for glove in gloves]
        best = int(np.argmin(distances))
        return gloves[best] if distances[best] <= self._parameters.hand_gate else None

    def _take(self, t: float, position: np.ndarray) -> None:
        p = self._parameters
        if self._filter is None:
            self._filter = PointFilter(t, position, p.hand_noise, p.hand_push)
        elif t - self._seen > p.hand_lost:
            self._filter.reset(t, position, p.hand_noise)
        else:
            self._filter.predict(t)
            self._filter.correct(position, p.hand_noise)
        self._seen = t
