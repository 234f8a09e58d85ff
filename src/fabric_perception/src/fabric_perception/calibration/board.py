# SPDX-License-Identifier: BSD-3-Clause
"""A board of square markers: where its corners are, and finding them in pictures.

Frame board: x to the right on the sheet, y up, z out of the paper; the origin is the lower left
corner of the lower left marker, where the sheet shows a cross.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from fabric_perception.head.aruco import Marker, MarkerFinder


@dataclass(frozen=True)
class Board:
    """A grid of markers, ids row by row from the top left. Raises ValueError naming a bad number.

    The defaults fill a sheet of A4 and stay clear of the ids on the helmet.
    """

    dictionary: str = "DICT_4X4_50"
    first_id: int = 10
    columns: int = 5
    rows: int = 7
    size: float = 0.030  # m, edge of a marker
    gap: float = 0.007  # m, between markers

    def __post_init__(self) -> None:
        if self.columns < 2 or self.rows < 2:
            raise ValueError(f"a board of {self.columns}x{self.rows} markers is too small")
        if self.first_id < 0:
            raise ValueError(f"first_id is {self.first_id}; it must be 0 or more")
        for name in ("size", "gap"):
            if not 0.001 <= getattr(self, name) <= 1.0:
                raise ValueError(f"{name} is {getattr(self, name)} m; it must lie in 0.001..1")

    @property
    def ids(self) -> range:
        """Of all its markers."""
        return range(self.first_id, self.first_id + self.columns * self.rows)

    @property
    def extent(self) -> tuple[float, float]:
        """Width and height of the grid, m."""
        pitch = self.size + self.gap
        return self.columns * pitch - self.gap, self.rows * pitch - self.gap

    def corners(self, marker: int) -> np.ndarray:
        """(4, 3) m in frame board, clockwise from the top left. Raises KeyError."""
        if marker not in self.ids:
            raise KeyError(marker)
        row, column = divmod(marker - self.first_id, self.columns)
        pitch, s = self.size + self.gap, self.size
        x, y = column * pitch, (self.rows - 1 - row) * pitch
        return np.array([[x, y + s, 0], [x + s, y + s, 0], [x + s, y, 0], [x, y, 0]], dtype=float)

    def scaled(self, factor: float) -> "Board":
        """The board as a printer made it that stretches everything by a factor."""
        return Board(
            self.dictionary,
            self.first_id,
            self.columns,
            self.rows,
            self.size * factor,
            self.gap * factor,
        )

    def finder(self, window: int = 23) -> MarkerFinder:
        """What finds its markers; raises ValueError when the dictionary has too few."""
        return MarkerFinder(self.dictionary, window, self.ids)


@dataclass(frozen=True)
class View:
    """Corners of the board in one picture."""

    points: np.ndarray  # (N, 3) m in frame board
    pixels: np.ndarray  # (N, 2)
    markers: tuple[Marker, ...]

    @property
    def count(self) -> int:
        """Of its corners."""
        return len(self.points)


def view_of(board: Board, finder: MarkerFinder, grey: np.ndarray) -> View:
    """Return what a grey picture (H, W) uint8 shows of the board; markers not refined left out."""
    seen = tuple(marker for marker in finder.find(grey) if marker.refined)
    if not seen:
        return View(np.empty((0, 3)), np.empty((0, 2)), ())
    points = np.concatenate([board.corners(marker.id) for marker in seen])
    return View(points, np.concatenate([marker.corners for marker in seen]), seen)


def coverage(view: View, width: int, height: int) -> float:
    """Return which share of the picture the found corners span."""
    if view.count < 3:
        return 0.0
    hull = cv2.convexHull(view.pixels.astype(np.float32))
    return float(cv2.contourArea(hull)) / (width * height)
