# SPDX-License-Identifier: BSD-3-Clause
"""`./fabric batch`: many tasks without ROS, faster than real time, on every core.

    python3 -m fabric_sim.batch tasks:=100 seed:=1 seeds:=5 policy:=proactive,reactive human:=mixed

Writes results.csv, events.csv (a large one as events.csv.gz), timing.csv, summary.txt and run.json
into out_dir; prints the summary and the hash of the event log. The same words always give the same
results.csv and events.csv, whatever `jobs` is.
"""

from __future__ import annotations

import gzip
import multiprocessing
import shutil
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from tqdm import tqdm

from fabric_sim.batch_loop import HeadlessRun, RunSetup, TaskResult
from fabric_study.comparison import comparison_lines
from fabric_study.event_log import LOG_FILE, EventLogWriter, digest_line
from fabric_study.event_rows import LogRow
from fabric_study.results import (
    ResultsWriter,
    TimingWriter,
    latency_lines,
    read_timing,
    summary_text,
)
from fabric_study.run_record import RunRecord

Job = tuple[RunSetup, int]  # the run, how many tasks
Done = tuple[TaskResult, list[LogRow]]  # a task and what happened in it
LARGE = 20_000_000  # bytes; a longer log is compressed


@dataclass(frozen=True)
class Plan:
    """The words of the command, parsed."""

    tasks: int
    seeds: range
    scenario: str
    human: str
    policies: tuple[str, ...]
    jobs: int
    out_dir: Path
    selector: str = ""  # file of ABPS' parameters
    library: str = ""  # folder of ABPS' library

    @classmethod
    def parse(cls, words: Sequence[str]) -> Plan:
        """Read `name:=value` words that fabric_bringup.arguments has checked."""
        value = dict(word.split(":=", 1) for word in words)
        first = int(value["seed"])
        return cls(
            tasks=int(value["tasks"]),
            seeds=range(first, first + int(value["seeds"])),
            scenario=value["scenario"],
            human=value["human"],
            policies=tuple(value["policy"].split(",")),
            jobs=int(value["jobs"]) or multiprocessing.cpu_count(),
            out_dir=Path(value["out_dir"]),
            selector=value["selector"],
            library=value["library"],
        )

    def job_list(self) -> list[Job]:
        """One job a run, policy by policy."""
        return [
            (self._setup(policy, seed), self.tasks)
            for policy in self.policies
            for seed in self.seeds
        ]

    def _setup(self, policy: str, seed: int) -> RunSetup:
        return RunSetup(
            self.scenario,
            self.human,
            policy,
            seed,
            selector=self.selector,
            library=self.library,
        )


def run_job(job: Job) -> list[Done]:
    """All tasks of one run, in order."""
    setup, tasks = job
    run = HeadlessRun(setup)
    return [(run.run_task(), run.event_log()) for _ in range(tasks)]


def results_of(plan: Plan) -> Iterator[tuple[Job, list[Done]]]:
    """Every job with its results, in the order of the list, spread over the processes."""
    jobs = plan.job_list()
    # fork, before there are threads: a fresh interpreter does not find modules of a devel space
    fork = multiprocessing.get_context("fork")
    with ProcessPoolExecutor(min(plan.jobs, len(jobs)), mp_context=fork) as pool:
        done = pool.map(run_job, jobs)
        yield from zip(jobs, tqdm(done, total=len(jobs), unit="run", leave=False), strict=True)


def write(plan: Plan) -> str:
    """Run everything, write the files, return the summary."""
    record = RunRecord(plan.out_dir, {**vars(plan), "seeds": list(plan.seeds), "out_dir": ""})
    results = ResultsWriter(plan.out_dir / "results.csv")
    timing = TimingWriter(plan.out_dir / "timing.csv")
    log = EventLogWriter(plan.out_dir / LOG_FILE)
    rows, root_seeds = [], []
    for (setup, _), tasks in results_of(plan):
        for task, happened in tasks:
            results.write(task.row)
            log.write_task(happened)
            timing.write_decisions(setup.policy, task.decisions)
            rows.append(task.row)
            root_seeds.append(setup.seed)
            record.task_done()
    results.close()
    timing.close()
    log.close()
    text = summary_text(rows)
    text += "\n".join(comparison_lines(rows, root_seeds)) + "\n"
    text += "\n".join(latency_lines(read_timing(plan.out_dir / "timing.csv"))) + "\n"
    (plan.out_dir / "summary.txt").write_text(text, encoding="utf-8")
    record.end("finished")
    return f"{text}\n{digest_line(plan.out_dir)}"


def pack(path: Path) -> Path:
    """Compress a log that is large; return where it is now."""
    if path.stat().st_size <= LARGE:
        return path
    packed = path.with_name(path.name + ".gz")
    with path.open("rb") as plain, gzip.open(packed, "wb") as file:
        shutil.copyfileobj(plain, file)
    path.unlink()
    return packed


def main(words: Sequence[str]) -> int:
    """Run the command; return its exit code."""
    plan = Plan.parse(words)
    print(write(plan))
    print(f"events   {pack(plan.out_dir / LOG_FILE)}")
    print(f"results  {plan.out_dir / 'results.csv'}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
