# SPDX-License-Identifier: BSD-3-Clause
"""`./fabric batch`: many tasks without ROS, faster than real time, on every core.

    python3 -m fabric_sim.batch tasks:=100 seed:=1 seeds:=5 policy:=proactive,reactive human:=mixed

Writes results.csv, events.csv (a large one as events.csv.gz), timing.csv, summary.txt and run.json
into out_dir; prints the summary and the hash of the event log. The same words always give the same
results.csv and events.csv, whatever `jobs` is. With sensing:=camera perception works on pictures.
"""

from __future__ import annotations

import gzip
import multiprocessing
import shutil
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from tqdm import tqdm

from fabric_sim.batch_files import Files
from fabric_sim.batch_loop import HeadlessRun, RunSetup, TaskResult
from fabric_sim.camera.drawing import CannotDraw
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

CAMERA = "camera"
REFRESH = 0.5  # s between looks at how far the processes are
Done = tuple[TaskResult, list[LogRow]]  # a task and what happened in it
LARGE = 20_000_000  # bytes; a longer log is compressed


class Job(NamedTuple):
    """A run and how many tasks of it, as `sensing` sees them."""

    setup: RunSetup
    tasks: int
    sensing: str = "direct"


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
    sensing: str = "direct"
    task: str = ""  # definition; empty: the scenario's own

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
            sensing=value["sensing"],
            task=value["task"],
        )

    def job_list(self) -> list[Job]:
        """One job a run, policy by policy."""
        return [
            Job(self._setup(policy, seed), self.tasks, self.sensing)
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
            task=self.task,
        )


def run_job(job: Job) -> list[Done]:
    """All tasks of one run, in order. Raises CannotDraw where sensing:=camera is impossible."""
    if job.sensing != CAMERA:
        return _tasks_of(HeadlessRun(job.setup), job.tasks)
    from fabric_sim.batch_camera import CameraRun  # takes a moment, which others need not wait

    with CameraRun(job.setup) as run:
        return _tasks_of(run, job.tasks)


def require_pictures(jobs: Sequence[Job]) -> None:
    """Raise CannotDraw when a job needs pictures and none can be made here, ValueError when a
    setting of camera or perception is wrong: ask before files are written. A process of its own
    tries it, because graphics do not survive a fork: whoever has drawn before is refused, too."""
    if all(job.sensing != CAMERA for job in jobs):
        return
    if RENDERER in sys.modules:
        raise CannotDraw(
            "sensing:=camera draws in processes forked from this one, and graphics opened here do "
            "not survive that: start it from a process that has drawn nothing"
        )
    with ProcessPoolExecutor(1, multiprocessing.get_context("fork")) as pool:
        pool.submit(_try_to_draw).result()


def _try_to_draw() -> None:
    from fabric_sim.batch_camera_eyes import Eyes

    Eyes(Files(), seed=0).close()


def _tasks_of(run: HeadlessRun, tasks: int) -> list[Done]:
    done = []
    for _ in range(tasks):
        done.append((run.run_task(), run.event_log()))
        _count_task()
    return done


RENDERER = "fabric_sim.camera.renderer"  # imported by who draws
_finished = None  # shared by the processes: how many tasks have ended


def _share(counter: Any) -> None:
    global _finished
    _finished = counter


def _count_task() -> None:
    if _finished is not None:
        with _finished.get_lock():
            _finished.value += 1


def results_of(jobs: Sequence[Job], processes: int) -> Iterator[tuple[Job, list[Done]]]:
    """Every job with its results, in the order of the list, spread over the processes."""
    # fork, before there are threads: a fresh interpreter does not find modules of a devel space
    fork = multiprocessing.get_context("fork")
    counter = fork.Value("q", 0)
    with ProcessPoolExecutor(min(processes, len(jobs)), fork, _share, (counter,)) as pool:
        tasks = sum(job.tasks for job in jobs)
        done = [pool.submit(run_job, job) for job in jobs]
        try:
            with tqdm(total=tasks, unit="task", leave=False) as bar:
                for job, future in zip(jobs, done, strict=True):
                    while not future.done():
                        wait([future], REFRESH)
                        bar.update(counter.value - bar.n)
                    yield job, future.result()
        finally:  # one that failed ends all
            pool.shutdown(cancel_futures=True)


def write(plan: Plan) -> str:
    """Run everything, write the files, return the summary."""
    record = RunRecord(plan.out_dir, {**vars(plan), "seeds": list(plan.seeds), "out_dir": ""})
    results = ResultsWriter(plan.out_dir / "results.csv")
    timing = TimingWriter(plan.out_dir / "timing.csv")
    log = EventLogWriter(plan.out_dir / LOG_FILE)
    rows, root_seeds = [], []
    for job, tasks in results_of(plan.job_list(), plan.jobs):
        for task, happened in tasks:
            results.write(task.row)
            log.write_task(happened)
            timing.write_decisions(job.setup.policy, task.decisions)
            rows.append(task.row)
            root_seeds.append(job.setup.seed)
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
    try:
        require_pictures(plan.job_list())
    except (CannotDraw, ValueError) as error:
        print(f"fabric: {error}", file=sys.stderr)
        return 2
    print(write(plan))
    print(f"events   {pack(plan.out_dir / LOG_FILE)}")
    print(f"results  {plan.out_dir / 'results.csv'}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
