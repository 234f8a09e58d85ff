# SPDX-License-Identifier: BSD-3-Clause
"""One HTML file for a run folder: `python -m fabric_study.report DIR`."""

import argparse
import html
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from fabric_study.figure import results_svg
from fabric_study.meter import COLUMNS
from fabric_study.results import (
    Row,
    format_value,
    latency_lines,
    read_results,
    read_timing,
    summary_table,
)
from fabric_study.run_record import read_run

FILE_NAME = "report.html"
PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title><style>
body {{ font: 15px/1.5 sans-serif; max-width: 72rem; margin: 2rem auto; padding: 0 1rem; }}
table {{ border-collapse: collapse; margin: 1rem 0; font-variant-numeric: tabular-nums; }}
th, td {{ padding: .2rem .7rem; border-bottom: 1px solid #ddd; text-align: right; }}
th:first-child, td:first-child {{ text-align: left; }}
.wide {{ overflow-x: auto; font-size: 12px; }} svg {{ max-width: 100%; height: auto; }}
</style></head><body><h1>{title}</h1>
{body}
</body></html>
"""


def html_table(lines: Sequence[Iterable[str]], name: str = "") -> str:
    """Return lines of cells, header first, as a table; the cells are escaped."""
    rows = []
    for number, line in enumerate(lines):
        tag = "td" if number else "th"
        cells = "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in line)
        rows.append(f"<tr>{cells}</tr>")
    return f'<div class="{name}"><table>{"".join(rows)}</table></div>'


def report_html(title: str, run: dict[str, Any], rows: Sequence[Row], timing: Sequence[Row]) -> str:
    """Return the page of a run: what was run, the summary, the figure and every task."""
    parts = ["<h2>Summary</h2>", html_table(summary_table(rows))]
    parts.append("<p>Means with 95 % intervals over tasks (Student's t).</p>")
    parts += [f"<p>{html.escape(line)}</p>" for line in latency_lines(timing)]
    parts += ["<h2>Course and means</h2>", results_svg(rows)]
    tasks = [[format_value(row[name]) for name in COLUMNS] for row in rows]
    parts += ["<h2>Tasks</h2>", html_table([COLUMNS, *tasks], "wide")]
    parts += ["<h2>Run</h2>", html_table([["what", "value"], *_flat(run)])]
    return PAGE.format(title=html.escape(title), body="\n".join(parts))


def _flat(content: dict[str, Any], prefix: str = "") -> list[tuple[str, str]]:
    lines: list[tuple[str, str]] = []
    for key, value in content.items():
        if isinstance(value, dict):
            lines += _flat(value, f"{prefix}{key}.")
        else:
            lines.append((f"{prefix}{key}", str(value)))
    return lines


def write_report(folder: Path) -> Path:
    """Write report.html into a run folder and return its path.

    Raises FileNotFoundError or ValueError naming what is missing or damaged.
    """
    results = folder / "results.csv"
    if not results.exists():
        raise FileNotFoundError(f"{results} does not exist; {folder} holds no run")
    rows = read_results(results)
    if not rows:
        raise ValueError(f"{results} holds no task")
    timing_file = folder / "timing.csv"
    timing = read_timing(timing_file) if timing_file.exists() else []
    page = report_html(f"FABRIC run {folder.resolve().name}", read_run(folder), rows, timing)
    path = folder / FILE_NAME
    path.write_text(page, encoding="utf-8")
    return path


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line; returns 0, or 2 when the folder cannot be reported on."""
    parser = argparse.ArgumentParser(prog="report", description="Report on a run folder.")
    parser.add_argument("folder", type=Path, help="folder that holds results.csv")
    try:
        print(write_report(parser.parse_args(arguments).folder))
    except (OSError, ValueError) as error:
        print(f"report: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
