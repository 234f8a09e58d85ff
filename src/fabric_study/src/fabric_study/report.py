# SPDX-License-Identifier: BSD-3-Clause
"""One HTML file for a run or study folder: `python -m fabric_study.report DIR`."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fabric_study.figure import results_svg
from fabric_study.meter import COLUMNS
from fabric_study.page import heading, html_page, html_table, paragraph
from fabric_study.results import (
    Row,
    format_value,
    latency_lines,
    read_results,
    read_timing,
    summary_table,
)
from fabric_study.run_record import read_run
from fabric_study.store import STORE_FILE

FILE_NAME = "report.html"


def report_html(title: str, run: dict[str, Any], rows: Sequence[Row], timing: Sequence[Row]) -> str:
    """Return the page of a run: what was run, the summary, the figure and every task."""
    parts = [heading("Summary"), html_table(summary_table(rows))]
    parts.append(paragraph("Means with 95 % intervals over tasks (Student's t)."))
    parts += [paragraph(line) for line in latency_lines(timing)]
    parts += [heading("Course and means"), results_svg(rows)]
    tasks = [[format_value(row[name]) for name in COLUMNS] for row in rows]
    parts += [heading("Tasks"), html_table([COLUMNS, *tasks], "wide")]
    parts += [heading("Run"), html_table([["what", "value"], *_flat(run)])]
    return html_page(title, parts)


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


def _report_study(folder: Path) -> None:
    from fabric_study.study_report import write_study_report  # pandas takes a second to load

    page, missing = write_study_report(folder)
    print(page)
    print(missing or page.with_suffix(".pdf"))


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line; returns 0, or 2 when the folder cannot be reported on."""
    parser = argparse.ArgumentParser(
        prog="report", description="Report on a run or a study folder."
    )
    parser.add_argument("folder", type=Path, help="folder that holds results.csv or study.sqlite")
    folder = parser.parse_args(arguments).folder
    try:
        if (folder / STORE_FILE).exists():
            _report_study(folder)
        else:
            print(write_report(folder))
    except (OSError, ValueError) as error:
        print(f"report: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
