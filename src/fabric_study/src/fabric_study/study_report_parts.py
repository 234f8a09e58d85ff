# SPDX-License-Identifier: BSD-3-Clause
"""The parts of a study's report, in the order in which they come."""

import re
from collections.abc import Sequence

from fabric_study.page import html_figure, html_table
from fabric_study.study_figures import SIMULATED


def typeset(text: str) -> str:
    """Return a cell with true minus signs, without breaks where they would hurt."""
    text = re.sub(r"(?<![\w.])-(?=\d)", "\N{MINUS SIGN}", text)
    text = re.sub(r"\b(Fig\.|Table|Eq\.) (?=\d)", "\\1\N{NO-BREAK SPACE}", text)
    return re.sub(r" ([=<>–…]) ", "\N{NO-BREAK SPACE}\\1\N{NO-BREAK SPACE}", text)


class Parts:
    """The parts of a report as they come: numbers its tables and figures, marks simulated ones."""

    def __init__(self, simulated: bool) -> None:
        self.parts: list[str] = []
        self._mark = f"{SIMULATED}. " if simulated else ""
        self._count = {"Table": 0, "Figure": 0}

    def add(self, *parts: str) -> None:
        """Append ready HTML."""
        self.parts += parts

    def table(self, lines: Sequence[Sequence[str]], caption: str, name: str = "tests") -> None:
        """Append a table, unless it has a header only."""
        if len(lines) > 1:
            cells = [[typeset(cell) for cell in line] for line in lines]
            self.parts.append(html_table(cells, name, self._caption("Table", caption)))

    def figure(self, svg: str, caption: str) -> None:
        """Append a figure."""
        self.parts.append(html_figure(svg, self._caption("Figure", caption)))

    def _caption(self, kind: str, text: str) -> str:
        self._count[kind] += 1
        return f"{kind} {self._count[kind]}. {self._mark}{text}"
