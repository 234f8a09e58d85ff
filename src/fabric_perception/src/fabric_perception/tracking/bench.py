# SPDX-License-Identifier: BSD-3-Clause
"""What each stage costs, beside the plain library calls it is built on: CPU time of one thread.

for row in measure(pictures, camera, workspace, palette):
    print(row.stage, row.ms, row.plain_ms, row.ratio)
"""

import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import cv2
import numpy as np
from scipy.optimize import linear_sum_assignment

from fabric_perception.camera import Camera
from fabric_perception.tracking.carriers import Signals
from fabric_perception.tracking.colours import CUBES, GLOVE, Palette
from fabric_perception.tracking.contours import Patch, find_patches
from fabric_perception.tracking.measuring import BORDER, Detection, View
from fabric_perception.tracking.parameters import TrackingParameters
from fabric_perception.tracking.pipeline import Tracking
from fabric_perception.tracking.segmentation import plain_masks
from fabric_perception.tracking.sight import Sight, look
from fabric_perception.tracking.workspace import Workspace

Pictures = Sequence[tuple[np.ndarray, np.ndarray]]
PERIOD = 1.0 / 30.0  # s between two pictures
ROUNDS = 5  # of which the quickest counts: others use the machine too


class StageCost(NamedTuple):
    """CPU ms a picture of one stage, and of the plain calls that do the same by themselves."""

    stage: str
    ms: float
    plain_ms: float

    @property
    def ratio(self) -> float:
        """How many times the plain calls the stage costs."""
        return self.ms / self.plain_ms


def measure(
    pictures: Pictures,
    camera: Camera,
    workspace: Workspace,
    palette: Palette,
    parameters: TrackingParameters | None = None,
) -> list[StageCost]:
    """Return the cost of each stage, and of the whole step last; OpenCV runs in one thread.

    pictures: (bgr, depth) of one run in order, as `Tracking.step` wants them; at least one.
    Raises ValueError without pictures and ImageError for bad ones.
    """
    if not pictures:
        raise ValueError("there are no pictures to measure with")
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        return _Bench(pictures, Tracking(camera, workspace, palette, parameters)).rows()
    finally:
        cv2.setNumThreads(threads)


class _Bench:
    """The stages of one tracker, fed with what the stage before made of the pictures."""

    def __init__(self, pictures: Pictures, tracking: Tracking) -> None:
        self._pictures, self._tracking = pictures, tracking
        self._t = 0.0
        self._detections: list[list[Detection]] = []
        self._step_all()  # tracks are there from now on
        self._masks = [tracking.segmenter.masks(*pair) for pair in pictures]
        least = tracking.parameters.least_area
        self._patches = [find_patches(masks, least) for masks in self._masks]

    def rows(self) -> list[StageCost]:
        """Stages in their order, the whole step last."""
        pairs = {
            "segmentation": (self._segment, self._segment_plainly),
            "contours": (self._follow_borders, self._follow_borders_plainly),
            "depth and place": (self._place, self._place_plainly),
            "tracks": (self._track, self._track_plainly),
        }
        rows = [
            StageCost(name, self._cost(ours), self._cost(plain))
            for name, (ours, plain) in pairs.items()
        ]
        plain = sum(row.plain_ms for row in rows)
        return [*rows, StageCost("whole step", self._cost(self._step_all), plain)]

    def _cost(self, run: Callable[[], None]) -> float:
        """CPU ms a picture of the quickest round."""
        costs = []
        for _ in range(ROUNDS):
            started = time.process_time()
            run()
            costs.append(time.process_time() - started)
        return 1e3 * min(costs) / len(self._pictures)

    def _step_all(self) -> None:
        for bgr, depth in self._pictures:
            self._t += PERIOD
            self._tracking.step(self._t, bgr, depth, Signals())

    def _segment(self) -> None:
        for bgr, depth in self._pictures:
            self._tracking.segmenter.masks(bgr, depth)

    def _segment_plainly(self) -> None:
        for bgr, _ in self._pictures:
            plain_masks(bgr, self._tracking.segmenter.palette)

    def _follow_borders(self) -> None:
        least = self._tracking.parameters.least_area
        for masks in self._masks:
            find_patches(masks, least)

    def _follow_borders_plainly(self) -> None:
        for masks in self._masks:
            for mask in masks.values():
                found, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
                for contour in found:
                    cv2.boundingRect(contour)
                    cv2.moments(contour)

    def _place(self) -> None:
        self._detections = []
        measuring = self._tracking.measuring
        for (_, depth), patches, masks in zip(
            self._pictures, self._patches, self._masks, strict=True
        ):
            view = View(depth, masks)
            cubes = measuring.cubes([p for p in patches if p.colour in CUBES], view)
            self._detections.append(cubes)
            for patch in patches:
                if patch.colour == GLOVE:
                    measuring.surface(patch, view)

    def _place_plainly(self) -> None:
        """A median of the eroded patch and the ray of its middle, one after the other."""
        camera = self._tracking.camera
        for (_, depth), patches in zip(self._pictures, self._patches, strict=True):
            for patch in patches:
                camera.deproject([patch.centre], [_plain_depth(patch, depth)])

    def _track(self) -> None:
        tracking = self._tracking
        for (_, depth), cubes in zip(self._pictures, self._detections, strict=True):
            self._t += PERIOD
            seen_at = partial(self._look, depth)
            tracking.cubes.step(self._t, cubes, None, Signals(), seen_at)
            tracking.containers.update(self._t, tracking.cubes.tracks)

    def _look(self, depth: np.ndarray, places: Sequence[np.ndarray]) -> list[Sight]:
        return look(self._tracking.camera, depth, places, self._tracking.workspace.edge)

    def _track_plainly(self) -> None:
        for patches in self._patches:
            places = np.array([[*p.centre, 0.0] for p in patches] or [[0.0] * 3])
            filters = [cv2.KalmanFilter(6, 3, 0, cv2.CV_64F) for _ in places]
            linear_sum_assignment(np.linalg.norm(places[:, None] - places[None], axis=2))
            for one, place in zip(filters, places, strict=True):
                one.predict()
                one.correct(place)


def _plain_depth(patch: Patch, depth: np.ndarray) -> float:
    inner = cv2.erode(patch.inside, BORDER)
    values = patch.window(depth)[inner > 0]
    values = values[values > 0.0]
    return float(np.median(values)) if values.size else float("nan")
