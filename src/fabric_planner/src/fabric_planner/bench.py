# SPDX-License-Identifier: BSD-3-Clause
"""Measures the planner: `./fabric bench planner [--model FILE] [--only WORD] [--quick] [--json]`.

Every time is CPU time and stands beside its target, beside what a reference planner reached on
another machine, and where there is one beside the plain way of doing it in the same run: machines
differ, ratios less so. With --json each figure is one JSON object on its own line, the first of
them the hardware.
"""

import argparse
import json
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

import fabric_planner as fp
from fabric_planner import bench_tabular as tabular
from fabric_planner.bench_record import Figure, hardware
from fabric_planner.bench_report import line, table, write_plot
from fabric_planner.bench_standard import RUNS, standard
from fabric_planner.paths import models_folder, shipped_models

LIMIT = 700.0  # s of wall time after which no further episode of a standard problem begins
SOLVED = ("inspection_proactive", "sorting_proactive")  # shipped models that are solved at length

STANDARD = "standard " + " ".join(run.name for run in RUNS)

Part = tuple[str, Callable[[], Iterable[Figure]]]


def parser() -> argparse.ArgumentParser:
    result = argparse.ArgumentParser(prog="fabric bench planner", description="Planner figures.")
    result.add_argument("--model", metavar="FILE", help="measure this model, no others")
    result.add_argument("--lower", type=float, help="lower bound to be reached in time")
    result.add_argument("--cv", type=float, help="value that warm decisions must be worth")
    result.add_argument("--only", metavar="WORD", help="only parts whose name holds this word")
    result.add_argument("--quick", action="store_true", help="a tenth of the work, worse figures")
    result.add_argument("--json", action="store_true", help="one JSON object a line")
    result.add_argument("--plot", metavar="FILE", help="draw all figures, a PNG")
    return result


def parts(arguments: argparse.Namespace) -> list[Part]:
    """What is measured, cheap things first."""
    quick, begin = arguments.quick, time.monotonic()
    names = [arguments.model] if arguments.model else _shipped(SOLVED)
    models = [(str(name), fp.load(name)) for name in names]
    small = [model for _, model in models]
    seen = small if arguments.model else [tabular.tiger(), *map(fp.load, shipped_models())]
    solutions = tabular.Solutions(seconds=1.0 if quick else 10.0)
    result: list[Part] = [
        ("belief_update", lambda: _each(tabular.belief_update, seen)),
        ("cold", lambda: _each(tabular.cold, [path for path, _ in models])),
        ("bounds", lambda: _each(lambda m: tabular.bounds_in_time(
            m, solutions.of(m), arguments.lower), small)),
        ("warm_decision", lambda: _each(lambda m: tabular.warm_decision(
            m, solutions.of(m).lower, 100 if quick else 400, arguments.cv), small)),
        ("deadline", lambda: _each(lambda m: tabular.deadline_overrun(
            m, 20 if quick else 200), small)),
        ("trials", lambda: _each(tabular.pomcp_trials, small)),
    ]  # fmt: skip
    if not arguments.model:
        runs = [run for run in RUNS if _wanted(run.name, arguments.only)] or RUNS
        result.append((STANDARD, lambda: standard(
            runs, 0.1 if quick else 1.0, begin + LIMIT)))  # fmt: skip
    chosen = [part for part in result if _wanted(part[0], arguments.only)]
    if not chosen:
        raise fp.ModelError(f"--only {arguments.only}: there are {', '.join(p[0] for p in result)}")
    return chosen


def _wanted(name: str, word: str | None) -> bool:
    return word is None or word.lower() in name.lower()


def _shipped(names: Sequence[str]) -> list[Path]:
    return [models_folder() / f"{name}.pomdpx" for name in names]


def _each(measure: Callable[..., Iterable[Figure]], items: Iterable[object]) -> Iterator[Figure]:
    for item in items:
        yield from measure(item)


def figures(arguments: argparse.Namespace) -> Iterator[Figure]:
    yield hardware()
    for _, measure in parts(arguments):
        yield from measure()


def main(argv: Sequence[str] | None = None) -> int:
    arguments = parser().parse_args(argv)
    measured = []
    try:
        for figure in figures(arguments):
            print(json.dumps(figure) if arguments.json else line(figure), flush=True)
            measured.append(figure)
    except (fp.ModelError, OSError) as error:
        print(error, file=sys.stderr)
        return 2
    if not arguments.json:
        print("\n" + table(measured))
    if arguments.plot:
        write_plot(measured, arguments.plot)
    return 0


if __name__ == "__main__":
    sys.exit(main())
