# SPDX-License-Identifier: BSD-3-Clause
"""`./fabric replay FOLDER`: does our belief predict whether a take-over will be accepted?

    python3 -m fabric_sim.experiments.take_overs FOLDER [out_dir:=runs/replay-NAME] [seed:=1]

For every take-over that the recorded robots began: what our belief about the state and about the
person said of it at that moment, against what the person did. Writes take_overs.json, roc.svg and
report.html. Needs no ROS master.
"""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from fabric_sim.batch_loop import Files
from fabric_sim.experiments.take_overs_belief import Habits
from fabric_sim.experiments.take_overs_compare import compare, table
from fabric_sim.experiments.take_overs_read import SCENARIO, Folder, read_folder
from fabric_sim.experiments.take_overs_report import Result, html_of, json_of, roc_svg, text_of
from fabric_sim.experiments.take_overs_watch import POLICY, Models, watch_all

WORDS = {"out_dir": "", "seed": "1"}
MOST_SEED = 2**32 - 1


class ArgumentError(ValueError):
    """The command line cannot be meant."""


def score(folder: Folder, files: Files, seed: int) -> Result:
    """Score the take-overs of a folder; seed: of the bootstrap. Raises ValueError without any."""
    models = Models.shipped(files)
    habits = Habits.load(files.share("fabric_sim") / "config/take_overs.yaml")
    people = watch_all(models, folder.people)
    scored = table(people, models, habits, files.solve(POLICY, SCENARIO))
    digest = hashlib.sha256(models.path.read_bytes()).hexdigest()
    parts = tuple(compare(scored, seed))
    return Result(folder, habits, digest == habits.model, scored, parts, seed)


def write(result: Result, out: Path) -> list[Path]:
    """Write the three files; return their paths."""
    contents = {
        "take_overs.json": json.dumps(json_of(result), indent=1) + "\n",
        "roc.svg": roc_svg(result),
        "report.html": html_of(result),
    }
    out.mkdir(parents=True, exist_ok=True)
    for name, text in contents.items():
        (out / name).write_text(text, encoding="utf-8")
    return [out / name for name in contents]


def arguments(words: Sequence[str]) -> tuple[Path, Path, int]:
    """Return folder, output folder and seed. Raises ArgumentError naming the word."""
    if not words:
        raise ArgumentError("wants a folder of recorded trials")
    folder = Path(words[0].removeprefix("file:="))
    given = dict(WORDS)
    for word in words[1:]:
        name, sign, value = word.partition(":=")
        if not sign or name not in WORDS:
            raise ArgumentError(f"'{word}' is none of {', '.join(f'{n}:=' for n in WORDS)}")
        given[name] = value
    if not (given["seed"].isascii() and given["seed"].isdigit()) or int(given["seed"]) > MOST_SEED:
        raise ArgumentError(f"seed:={given['seed']} is not a whole number up to {MOST_SEED}")
    out = Path(given["out_dir"] or f"runs/replay-{folder.resolve().name}")
    return folder, out, int(given["seed"])


def main(words: Sequence[str]) -> int:
    """Run the command; 2 when an argument, the folder or a file in it cannot be used."""
    try:
        folder, out, seed = arguments(words)
        result = score(read_folder(folder), Files(), seed)
        paths = write(result, out)
    except (ValueError, OSError) as error:
        print(f"replay: {error}", file=sys.stderr)
        return 2
    print(text_of(result))
    for path in paths:
        print(f"wrote {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
