# SPDX-License-Identifier: BSD-3-Clause
"""What the head tracker costs and how well it measures, on drawn pictures with known truth.

For `./fabric bench perception`. Times are CPU time of the process, with OpenCV on one thread, so
that they do not depend on what else the computer does.
"""

import math
import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import cv2
import numpy as np

from fabric_perception.camera import Camera
from fabric_perception.head.aruco import MarkerFinder, dictionary_of
from fabric_perception.head.helmet import Helmet, rotation
from fabric_perception.head.parameters import HeadParameters
from fabric_perception.head.picture import Optics, helmet_picture
from fabric_perception.head.tracker import HeadTracker

SIZE = (640, 480)
FOCAL = 900.0  # pixels; markers of 60 mm are about 85 pixels wide
CAMERA_AT = np.array((0.05, 0.035, 0.75))  # m in cell
HEAD_AT = np.array((0.75, 0.035, 0.52))
RATE = 30.0  # Hz


class Moment(NamedTuple):
    """One picture of a moving head."""

    t: float  # s
    yaw: float  # rad, where the face points in cell
    grey: np.ndarray  # (480, 640) uint8


def head_camera() -> Camera:
    """A camera that looks from behind the belt at the head."""
    ahead = (HEAD_AT - CAMERA_AT) / np.linalg.norm(HEAD_AT - CAMERA_AT)
    right = np.cross(ahead, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([right, np.cross(ahead, right), ahead])
    pose[:3, 3] = CAMERA_AT
    K = np.array([[FOCAL, 0.0, 319.5], [0.0, FOCAL, 239.5], [0.0, 0.0, 1.0]])
    return Camera(K, *SIZE, pose)


def stream(helmet: Helmet, pictures: int, seed: int) -> list[Moment]:
    """Return pictures at 30 Hz of a head that turns from side to side, before clutter."""
    rng = np.random.default_rng(seed)
    camera, moments = head_camera(), []
    phase = rng.uniform(0.0, 2.0 * math.pi, 3)
    for number in range(pictures):
        t = number / RATE
        sway = np.sin((0.5, 0.9, 0.7) * np.array(2.0 * math.pi * t) + phase)
        pose = np.eye(4)
        yaw = math.pi + 1.1 * sway[0]
        pose[:3, :3] = rotation(yaw, 0.3 + 0.2 * sway[1], 0.1 * sway[2])
        pose[:3, 3] = HEAD_AT + 0.02 * sway
        optics = Optics(noise=4.0)
        grey = helmet_picture(camera, helmet, pose, optics, seed * 10_000 + number)
        moments.append(Moment(t + 1.0, yaw, grey))
    return moments


def measure(
    helmet: Helmet,
    parameters: HeadParameters | None = None,
    pictures: int = 60,
    seed: int = 101,
    rounds: int = 3,
) -> dict[str, Any]:
    """Return CPU ms a picture of the tracker beside the plain OpenCV calls, and yaw errors.

    head_ms: the whole step. search_ms: a whole picture searched and refined, as when the head is
    lost. opencv_ms: detectMarkers with its defaults; ratio: head_ms over it. opencv_april_ms: with
    its own refinement by AprilTag. yaw_rmse_deg, yaw_max_deg, visible: of the stream.
    """
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        moments = stream(helmet, pictures, seed)
        told = _accuracy(helmet, parameters, moments)
        told |= _times(helmet, parameters, moments, rounds)
    finally:
        cv2.setNumThreads(threads)
    told["ratio"] = told["head_ms"] / told["opencv_ms"]
    return told


def _accuracy(
    helmet: Helmet, parameters: HeadParameters | None, moments: Sequence[Moment]
) -> dict[str, Any]:
    tracker = HeadTracker(head_camera(), helmet, parameters)
    percepts = [tracker.step(moment.t, moment.grey) for moment in moments]
    errors = [
        (percept.yaw - moment.yaw + math.pi) % (2.0 * math.pi) - math.pi
        for percept, moment in zip(percepts, moments, strict=True)
        if percept.visible
    ]
    degrees = np.degrees(errors) if errors else np.array([math.nan])
    return {
        "pictures": len(moments),
        "visible": len(errors) / len(moments),
        "yaw_rmse_deg": float(np.sqrt((degrees**2).mean())),
        "yaw_max_deg": float(np.abs(degrees).max()),
    }


def _times(
    helmet: Helmet, parameters: HeadParameters | None, moments: Sequence[Moment], rounds: int
) -> dict[str, float]:
    tracker = HeadTracker(head_camera(), helmet, parameters)
    finder = MarkerFinder(helmet.dictionary, wanted=list(helmet.markers))

    def step(moment: Moment) -> None:
        if moment is moments[0]:
            tracker.reset()
        tracker.step(moment.t, moment.grey)

    jobs: dict[str, Callable[[Moment], object]] = {
        "head_ms": step,
        "search_ms": lambda moment: finder.find(moment.grey),
        "opencv_ms": plain_call(helmet.dictionary, april=False),
        "opencv_april_ms": plain_call(helmet.dictionary, april=True),
    }
    return {name: _milliseconds(job, moments, rounds) for name, job in jobs.items()}


def plain_call(dictionary: str, april: bool) -> Callable[[Moment], object]:
    """Return OpenCV's own detection with its defaults, or with its refinement by AprilTag."""
    library, known = cv2.aruco, dictionary_of(dictionary)
    new = hasattr(library, "ArucoDetector")
    parameters = library.DetectorParameters() if new else library.DetectorParameters_create()
    if april:
        parameters.cornerRefinementMethod = library.CORNER_REFINE_APRILTAG
    if new:
        detector = library.ArucoDetector(known, parameters)
        return lambda moment: detector.detectMarkers(moment.grey)
    return lambda moment: library.detectMarkers(moment.grey, known, parameters=parameters)


def _milliseconds(job: Callable[[Moment], object], moments: Sequence[Moment], rounds: int) -> float:
    """The best of some rounds, a picture."""
    times = []
    for _ in range(rounds):
        begun = time.process_time()
        for moment in moments:
            job(moment)
        times.append(time.process_time() - begun)
    return 1000.0 * min(times) / len(moments)
