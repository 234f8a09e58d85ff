# SPDX-License-Identifier: BSD-3-Clause
"""`./fabric experiment short-term`: the study of thesis section 4.3, rerun and extended.

    python3 -m fabric_sim.experiments.command short-term --quick

One person works 40 tasks beside a robot and drifts; every robot meets the same people. Writes
results.csv (one row a task), scenarios.csv (one row a scenario), confusion.csv, tests.json and
report.html into a folder and prints Table 4.1 with the published values.
"""

from __future__ import annotations

import argparse
import csv
import json
import multiprocessing
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path

from tqdm import tqdm

from fabric_sim.experiments.robots import TITLES, Believed, write_never_help
from fabric_sim.experiments.scenario import (
    TASK_COLUMNS,
    ScenarioJob,
    ScenarioResult,
    run_scenario,
)
from fabric_sim.experiments.shell import new_folder, positive, tell
from fabric_sim.experiments.short_term_report import report_html
from fabric_sim.experiments.short_term_table import (
    SCENARIO_COLUMNS,
    Study,
    json_lines,
    scenario_row,
    table_text,
)
from fabric_study.results import TableWriter
from fabric_study.run_record import RunRecord

FILES = ("results.csv", "scenarios.csv", "confusion.csv", "tests.json", "report.html")
NOISES = (0.1, 0.0)
ROBOTS = ("proactive", "reactive", "reactive_waiting", "none", "never_help", "oracle")


@dataclass(frozen=True)
class Plan:
    """The words of the command."""

    tasks: int
    seeds: range
    robots: tuple[str, ...]
    noises: tuple[float, ...]
    jobs: int
    as_json: bool
    out_dir: Path

    @classmethod
    def parse(cls, words: Sequence[str]) -> Plan:
        """Read the words; argparse ends the program with 2 and a reason when it cannot."""
        parser = _parser()
        given = parser.parse_args(words)
        robots = tuple(dict.fromkeys(given.robots.split(",")))
        for robot in robots:
            if robot not in TITLES:
                parser.error(f"--robots: no robot {robot!r}; there are {', '.join(TITLES)}")
        if not {"proactive", "reactive"} <= set(robots):
            parser.error("--robots: proactive and reactive are what the study compares")
        scenarios = given.scenarios or (4 if given.quick else 30)
        if scenarios < 2:
            parser.error("--scenarios: 2 or more are needed to compare")
        tasks = given.tasks or (20 if given.quick else 40)
        out = given.out or new_folder("short-term")
        return cls(
            tasks=tasks,
            seeds=range(given.seed, given.seed + scenarios),
            robots=robots,
            noises=given.noise,
            jobs=given.jobs or multiprocessing.cpu_count(),
            as_json=given.json,
            out_dir=out,
        )

    def job_list(self) -> list[ScenarioJob]:
        """Every scenario of the study."""
        return [
            ScenarioJob(robot, noise, seed, self.tasks, self.out_dir)
            for noise in self.noises
            for robot in self.robots
            for seed in self.seeds
        ]


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="fabric experiment short-term", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--quick", action="store_true", help="4 scenarios of 20 tasks")
    parser.add_argument("--scenarios", type=positive, help="how many (30); seeds count up")
    parser.add_argument("--seed", type=positive, default=1, help="of the first scenario (1)")
    parser.add_argument("--tasks", type=positive, help="in a scenario (40)")
    parser.add_argument("--robots", default=",".join(ROBOTS), help=f"of {','.join(TITLES)}")
    parser.add_argument("--noise", default=NOISES, type=_noises, help="of recognition (0.1,0)")
    parser.add_argument("--jobs", type=positive, help="processes (one a core)")
    parser.add_argument("--json", action="store_true", help="print one JSON object a line")
    parser.add_argument("--out", type=Path, help="new folder (runs/<date>_<time>_short-term)")
    return parser


def _noises(text: str) -> tuple[float, ...]:
    values = tuple(dict.fromkeys(float(part) for part in text.split(",")))
    for value in values:
        if not 0.0 <= value <= 1.0:  # refuses NaN as well
            raise argparse.ArgumentTypeError(f"{value} is outside 0..1")
    return values


def run_all(plan: Plan) -> list[ScenarioResult]:
    """Run every scenario, spread over the processes; the results are in the order of the jobs."""
    jobs = plan.job_list()
    # fork, before there are threads: a fresh interpreter does not find modules of a devel space
    fork = multiprocessing.get_context("fork")
    with ProcessPoolExecutor(min(plan.jobs, len(jobs)), mp_context=fork) as pool:
        done = pool.map(run_scenario, jobs)
        return list(tqdm(done, total=len(jobs), unit="scenario", leave=False))


def study_of(plan: Plan, results: Iterable[ScenarioResult]) -> Study:
    """Return the results in the form of the tables."""
    believed: dict[tuple[float, str], Counter[Believed]] = {}
    tasks, scenarios = [], []
    for result in results:
        tasks += result.rows
        scenarios.append(scenario_row(result.rows))
        key = (result.job.noise, result.job.robot)
        believed[key] = believed.get(key, Counter()) + result.believed
    return Study(plan.robots, plan.noises, tasks, scenarios, believed)


def write(plan: Plan, study: Study) -> list[Path]:
    """Write the tables and the report; return their paths."""
    paths = [plan.out_dir / name for name in FILES]
    _write_rows(paths[0], TASK_COLUMNS, study.tasks)
    _write_rows(paths[1], SCENARIO_COLUMNS, study.scenarios)
    with paths[2].open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("noise", "robot", "truth", "belief", "decisions"))
        for (noise, robot), counts in study.believed.items():
            writer.writerows((noise, robot, *pair, n) for pair, n in sorted(counts.items()))
    paths[3].write_text(json.dumps(json_lines(study), indent=1) + "\n", encoding="utf-8")
    paths[4].write_text(report_html(study), encoding="utf-8")
    return paths


def _write_rows(path: Path, columns: Sequence[str], rows: Iterable[dict]) -> None:
    writer = TableWriter(path, columns)
    for row in rows:
        writer.write(row)
    writer.close()


def main(words: Sequence[str]) -> int:
    """Run the experiment; 0 when it ran, whatever it found, 2 when the folder is not new."""
    plan = Plan.parse(words)
    if (plan.out_dir / "run.json").exists():
        print(f"{plan.out_dir} holds the results of another run; name a new --out", file=sys.stderr)
        return 2
    record = RunRecord(plan.out_dir, {**asdict(plan), "seeds": list(plan.seeds), "out_dir": ""})
    write_never_help(plan.out_dir)
    study = study_of(plan, run_all(plan))
    paths = write(plan, study)
    record.end("finished")
    tell(table_text(study), json_lines(study), paths, plan.as_json)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
