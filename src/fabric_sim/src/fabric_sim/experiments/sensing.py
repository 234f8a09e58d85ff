# SPDX-License-Identifier: BSD-3-Clause
"""`./fabric experiment sensing`: the same people and cubes, seen by cameras and told directly.

    python3 -m fabric_sim.experiments.command sensing --seed 101 --seeds 4

Every seed is run twice: perception on pictures (sensing:=camera), and labels with errors
(sensing:=direct). Writes results.csv (one row a task) and summary.json and prints what
differs, in pairs of equal seed and task. In percentage points the difference should be 5 at most.
"""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fabric_sim.batch import Job, require_pictures, results_of
from fabric_sim.batch_loop import RunSetup
from fabric_sim.camera.drawing import CannotDraw
from fabric_sim.experiments.paired import Interval, mean_of
from fabric_sim.experiments.shell import new_folder, positive, tell, without_nan
from fabric_study.meter import COLUMNS, Value
from fabric_study.results import TableWriter
from fabric_study.run_record import RunRecord

KINDS = ("camera", "direct")
RESULT_COLUMNS = ("sensing", "root_seed", *COLUMNS)
POINTS = 5.0  # percentage points that cameras may differ by
ENDS = ("human_succeeded", "human_failed", "robot_succeeded", "robot_failed")
Row = Mapping[str, Value]


@dataclass(frozen=True)
class Plan:
    """The words of the command."""

    scenario: str
    human: str
    policy: str
    seeds: range
    tasks: int
    jobs: int
    as_json: bool
    out_dir: Path

    @classmethod
    def parse(cls, words: Sequence[str]) -> Plan:
        """Read the words; argparse ends the program with 2 and a reason when it cannot."""
        given = _parser().parse_args(words)
        return cls(
            scenario=given.scenario,
            human=given.human,
            policy=given.policy,
            seeds=range(given.seed, given.seed + given.seeds),
            tasks=given.tasks,
            jobs=given.jobs or multiprocessing.cpu_count(),
            as_json=given.json,
            out_dir=given.out or new_folder("sensing"),
        )

    def job_list(self) -> list[Job]:
        """Every run, the slow ones first."""
        return [
            Job(RunSetup(self.scenario, self.human, self.policy, seed), self.tasks, kind)
            for kind in KINDS
            for seed in self.seeds
        ]


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="fabric experiment sensing", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--scenario", default="sorting", choices=("inspection", "sorting"))
    parser.add_argument("--human", default="random", help="as of ./fabric batch (random)")
    parser.add_argument("--policy", default="proactive", help="as of ./fabric batch (proactive)")
    parser.add_argument("--seed", type=positive, default=1, help="of the first run (1)")
    parser.add_argument("--seeds", type=positive, default=20, help="how many runs (20)")
    parser.add_argument("--tasks", type=positive, default=1, help="of a run (1)")
    parser.add_argument("--jobs", type=positive, help="processes (one a core)")
    parser.add_argument("--json", action="store_true", help="print one JSON object a line")
    parser.add_argument("--out", type=Path, help="new folder (runs/<date>_<time>_sensing)")
    return parser


# -- what is compared -----------------------------------------------------------------------------


class Measure(NamedTuple):
    """A line of the table. of: its value in a row, None where undefined. judged: in points."""

    title: str
    of: Callable[[Row], float | None]
    judged: bool
    digits: int = 1


def _share(column: str) -> Callable[[Row], float | None]:
    """A ratio of the row, in percent."""
    return lambda row: None if row[column] is None else 100.0 * float(row[column])


def _per_cube(column: str) -> Callable[[Row], float | None]:
    """A count of the row, of 100 cubes that were dealt with."""

    def value(row: Row) -> float | None:
        cubes = sum(int(row[end]) for end in ENDS)
        return 100.0 * float(row[column]) / cubes if cubes else None

    return value


def _plain(column: str) -> Callable[[Row], float | None]:
    return lambda row: None if row[column] is None else float(row[column])


MEASURES = (
    Measure("tasks that succeed, %", _share("success"), judged=True),
    Measure("cubes that end right, %", _share("task_success_rate"), judged=True),
    Measure("warnings, of 100 cubes", _per_cube("warnings"), judged=True),
    Measure("warnings nobody gave, of 100", _per_cube("false_warnings"), judged=True),
    Measure("stage 1 estimated right, %", _share("stage1_accuracy"), judged=True),
    Measure("stage 2 estimated right, %", _share("stage2_accuracy"), judged=True),
    Measure("reward a task", _plain("discounted_reward"), judged=False),
    Measure("duration of a task, s", _plain("duration_s"), judged=False),
    Measure("decisions a task", _plain("decisions"), judged=False),
)


class Line(NamedTuple):
    """A measure of both; the difference is over the n pairs in which both have a value."""

    measure: Measure
    n: int
    camera: Interval
    direct: Interval
    difference: Interval

    @property
    def within(self) -> bool:
        """Whether the mean difference is small enough; NaN is not."""
        return abs(self.difference.value) <= POINTS


def lines_of(rows: Iterable[Row]) -> list[Line]:
    """Compare rows of RESULT_COLUMNS in pairs; a measure without a pair is NaN."""
    tasks: dict[tuple[Value, Value], dict[Value, Row]] = {}
    for row in rows:
        tasks.setdefault((row["root_seed"], row["task"]), {})[row["sensing"]] = row
    pairs = [[both[kind] for kind in KINDS] for both in tasks.values() if len(both) == len(KINDS)]
    return [_line(measure, pairs) for measure in MEASURES]


def _line(measure: Measure, pairs: Sequence[Sequence[Row]]) -> Line:
    values = [[measure.of(row) for row in pair] for pair in pairs]
    known = np.array([pair for pair in values if None not in pair], dtype=float).reshape(-1, 2)
    if not len(known):
        nothing = Interval(math.nan, math.nan, math.nan)
        return Line(measure, 0, nothing, nothing, nothing)
    camera, direct = known.T
    return Line(measure, len(known), mean_of(camera), mean_of(direct), mean_of(camera - direct))


# -- what is told ---------------------------------------------------------------------------------


def table_text(plan: Plan, lines: Sequence[Line]) -> str:
    """The table for the screen."""
    seeds = f"seeds {plan.seeds[0]} to {plan.seeds[-1]}, {plan.tasks} task(s) each"
    text = [f"{plan.scenario}, human {plan.human}, policy {plan.policy}; {seeds}"]
    interval, small = "camera - direct, 95 % interval", f"<= {POINTS:g} points"
    text.append(f"{'':<28}{'camera':>8}{'direct':>8}  {interval:<31}{'pairs':>6}  {small}")
    text += [_table_line(line) for line in lines]
    return "\n".join(text)


def _table_line(line: Line) -> str:
    title, _, judged, digits = line.measure
    means = f"{line.camera.value:>8.{digits}f}{line.direct.value:>8.{digits}f}"
    difference = line.difference
    between = f"[{difference.low:+.{digits}f}, {difference.high:+.{digits}f}]"
    verdict = ("yes" if line.within else "no") if judged else ""
    text = f"{title:<28}{means}  {difference.value:>+7.{digits}f} {between:<23}{line.n:>6}"
    return f"{text}  {verdict}".rstrip()


def summary(lines: Sequence[Line]) -> list[dict[str, Any]]:
    """The table as data."""
    return [
        without_nan(
            {
                "measure": line.measure.title,
                "pairs": line.n,
                **{name: asdict(getattr(line, name)) for name in (*KINDS, "difference")},
                "within": line.within if line.measure.judged else None,
            }
        )
        for line in lines
    ]


def run(plan: Plan) -> list[dict[str, Value]]:
    """Run everything and write results.csv; return its rows.

    Raises CannotDraw and FileExistsError before anything is written, ValueError for a word that a
    run refuses.
    """
    jobs = plan.job_list()
    require_pictures(jobs)
    settings = {**vars(plan), "seeds": list(plan.seeds), "out_dir": ""}
    record = RunRecord(plan.out_dir, settings)
    results = TableWriter(plan.out_dir / "results.csv", RESULT_COLUMNS)
    rows = []
    for job, tasks in results_of(jobs, plan.jobs):
        for task, _ in tasks:
            rows.append({"sensing": job.sensing, "root_seed": job.setup.seed, **task.row})
            results.write(rows[-1])
            record.task_done()
    results.close()
    record.end("finished")
    return rows


def main(words: Sequence[str]) -> int:
    """Run the experiment; 2 when no picture can be made or a word of a run is refused."""
    plan = Plan.parse(words)
    try:
        lines = lines_of(run(plan))
    except (CannotDraw, ValueError, FileExistsError) as error:
        print(f"fabric: {error}", file=sys.stderr)
        return 2
    path = plan.out_dir / "summary.json"
    path.write_text(json.dumps(summary(lines), indent=1) + "\n", encoding="utf-8")
    written = (plan.out_dir / "results.csv", path)
    tell(table_text(plan, lines), summary(lines), written, plan.as_json)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
