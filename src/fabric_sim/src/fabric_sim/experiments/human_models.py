# SPDX-License-Identifier: BSD-3-Clause
"""`./fabric experiment human-models [FOLDER]`: are the simulated people believable?

    python3 -m fabric_sim.experiments.command human-models [FOLDER] [--json] [--quick] [--out DIR]

Compares simulated with recorded types, and simulated people who sort with a user study (thesis
section 6.3.2); asks which character explains what was seen of simulated and of recorded people
(section 6.4.2, Fig. 6.29); estimates the four dials of each person in FOLDER. Writes report.html
and results.json into a folder and prints the tables.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import sys
from collections.abc import Sequence
from pathlib import Path

from fabric_sim.batch_loop import Files
from fabric_sim.experiments import (
    likelihood_matrix,
    people_fit,
    recorded_types,
    recovery,
    sorting_people,
)
from fabric_sim.experiments.human_models_report import Results, html_of, json_rows, text_of
from fabric_sim.experiments.shell import new_folder, positive, tell
from fabric_sim.experiments.trials import Trial, TrialError, read_folder
from fabric_sim.experiments.watching import Watching

TASKS, QUICK_TASKS = 24, 2  # of each type beside each robot
PEOPLE, QUICK_PEOPLE = 12, 4  # with known dials
SORTING, QUICK_SORTING = 120, 8  # people who sort alone and beside two robots


def recorded_folder() -> Path:
    """The recordings that come with the package."""
    return Files().share("fabric_sim") / "recorded"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="fabric experiment human-models", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("folder", type=Path, nargs="?", help="recorded trials (those shipped)")
    parser.add_argument("--quick", action="store_true", help="little of everything")
    parser.add_argument("--seed", type=positive, default=1, help="root seed (1)")
    parser.add_argument("--jobs", type=positive, help="processes (one a core)")
    parser.add_argument("--json", action="store_true", help="print one JSON object a line")
    parser.add_argument("--out", type=Path, help="folder (runs/<date>_<time>_human-models)")
    return parser


def run(
    folder: str, trials: Sequence[Trial], watching: Watching, quick: bool, seed: int, jobs: int
) -> Results:
    """Run all parts; `watching` is how the simulated cell watches."""
    tasks = QUICK_TASKS if quick else TASKS
    known = QUICK_PEOPLE if quick else PEOPLE
    return Results(
        people=people_fit.run(folder, trials, watching, seed, jobs),
        matrix=likelihood_matrix.run(watching, tasks, seed, jobs),
        recovery=recovery.run(watching, known, seed, jobs),
        types=recorded_types.run(quick, jobs),
        sorting=sorting_people.run(QUICK_SORTING if quick else SORTING, seed, jobs),
    )


def write(results: Results, out: Path) -> list[Path]:
    """Write results.json and report.html; return their paths."""
    out.mkdir(parents=True, exist_ok=True)
    paths = [out / "results.json", out / "report.html"]
    paths[0].write_text(json.dumps(json_rows(results), indent=1) + "\n", encoding="utf-8")
    paths[1].write_text(html_of(results), encoding="utf-8")
    return paths


def main(words: Sequence[str]) -> int:
    """Run the experiment; 0 when it ran, whatever it found, 2 when the folder cannot be used."""
    given = _parser().parse_args(words)
    folder = given.folder or recorded_folder()
    try:
        trials = read_folder(folder)
    except TrialError as error:
        print(f"human-models: {error}", file=sys.stderr)
        return 2
    watching = Watching.of(Files().cell().sensing)
    jobs = given.jobs or multiprocessing.cpu_count()
    results = run(folder.name, trials, watching, given.quick, given.seed, jobs)
    paths = write(results, given.out or new_folder("human-models"))
    tell(text_of(results), json_rows(results), paths, given.json)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
