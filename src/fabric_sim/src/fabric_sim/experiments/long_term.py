# SPDX-License-Identifier: BSD-3-Clause
"""`./fabric experiment long-term`: the study of thesis section 5.3, rerun and extended.

    python3 -m fabric_sim.experiments.command long-term --quick

Robots that choose among the policies of the library, and every policy of it alone, work with people
whom none of them knows. Writes shifts.csv (one row a shift and strategy), tasks.csv (what ABPS did,
one row a task), tests.json and report.html into a folder and prints Table 5.1 with the published
values.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from fabric_abps import Policy
from fabric_sim.batch_files import Files
from fabric_sim.experiments.long_term_ablation import AblationResult, run_ablations
from fabric_sim.experiments.long_term_report import report_html
from fabric_sim.experiments.long_term_run import (
    ABPS,
    Adaptation,
    Context,
    judge_everybody,
    run_adaptation,
    run_convergence,
)
from fabric_sim.experiments.long_term_shifts import MEASURES, Strategy, World
from fabric_sim.experiments.long_term_table import Study, json_lines, shift_rows, table_text
from fabric_sim.experiments.shell import new_folder, positive, tell
from fabric_study.results import TableWriter
from fabric_study.run_record import RunRecord

FILES = ("shifts.csv", "tasks.csv", "tests.json", "report.html")
SCENARIOS = ("sorting", "inspection")
CHOOSERS = {  # criterion: title
    "expected_improvement": "expected improvement (Eq. 5.4)",
    "probability_of_improvement": "probability of improvement",
    "thompson": "Thompson sampling",
    "exp4": "bandit (exp4)",
    "random": "by lot",
}
TITLES = {ABPS: "ABPS", **CHOOSERS}


@dataclass(frozen=True)
class Plan:
    """The words of the command."""

    scenario: str
    seed: int
    orders: int
    people: int
    tasks: int
    workers: int
    repeats: int
    library: Path | None
    also: Path | None
    ablation_orders: int
    ablations: bool
    jobs: int
    as_json: bool
    out_dir: Path

    @classmethod
    def parse(cls, words: Sequence[str]) -> Plan:
        """Read the words; argparse ends the program with 2 and a reason when it cannot."""
        parser = _parser()
        given = parser.parse_args(words)
        sizes = {
            name: getattr(given, name) or (quick if given.quick else full)
            for name, (full, quick, _) in SIZES.items()
        }
        for name in ("orders", "workers", "ablation_orders"):
            if sizes[name] < 2:
                parser.error(f"--{_option(name)}: 2 or more are needed to compare")
        for name in ("library", "also"):
            folder = getattr(given, name)
            if folder is not None and not folder.is_dir():
                parser.error(f"--{name}: {folder} is no folder")
        return cls(
            scenario=given.scenario,
            seed=given.seed,
            **sizes,
            library=given.library,
            also=given.also,
            ablations=not (given.quick or given.no_ablations),
            jobs=given.jobs or multiprocessing.cpu_count(),
            as_json=given.json,
            out_dir=given.out or new_folder("long-term"),
        )

    def seeds(self, count: int) -> range:
        """The first `count` seeds."""
        return range(self.seed, self.seed + count)


SIZES = {  # option: default, with --quick, what it counts
    "orders": (20, 3, "orders of people; each has a seed of its own"),
    "people": (10, 3, "people in an order"),
    "tasks": (30, 10, "tasks of a person before another takes over"),
    "workers": (20, 4, "people that ABPS converges to"),
    "repeats": (8, 4, "times that it meets each of them anew"),
    "ablation_orders": (4, 3, "of the orders, that the ablations run over"),
}


def _option(name: str) -> str:
    return name.replace("_", "-")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="fabric experiment long-term", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--quick", action="store_true", help="little of everything, no ablations")
    parser.add_argument("--scenario", choices=SCENARIOS, default=SCENARIOS[0])
    parser.add_argument("--seed", type=positive, default=1, help="of the first order (1)")
    for name, (full, quick, what) in SIZES.items():
        about = f"{what} ({full}; quick: {quick})"
        parser.add_argument(f"--{_option(name)}", type=positive, help=about)
    parser.add_argument(
        "--also", type=Path, metavar="FOLDER", help="POMDPX policies from outside, as baselines"
    )
    parser.add_argument(
        "--library", type=Path, metavar="FOLDER", help="written by ./fabric train (the shipped one)"
    )
    parser.add_argument("--no-ablations", action="store_true", help="leave the ablations out")
    parser.add_argument("--jobs", type=positive, help="processes (one a core)")
    parser.add_argument("--json", action="store_true", help="print one JSON object a line")
    parser.add_argument("--out", type=Path, help="new folder (runs/<date>_<time>_long-term)")
    return parser


def add_outsiders(context: Context, folder: Path) -> tuple[list[str], list[str]]:
    """Prepare the models of a folder as further constants; return their names, and why not.

    A model that cannot be used is told by name and left out. Raises ValueError when none can.
    """
    names, refused = [], []
    for path in sorted([*folder.glob("*.pomdpx"), *folder.glob("*.pomdp")]):
        policy = Policy(f"outside {path.stem}", path.resolve(), "from outside")
        try:
            context.add_policies([policy])
        except ValueError as error:
            refused.append(str(error) if str(path) in str(error) else f"{path}: {error}")
        else:
            names.append(policy.name)
    if not names:
        reasons = "".join(f"\n  {reason}" for reason in refused)
        raise ValueError(f"{folder} holds no model that can be used{reasons}")
    return names, refused


def strategies(base: Strategy) -> Iterator[Strategy]:
    """ABPS as shipped, and the other ways to choose."""
    yield base
    for criterion, title in CHOOSERS.items():
        parameters = replace(base.parameters, criterion=criterion)
        yield replace(base, name=criterion, title=title, parameters=parameters)


def shipped(scenario: str, folder: Path | None = None) -> Strategy:
    """ABPS as the robot runs it; folder: with the library and models of another training.

    Raises ValueError when library and models do not fit.
    """
    found = Files().selector(scenario, library=str(folder or ""))
    return Strategy(ABPS, TITLES[ABPS], found.library, found.models, found.parameters)


def run_study(plan: Plan, base: Strategy) -> Study:
    """Run everything. Raises ValueError when a model cannot be used."""
    context = Context(World(plan.scenario))
    context.add_policies(base.library.policies)
    for strategy in strategies(base):
        context.add_strategy(strategy)
    also, refused = add_outsiders(context, plan.also) if plan.also else ([], [])
    for reason in refused:
        print(f"refused: {reason}", file=sys.stderr)
    library = base.library.names
    orders, workers = plan.seeds(plan.orders), plan.seeds(plan.workers)
    of_orders, of_workers = judge_everybody(
        context, orders, plan.people, workers, plan.tasks, library, plan.jobs
    )
    adaptation = run_adaptation(
        context,
        orders,
        plan.people,
        plan.tasks,
        list(context.strategies),
        library,
        also,
        of_orders,
        plan.jobs,
    )
    convergence = run_convergence(context, workers, plan.repeats, plan.tasks, of_workers, plan.jobs)
    ablation: list[AblationResult] = []
    if plan.ablations:
        ablation = run_ablations(
            context, adaptation, base, plan.out_dir, plan.ablation_orders, plan.jobs
        )
    types = list(base.models.types)
    return Study(plan.scenario, TITLES, types, adaptation, convergence, ablation, refused)


def task_rows(found: Adaptation) -> Iterator[dict[str, Any]]:
    """Return what ABPS did, one row a task."""
    for seed, course in zip(found.seeds, found.courses[ABPS], strict=True):
        for i, name in enumerate(course.policies):
            place, task = divmod(i, found.shift_tasks)
            yield {
                "order_seed": seed,
                "place": place + 1,
                "task": task + 1,
                "policy": name,
                "likeliest_type": int(course.types[i].argmax()),
                "its_probability": float(course.types[i].max()),
                "unlike_anyone_known": int(course.unlike[i]),
                **dict(zip(MEASURES, map(float, course.figures[i]), strict=True)),
            }


def write(plan: Plan, study: Study) -> list[Path]:
    """Write the tables and the report; return their paths."""
    paths = [plan.out_dir / name for name in FILES]
    _write_rows(paths[0], shift_rows(study.adaptation))
    _write_rows(paths[1], list(task_rows(study.adaptation)))
    paths[2].write_text(json.dumps(json_lines(study), indent=1) + "\n", encoding="utf-8")
    paths[3].write_text(report_html(study), encoding="utf-8")
    return paths


def _write_rows(path: Path, rows: Iterable[dict[str, Any]]) -> None:
    rows = list(rows)
    writer = TableWriter(path, list(rows[0]))
    for row in rows:
        writer.write(row)
    writer.close()


def _plain(plan: Plan) -> dict[str, Any]:
    """The plan as JSON takes it; where it writes is no part of it."""
    words = {name: str(v) if isinstance(v, Path) else v for name, v in asdict(plan).items()}
    return {**words, "out_dir": ""}


def main(words: Sequence[str]) -> int:
    """Run the experiment; 0 when it ran, whatever it found, 2 when it cannot be run."""
    plan = Plan.parse(words)
    if (plan.out_dir / "run.json").exists():
        print(f"{plan.out_dir} holds the results of another run; name a new --out", file=sys.stderr)
        return 2
    try:
        base = shipped(plan.scenario, plan.library)
    except ValueError as error:
        print(f"long-term: {error}", file=sys.stderr)
        return 2
    record = RunRecord(plan.out_dir, _plain(plan))
    try:
        study = run_study(plan, base)
        paths = write(plan, study)
    except ValueError as error:
        record.end("failed", str(error))
        print(f"long-term: {error}", file=sys.stderr)
        return 2
    record.end("finished")
    tell(table_text(study), json_lines(study), paths, plan.as_json)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
