# SPDX-License-Identifier: BSD-3-Clause
"""`./fabric train gestures [FOLDER] [name:=value ...]`: trains the gesture classifier.

Without a FOLDER it learns from simulated people, with one from labelled bags (see
fabric_perception.gestures.bags). Every person is left out once, and a classifier trained on the
others follows them; then the shipped one is trained on all. Writes gestures.yaml (the card: data,
accuracy, date) and gestures.npz. With compare:=true also what simpler ways would reach.
"""

from __future__ import annotations

import datetime
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

from fabric_perception.gestures.bags import read_folder
from fabric_perception.gestures.evaluation import Score, confusion_table, total
from fabric_perception.gestures.features import FeatureSettings
from fabric_perception.gestures.model_file import TrainedGestures, save, shipped
from fabric_perception.gestures.places import in_cell
from fabric_perception.gestures.recording import UNLABELLED, Recording
from fabric_perception.gestures.workshop import Recipe, Watched, leave_one_person_out, train
from fabric_sim.batch_files import Files
from fabric_sim.batch_gestures_compare import compare, comparison_table
from fabric_sim.batch_gestures_people import simulate_person

USAGE = (
    "usage: ./fabric train gestures [FOLDER] [cell_file:=] [people:=20] [seed:=1]\n"
    "                               [compare:=false] [out_dir:=]\n"
    "  FOLDER     labelled bags; without it people are simulated\n"
    "  cell_file  cell.yaml of the cell of the bags; empty is the one that comes along\n"
    "  people     how many are simulated, 2 or more\n"
    "  seed       root of all randomness\n"
    "  compare    also judge the thesis' features and 1-NN DTW, true or false\n"
    "  out_dir    folder of gestures.yaml and gestures.npz; empty is where the gesture node looks"
)


@dataclass(frozen=True)
class Words:
    """The words of the command. Raises ValueError naming a bad one."""

    folder: str = ""
    cell_file: str = ""
    people: int = 20
    seed: int = 1
    compare: bool = False
    out_dir: str = ""

    @classmethod
    def parse(cls, arguments: Sequence[str]) -> Words:
        """Return the checked words."""
        given: dict[str, Any] = {}
        for argument in arguments:
            name, sign, text = argument.partition(":=")
            name, text = (name, text) if sign else ("folder", argument)
            if name not in cls.__dataclass_fields__:
                raise ValueError(f"unknown argument '{name}' in '{argument}'")
            if name in given:
                raise ValueError(f"'{name}' is given twice")
            given[name] = _checked(name, text)
        if "cell_file" in given and "folder" not in given:
            raise ValueError("cell_file goes with a folder of bags; people are simulated in theirs")
        return cls(**given)


def _checked(name: str, text: str) -> Any:
    if name in ("people", "seed"):
        least = 2 if name == "people" else 0
        if not text.isascii() or not text.isdigit() or int(text) < least:
            raise ValueError(f"{name}:={text} is refused: it must be a whole number from {least}")
        return int(text)
    if name == "compare":
        if text not in ("true", "false"):
            raise ValueError(f"{name}:={text} is refused: it must be true or false")
        return text == "true"
    if name == "folder" and not Path(text).is_dir():
        raise ValueError(f"'{text}' is no folder of labelled bags")
    return text


def places(cell_file: str = "") -> FeatureSettings:
    """The features with the places of the cell, m. Raises ValueError naming a bad file."""
    shipped_cell = Files().share("fabric_bringup") / "config/cell.yaml"
    return in_cell(FeatureSettings(), cell_file or shipped_cell)


def recordings(words: Words, features: FeatureSettings) -> list[Recording]:
    """What there is to learn from. Raises RecordingError naming a bad file."""
    if words.folder:
        return read_folder(words.folder, features)
    people = []
    for person in range(1, words.people + 1):
        mine = simulate_person(words.seed, person)
        people += mine
        print(f"simulated {mine[0].person}: {sum(map(_minutes, mine)):.1f} min", flush=True)
    return people


def _minutes(recording: Recording) -> float:
    known = (recording.labels != UNLABELLED).mean()
    return float(known * (recording.t[-1] - recording.t[0]) / 60.0)


def card_of(
    words: Words, data: Sequence[Recording], scores: Mapping[str, Score], recipe: Recipe
) -> dict[str, Any]:
    """What the model's card says beyond what recognition needs."""
    source = f"labelled bags of {Path(words.folder).name}" if words.folder else "simulated people"
    return {
        "trained": datetime.date.today().isoformat(),
        "data": {
            "source": source,
            "people": len({one.person for one in data}),
            "minutes": round(sum(map(_minutes, data)), 1),
            "seed": words.seed,
        },
        "hmm": asdict(recipe.hmm),
        "context": {**asdict(recipe.context), "lags": list(recipe.context.lags)},
        "recogniser": asdict(recipe.recogniser),
        "leave_one_person_out": {
            "all": _entry(total(scores.values())),
            **{name: _entry(score) for name, score in scores.items() if name},
        },
    }


def _entry(score: Score) -> dict[str, Any]:
    return {
        **{name: round(value, 4) for name, value in score.figures().items()},
        "minutes": round(score.labelled / 60.0, 1),
        "warnings": score.warnings,
        "false_warnings": score.false_warnings,
        "confusion": [[int(n) for n in row] for row in score.confusion],
    }


def report(scores: Mapping[str, Score]) -> str:
    """Figures and confusion matrix for people to read."""
    columns = {"all": total(scores.values()), **{k: v for k, v in scores.items() if k}}
    lines = ["people not trained on:", "| | " + " | ".join(columns) + " |"]
    lines.append("| --- |" + " --- |" * len(columns))
    for name in columns["all"].figures():
        cells = " | ".join(f"{score.figures()[name]:.4f}" for score in columns.values())
        lines.append(f"| {name} | {cells} |")
    return "\n".join([*lines, "", confusion_table(columns["all"].confusion)])


def main(arguments: Sequence[str]) -> int:
    """Train as the words say; exit 2 when a word or a file is refused."""
    if list(arguments) in (["--help"], ["-h"]):
        print(USAGE)
        return 0
    try:
        words = Words.parse(arguments)
        recipe = Recipe(features=places(words.cell_file))
        data = recordings(words, recipe.features)
        watched = [Watched.of(one, recipe.features) for one in data]
        tell = partial(print, flush=True)
        scores = leave_one_person_out(watched, recipe, words.seed, tell)
        print(report(scores), flush=True)
        model = train(watched, recipe, words.seed).model
        path = Path(words.out_dir) / "gestures.yaml" if words.out_dir else shipped()
        card = card_of(words, data, scores, recipe)
        save(path, TrainedGestures(model, recipe.score, recipe.features, card))
        if words.compare:
            card["comparison"] = compare(data, recipe, words.seed)
            print(comparison_table(card["comparison"]), flush=True)
            save(path, TrainedGestures(model, recipe.score, recipe.features, card))
    except ValueError as error:
        print(f"fabric: {error}", file=sys.stderr)
        return 2
    print(f"written: {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
