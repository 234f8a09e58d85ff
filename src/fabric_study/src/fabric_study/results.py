# SPDX-License-Identifier: BSD-3-Clause
"""The record of a run as tables: results.csv, timing.csv, and the summary over tasks.

results.csv holds nothing that depends on the machine, so equal runs give equal files;
what planning took is in timing.csv.
"""

import csv
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from scipy import stats

from fabric_study.meter import COLUMNS, Value

TIMING_COLUMNS = (
    "task",
    "observation",
    "policy",
    "planning_time_s",
    "nodes",
    "deadline_missed",
    "fallback_used",
)
INTEGERS = (
    "task",
    "seed",
    "success",
    "warnings",
    "false_warnings",
    "decisions",
    "human_succeeded",
    "human_failed",
    "robot_succeeded",
    "robot_failed",
)
WORDS = ("scenario", "human", "policy", "model")
SUMMARY_COLUMNS = (
    ("discounted_reward", "reward"),
    ("success", "success"),
    ("warnings", "warnings"),
    ("false_warnings", "false warnings"),
    ("duration_s", "duration s"),
    ("decisions", "decisions"),
    ("human_success_rate", "human success"),
    ("human_contribution", "human share"),
    ("task_success_rate", "subtasks right"),
    ("efficiency", "efficiency"),
    ("stage1_accuracy", "stage 1"),
    ("stage2_accuracy", "stage 2"),
    ("type_belief_entropy", "type entropy"),
)
CONFIDENCE = 0.95
Row = Mapping[str, Value]


def format_value(value: Value) -> str:
    """Return a cell: nothing for None, six decimals for numbers that are not whole.

    Raises ValueError for NaN and infinity: what is undefined is None.
    """
    if value is None:
        return ""
    if isinstance(value, float):
        if not math.isfinite(value):
            raise ValueError(f"a result is {value}; undefined results are None")
        return f"{value + 0.0:.6f}"  # + 0.0 turns -0.0 into 0.0
    return str(int(value)) if isinstance(value, bool) else str(value)


class TableWriter:
    """A CSV file that grows row by row; every row is on its way to the disk when written."""

    def __init__(self, path: Path, columns: Sequence[str], append: bool = False) -> None:
        """Open the file and write the header.

        An existing file is refused (FileExistsError) unless `append` is true; then its header must
        be the same (ValueError).
        """
        self._columns = tuple(columns)
        exists = path.exists()
        if exists and not append:
            raise FileExistsError(f"{path} holds the results of another run")
        if exists:
            _check_header(path, self._columns)
        self._file = path.open("a" if append else "x", newline="", encoding="utf-8")
        self._writer = csv.writer(self._file, lineterminator="\n")
        if not exists:
            self._writer.writerow(self._columns)
            self._file.flush()

    def write(self, row: Row) -> None:
        """Append one row. Raises ValueError when its columns are not those of the file."""
        if tuple(row) != self._columns:
            raise ValueError(f"columns are {', '.join(row)}; must be {', '.join(self._columns)}")
        self._writer.writerow([format_value(row[column]) for column in self._columns])
        self._file.flush()

    def close(self) -> None:
        """Close the file; closing twice is fine."""
        self._file.close()


class ResultsWriter(TableWriter):
    """results.csv: one row a task, columns of `meter.COLUMNS`."""

    def __init__(self, path: Path, append: bool = False) -> None:
        super().__init__(path, COLUMNS, append)


class TimingWriter(TableWriter):
    """timing.csv: one row a decision."""

    def __init__(self, path: Path, append: bool = False) -> None:
        super().__init__(path, TIMING_COLUMNS, append)

    def write_decisions(self, policy: str, decisions: Iterable[Any]) -> None:
        """Append Decision messages."""
        for decision in decisions:
            values = (
                decision.task_id,
                decision.observation_sequence,
                policy,
                float(decision.planning_time),
                decision.nodes,
                int(decision.deadline_missed),
                int(decision.fallback_used),
            )
            self.write(dict(zip(TIMING_COLUMNS, values, strict=True)))


def _check_header(path: Path, columns: Sequence[str]) -> None:
    with path.open(newline="", encoding="utf-8") as file:
        header = next(csv.reader(file), [])
    if tuple(header) != tuple(columns):
        raise ValueError(f"{path}: columns are {', '.join(header)}; must be {', '.join(columns)}")


def read_results(path: Path) -> list[dict[str, Value]]:
    """Return the rows of a results.csv, typed; empty cells are None.

    Raises ValueError naming file, line, column and value.
    """
    _check_header(path, COLUMNS)
    return _read(path, lambda column, cell: _typed(column, cell, INTEGERS, WORDS))


def read_timing(path: Path) -> list[dict[str, Value]]:
    """Return the rows of a timing.csv, typed. Raises as `read_results`."""
    _check_header(path, TIMING_COLUMNS)
    integers = [name for name in TIMING_COLUMNS if name not in ("policy", "planning_time_s")]
    return _read(path, lambda column, cell: _typed(column, cell, integers, ("policy",)))


def _read(path: Path, convert: Any) -> list[dict[str, Value]]:
    rows = []
    with path.open(newline="", encoding="utf-8") as file:
        reader = csv.DictReader(file, restval="", restkey="")
        for cells in reader:
            try:
                rows.append({column: convert(column, cell) for column, cell in cells.items()})
            except ValueError as error:
                raise ValueError(f"{path}, line {reader.line_num}: {error}") from error
    return rows


def _typed(column: str, cell: Any, integers: Sequence[str], words: Sequence[str]) -> Value:
    if column == "":
        raise ValueError(f"more cells than columns: {cell!r}")
    if column in words:
        return str(cell)
    if cell == "":
        return None
    try:
        value = int(cell) if column in integers else float(cell)
    except ValueError:
        raise ValueError(f"{column} is {cell!r}; it must be a number") from None
    if not math.isfinite(value):
        raise ValueError(f"{column} is {cell}; it must be finite")
    return value


def mean_interval(values: Sequence[float]) -> tuple[float | None, float | None]:
    """Return the mean and the half width of its 95 % interval (Student's t).

    The mean of nothing is None; the half width of fewer than two values too.
    """
    n = len(values)
    if n == 0:
        return None, None
    mean = math.fsum(values) / n
    if n == 1:
        return mean, None
    variance = math.fsum((value - mean) ** 2 for value in values) / (n - 1)
    quantile = float(stats.t.ppf(0.5 + CONFIDENCE / 2.0, n - 1))
    return mean, quantile * math.sqrt(variance / n)


def percentile(values: Sequence[float], share: float) -> float | None:
    """Return the least value that a `share` (0..1) of the values do not exceed, None of nothing."""
    if not values:
        return None
    ordered = sorted(values)
    return ordered[max(math.ceil(share * len(ordered)) - 1, 0)]


def by_policy(rows: Iterable[Row]) -> dict[str, list[Row]]:
    """Return the rows of each policy, in order of first appearance."""
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(str(row["policy"]), []).append(row)
    return groups


def column(rows: Iterable[Row], name: str) -> list[float]:
    """Return the defined numbers of a column."""
    return [float(row[name]) for row in rows if row[name] is not None]  # type: ignore[arg-type]


def summary_table(rows: Sequence[Row]) -> list[list[str]]:
    """Return the summary, header first: one line a measure, one column a policy."""
    groups = by_policy(rows)
    table = [["measure", *groups], ["tasks", *(str(len(group)) for group in groups.values())]]
    for name, title in SUMMARY_COLUMNS:
        cells = [_cell(*mean_interval(column(group, name))) for group in groups.values()]
        if any(cells):
            table.append([title, *cells])
    return table


def latency_lines(timing: Sequence[Row]) -> list[str]:
    """Return a line on decision latency, p50 and p99 in ms, for each policy."""
    lines = []
    for policy, rows in by_policy(timing).items():
        times = column(rows, "planning_time_s")
        p50, p99 = percentile(times, 0.50), percentile(times, 0.99)
        missed = int(sum(column(rows, "deadline_missed")))
        fallback = int(sum(column(rows, "fallback_used")))
        lines.append(
            f"decision latency {policy}: p50 {1e3 * (p50 or 0.0):.1f} ms, "
            f"p99 {1e3 * (p99 or 0.0):.1f} ms over {len(times)} decisions; "
            f"deadline missed {missed}, fallback used {fallback}"
        )
    return lines


def summary_text(rows: Sequence[Row], timing: Sequence[Row] = ()) -> str:
    """Return the table of `summary_table` and the latencies as text for people."""
    table = summary_table(rows)
    widths = [max(len(line[index]) for line in table) for index in range(len(table[0]))]
    lines = [
        "  ".join(
            [line[0].ljust(widths[0])]
            + [cell.rjust(width) for cell, width in zip(line[1:], widths[1:], strict=True)]
        ).rstrip()
        for line in table
    ]
    lines.insert(1, "-" * max(map(len, lines)))
    lines.append("means with 95 % intervals over tasks (Student's t)")
    return "\n".join(lines + latency_lines(timing)) + "\n"


def _cell(mean: float | None, half: float | None) -> str:
    if mean is None:
        return ""
    return f"{mean:.3f}" if half is None else f"{mean:.3f} ± {half:.3f}"
