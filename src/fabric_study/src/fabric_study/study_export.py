# SPDX-License-Identifier: BSD-3-Clause
"""A study as CSV files for other programs, with a code book that explains every column and value.

people.csv       one row a person: code, order of conditions, demographics
tasks.csv        one row a scored task: the columns of results.csv with person and condition
answers.csv      one row an item that was asked
answers_wide.csv one row a questionnaire that was filled in, one column an item
notes.csv        what the experimenter noted, with the time
codebook.csv     the wording of every item in every language, its values and their words
"""

import os
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pandas as pd

from fabric_study.instruments import LANGUAGES
from fabric_study.protocol import Protocol
from fabric_study.store import Record, sound_records
from fabric_study.study_data import load_study
from fabric_study.study_folder import read_study

WIDE_KEYS = ["person", "condition", "number", "instrument"]
NOTE_COLUMNS = ("time", "stamp", "person", "text")


def export(folder: Path, out: Path) -> list[Path]:
    """Write the files into `out` and return them.

    Raises FileExistsError, before anything is written, when one of them is there already, and
    StoreError for a damaged study.
    """
    info, data = read_study(folder), load_study(folder)
    notes = _notes(sound_records(folder, info.genesis))
    tables = {
        "people.csv": data.people,
        "tasks.csv": data.tasks,
        "answers.csv": data.answers,
        "answers_wide.csv": wide_answers(data.answers, info.protocol),
        "notes.csv": notes,
        "codebook.csv": codebook(info.protocol),
    }
    paths = [out / name for name in tables]
    for path in paths:
        if path.exists():
            raise FileExistsError(f"{path} is there already; name another folder")
    out.mkdir(parents=True, exist_ok=True)
    for path, table in zip(paths, tables.values(), strict=True):
        if "simulated" not in table.columns:
            table = table.assign(simulated=int(info.simulated))
        _write(path, table)
    return paths


def _write(path: Path, table: pd.DataFrame) -> None:
    scratch = path.with_suffix(".csv.tmp")
    table.to_csv(scratch, index=False, lineterminator="\n", encoding="utf-8")
    os.replace(scratch, path)


def wide_answers(answers: pd.DataFrame, protocol: Protocol) -> pd.DataFrame:
    """Return one row for each questionnaire of each person, one column for each item.

    An item of the same id means the same in every questionnaire; what was not asked is empty.
    """
    ids = [item.id for name in protocol.instruments for item in protocol.instruments[name].items]
    columns = list(dict.fromkeys(ids))
    rows: dict[tuple[Any, ...], dict[str, Any]] = {}
    for answer in answers.to_dict("records"):
        key = tuple(answer[column] for column in WIDE_KEYS)
        rows.setdefault(key, {})[answer["item"]] = answer["value"]
    wide = [{**dict(zip(WIDE_KEYS, key, strict=True)), **row} for key, row in rows.items()]
    return pd.DataFrame(wide, columns=[*WIDE_KEYS, *columns], dtype=object)


def codebook(protocol: Protocol) -> pd.DataFrame:
    """Return one row for each item: its wording, its range, and the words of its values."""
    rows = []
    for name, instrument in protocol.instruments.items():
        for item in instrument.items:
            row: dict[str, Any] = {
                "instrument": name,
                "item": item.id,
                "kind": item.kind,
                "category": item.category,
                "reverse": int(item.reverse),
                "low": item.low if item.kind in ("likert", "tlx", "number") else None,
                "high": item.high if item.kind in ("likert", "tlx", "number") else None,
            }
            for language in LANGUAGES:
                row[f"text_{language}"] = item.text[language]
                labels = [f"{value} = {text[language]}" for value, text in item.labels.items()]
                row[f"values_{language}"] = "; ".join(labels)
            rows.append(row)
    return pd.DataFrame(rows)


def _notes(records: Sequence[Record]) -> pd.DataFrame:
    rows = [
        (_utc(record.stamp), record.stamp, record.visit, record.content["text"])
        for record in records
        if record.kind == "note"
    ]
    return pd.DataFrame(rows, columns=list(NOTE_COLUMNS))


def _utc(stamp: float) -> str:
    return datetime.fromtimestamp(stamp, UTC).isoformat(timespec="milliseconds")
