# SPDX-License-Identifier: BSD-3-Clause
"""Sheets to print, as SVG in true size: the calibration board, and the markers of a helmet.

A line of 100 mm on each sheet shows whether the printer has scaled it.
"""

from collections.abc import Iterable
from xml.sax.saxutils import escape

import numpy as np

from fabric_perception.calibration.board import Board
from fabric_perception.head.aruco import MarkerFinder, cells_of, dictionary_of
from fabric_perception.head.helmet import Helmet

PAPER = {"a4": (210.0, 297.0), "a3": (297.0, 420.0), "letter": (215.9, 279.4)}  # mm
BORDER = 8.0  # mm that a printer cannot reach
BAR = 100.0  # mm
FOOT = 16.0  # mm below the grid, for the bar and the words


class SheetError(ValueError):
    """What does not fit on the paper; the message says by how much."""


def board_sheet(board: Board, paper: str = "a4") -> str:
    """Return the SVG of a calibration board.

    Raises SheetError when the paper is too small, ValueError for ids the dictionary has not.
    """
    board.finder()
    width, height = _paper(paper)
    wide, high = (1000.0 * length for length in board.extent)
    room = (width - 2 * BORDER, height - 2 * BORDER - FOOT)
    if wide > room[0] or high > room[1]:
        raise SheetError(
            f"a board of {wide:.0f}x{high:.0f} mm does not fit on {paper}, which has room for "
            f"{room[0]:.0f}x{room[1]:.0f} mm"
        )
    left, top = (width - wide) / 2.0, BORDER + (room[1] - high) / 2.0
    parts = []
    for marker in board.ids:
        corner = 1000.0 * board.corners(marker)[0]
        place = (left + corner[0], top + high - corner[1])
        parts += _marker(board.dictionary, marker, place, 1000.0 * board.size)
    parts += _origin(left, top + high)
    words = (
        f"{board.dictionary}  ids {board.ids[0]}..{board.ids[-1]}  {board.columns}x{board.rows}  "
        f"marker {1000 * board.size:g} mm, gap {1000 * board.gap:g} mm.  Cross: origin; x right, "
        "y up."
    )
    return _svg(width, height, [*parts, *_foot(left, height - BORDER, words)])


def helmet_sheet(helmet: Helmet, paper: str = "a4") -> str:
    """Return the SVG of a helmet's markers with white rims to cut out; raises as board_sheet."""
    MarkerFinder(helmet.dictionary, wanted=list(helmet.markers))
    width, height = _paper(paper)
    cells = int(dictionary_of(helmet.dictionary).markerSize) + 2
    x, y, row = BORDER, BORDER, 0.0
    parts: list[str] = []
    for marker in helmet.markers.values():
        size = 1000.0 * marker.size
        rim = size / cells
        whole = size + 2 * rim
        if x + whole > width - BORDER:
            x, y, row = BORDER, y + row + 8.0, 0.0
        if x + whole > width - BORDER or y + whole + 6.0 > height - BORDER - FOOT:
            raise SheetError(f"the markers of the helmet do not fit on {paper}")
        cut = f'<rect x="{x:.3f}" y="{y:.3f}" width="{whole:.3f}" height="{whole:.3f}"'
        parts.append(f'{cut} fill="none" stroke="#999" stroke-width="0.1"/>')
        parts += _marker(helmet.dictionary, marker.id, (x + rim, y + rim), size)
        parts.append(_text(x, y + whole + 4.0, f"id {marker.id}, {size:g} mm, this side up"))
        x, row = x + whole + 6.0, max(row, whole + 6.0)
    words = f"{helmet.dictionary}.  Cut along the grey lines; the white rim must stay."
    return _svg(width, height, [*parts, *_foot(BORDER, height - BORDER, words)])


def _marker(dictionary: str, marker: int, place: tuple[float, float], size: float) -> Iterable[str]:
    """Black runs of a marker's rows as rectangles; place: of its top left corner, mm."""
    cells = cells_of(dictionary_of(dictionary), marker)
    cell = size / len(cells)
    for row, line in enumerate(cells):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], line.astype(int), [0]])))
        for begin, end in edges.reshape(-1, 2):
            yield (
                f'<rect x="{place[0] + begin * cell:.4f}" y="{place[1] + row * cell:.4f}" '
                f'width="{(end - begin) * cell:.4f}" height="{cell:.4f}"/>'
            )


def _origin(x: float, y: float) -> Iterable[str]:
    """A cross beside the corner that is the origin; its arms point at it."""
    for begin, end in (((x - 6, y), (x - 1, y)), ((x, y + 1), (x, y + 6))):
        yield _line(begin, end, 0.25)


def _foot(x: float, y: float, words: str) -> Iterable[str]:
    yield _line((x, y - 5.0), (x + BAR, y - 5.0), 0.25)
    for end in (x, x + BAR):
        yield _line((end, y - 6.5), (end, y - 3.5), 0.25)
    yield _text(x + BAR + 2.0, y - 4.0, "must be 100 mm long: print at 100 %")
    yield _text(x, y, words)


def _line(begin: tuple[float, float], end: tuple[float, float], width: float) -> str:
    return (
        f'<line x1="{begin[0]:.3f}" y1="{begin[1]:.3f}" x2="{end[0]:.3f}" y2="{end[1]:.3f}" '
        f'stroke="black" stroke-width="{width}"/>'
    )


def _text(x: float, y: float, words: str) -> str:
    style = 'font-family="sans-serif" font-size="3"'
    return f'<text x="{x:.3f}" y="{y:.3f}" {style}>{escape(words)}</text>'


def _paper(name: str) -> tuple[float, float]:
    if name not in PAPER:
        raise SheetError(f"no paper '{name}'; there are {', '.join(PAPER)}")
    return PAPER[name]


def _svg(width: float, height: float, parts: Iterable[str]) -> str:
    head = (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}mm" height="{height}mm" '
        f'viewBox="0 0 {width} {height}" shape-rendering="crispEdges">\n'
        f'<rect width="{width}" height="{height}" fill="white"/>\n'
    )
    return head + "\n".join(parts) + "\n</svg>\n"
