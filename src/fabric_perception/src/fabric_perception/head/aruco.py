# SPDX-License-Identifier: BSD-3-Clause
"""Finding square markers, with one face for OpenCV's old and new aruco calls.

Up to 4.6 the functions lie in the contrib module (`detectMarkers`, `DetectorParameters_create`,
`drawMarker`); from 4.7 on there is a class (`ArucoDetector`, `generateImageMarker`).

A frame is searched once, with one window of the adaptive threshold, and the corners of what is
found are refined on a small cut-out by the method of AprilTag: on the whole frame that method is
several times as expensive as everything else here.
"""

from collections.abc import Collection
from typing import Any, NamedTuple

import cv2
import numpy as np

PROBE_SIDE, PROBE_AT = 80, 40  # pixels, of the drawn marker that tells how corners are counted
MARGIN = 0.2  # of a marker's extent, that is cut out around it for the refinement
LEAST_MARGIN = 6  # pixels


class Marker(NamedTuple):
    """A marker in a picture."""

    id: int
    corners: np.ndarray  # (4, 2) pixels, clockwise from the top left of the marker itself
    refined: bool


class MarkerFinder:
    """Finds the markers of one dictionary in grey pictures.

    dictionary: name of one of OpenCV's, such as DICT_4X4_50. window: pixels, odd, of the adaptive
    threshold. wanted: ids to look for, all if None. library: OpenCV's aruco module.
    Raises ValueError for an unknown dictionary, a bad window or an id the dictionary has not.
    """

    def __init__(
        self,
        dictionary: str = "DICT_4X4_50",
        window: int = 23,
        wanted: Collection[int] | None = None,
        library: Any = cv2.aruco,
    ) -> None:
        if isinstance(window, bool) or not isinstance(window, int) or window < 3 or not window % 2:
            raise ValueError(f"window is {window}; it must be an odd number of pixels from 3 on")
        self._library = library
        self._dictionary = dictionary_of(dictionary, library)
        self._wanted = None if wanted is None else frozenset(wanted)
        for marker in sorted(self._wanted or ()):
            _check_id(marker, dictionary, self._dictionary)
        self._search = self._detector(window, library.CORNER_REFINE_NONE)
        self._refine = self._detector(window, library.CORNER_REFINE_APRILTAG)
        self._shift = self._measure_shift()

    def find(self, grey: np.ndarray, area: tuple[int, int, int, int] | None = None) -> list[Marker]:
        """Return the markers in a grey picture (H, W) uint8, by id; each id at most once.

        area: left, top, right, bottom in pixels, of the part to search; the whole if None. An id
        seen twice is left out: one of them is somewhere it does not belong.
        """
        left, top, right, bottom = _inside(area, grey.shape)
        if right - left < 1 or bottom - top < 1:
            return []
        part = np.ascontiguousarray(grey[top:bottom, left:right])
        offset = np.array((left, top), dtype=float)
        found = [(i, c + offset) for i, c in self._detect(self._search, part)]
        ids = [i for i, _ in found]
        return sorted(
            (self._refined(grey, i, corners) for i, corners in found if ids.count(i) == 1),
            key=lambda marker: marker.id,
        )

    def _refined(self, grey: np.ndarray, marker: int, corners: np.ndarray) -> Marker:
        low, high = corners.min(axis=0), corners.max(axis=0)
        margin = max(LEAST_MARGIN, MARGIN * float((high - low).max()))
        box = (*np.floor(low - margin).astype(int), *np.ceil(high + margin).astype(int))
        left, top, right, bottom = _inside(box, grey.shape)
        part = np.ascontiguousarray(grey[top:bottom, left:right])
        for found, better in self._detect(self._refine, part):
            if found == marker:
                return Marker(marker, better + (left, top) - self._shift, True)
        return Marker(marker, corners, False)

    def _detect(self, detector: Any, grey: np.ndarray) -> list[tuple[int, np.ndarray]]:
        corners, ids, _ = detector(grey)
        ids = [] if ids is None else np.ravel(ids).tolist()
        return [
            (int(i), np.reshape(c, (4, 2)).astype(float))
            for i, c in zip(ids, corners, strict=True)
            if self._wanted is None or i in self._wanted
        ]

    def _detector(self, window: int, refinement: int) -> Any:
        library, dictionary = self._library, self._dictionary
        new = hasattr(library, "ArucoDetector")
        parameters = library.DetectorParameters() if new else library.DetectorParameters_create()
        parameters.adaptiveThreshWinSizeMin = parameters.adaptiveThreshWinSizeMax = window
        parameters.cornerRefinementMethod = refinement
        if new:
            return library.ArucoDetector(dictionary, parameters).detectMarkers
        return lambda grey: library.detectMarkers(grey, dictionary, parameters=parameters)

    def _measure_shift(self) -> float:
        """How far refined corners lie from OpenCV's own count of pixels: 0 or 0.5.

        AprilTag counts from the edge of the first pixel, OpenCV from its centre, and whether the
        two are reconciled depends on OpenCV's version. A drawn marker tells.
        """
        marker = min(self._wanted) if self._wanted else 0
        picture = np.full((PROBE_SIDE + 2 * PROBE_AT,) * 2, 255, np.uint8)
        end = PROBE_AT + PROBE_SIDE
        picture[PROBE_AT:end, PROBE_AT:end] = draw(
            self._dictionary, marker, PROBE_SIDE, self._library
        )
        picture = cv2.GaussianBlur(picture, (0, 0), 0.7)
        found = [corners for i, corners in self._detect(self._refine, picture) if i == marker]
        if len(found) != 1:
            raise RuntimeError("OpenCV does not find a marker that it has drawn itself")
        middle = PROBE_AT + (PROBE_SIDE - 1) / 2.0
        return 0.5 * round(2.0 * float(np.mean(found[0] - middle)))


def dictionary_of(name: str, library: Any = cv2.aruco) -> Any:
    """Return a dictionary by name; raises ValueError when there is none of it."""
    if not isinstance(name, str) or not name.startswith("DICT_") or not hasattr(library, name):
        known = [word for word in dir(library) if word.startswith("DICT_")]
        raise ValueError(f"no marker dictionary {name!r}; there are {', '.join(known)}")
    return library.getPredefinedDictionary(getattr(library, name))


def draw(dictionary: Any, marker: int, side: int, library: Any = cv2.aruco) -> np.ndarray:
    """Return the picture (side, side) uint8 of a marker, black border included, no white one."""
    new = hasattr(library, "generateImageMarker")
    return (library.generateImageMarker if new else library.drawMarker)(dictionary, marker, side)


def cells_of(dictionary: Any, marker: int, library: Any = cv2.aruco) -> np.ndarray:
    """Return a marker's cells (n, n), True where black, its black border included."""
    n = int(dictionary.markerSize) + 2
    return draw(dictionary, marker, n, library) < 128


def _check_id(marker: int, name: str, dictionary: Any) -> None:
    count = len(dictionary.bytesList)
    if isinstance(marker, bool) or not isinstance(marker, int) or not 0 <= marker < count:
        raise ValueError(f"{name} has no marker {marker!r}, only 0..{count - 1}")


def _inside(area: Any, shape: tuple[int, ...]) -> tuple[int, int, int, int]:
    height, width = shape[:2]
    if area is None:
        return 0, 0, width, height
    left, top, right, bottom = (int(v) for v in area)
    return max(left, 0), max(top, 0), min(right, width), min(bottom, height)
