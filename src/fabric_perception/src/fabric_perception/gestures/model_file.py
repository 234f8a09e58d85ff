# SPDX-License-Identifier: BSD-3-Clause
"""Trained classifiers on disk: arrays in an .npz, what a reader wants to know in a .yaml card.

The card names the file of arrays by its SHA-256, so that a card never speaks of other arrays.
"""

import hashlib
import io
import os
import zipfile
from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml

from fabric_msgs.settings import settings_from
from fabric_perception.gestures.features import FeatureSettings
from fabric_perception.gestures.model import GestureModel
from fabric_perception.gestures.settings import ScoreSettings

FORMAT = "fabric-gestures"
VERSION = 1
ARRAYS = tuple(item.name for item in fields(GestureModel) if item.name not in ("labels", "garbage"))
PLACE = "models/gestures.yaml"  # in the package, or in its share when it is installed


def shipped() -> Path:
    """Where the trained model lies that comes with the package."""
    here = Path(__file__).resolve()
    places = [here.parents[3] / PLACE]
    if len(here.parents) > 5:
        places.append(here.parents[5] / "share" / "fabric_perception" / PLACE)
    return next((path for path in places if path.is_file()), places[0])


class ModelFileError(ValueError):
    """A model cannot be read; the message names the file and what is wrong with it."""


class TrainedGestures(NamedTuple):
    """Everything that recognition needs."""

    model: GestureModel
    score: ScoreSettings
    features: FeatureSettings
    card: dict[str, Any]  # as in the file


def save(path: str | Path, trained: TrainedGestures) -> None:
    """Write the card to `path` (.yaml) and the arrays beside it (.npz); each replaced in one step.

    trained.card holds what else there is to say: data, accuracy, date. Raises ModelFileError when
    the path does not end in .yaml or cannot be written.
    """
    path = _card_path(path)
    arrays = io.BytesIO()
    np.savez_compressed(arrays, **{name: getattr(trained.model, name) for name in ARRAYS})
    content = arrays.getvalue()
    card = {
        "format": FORMAT,
        "version": VERSION,
        "arrays": {
            "file": path.with_suffix(".npz").name,
            "sha256": hashlib.sha256(content).hexdigest(),
        },
        "labels": list(trained.model.labels),
        "garbage": trained.model.garbage,
        "features": _plain(asdict(trained.features)),
        "score": _plain(asdict(trained.score)),
        **{key: value for key, value in trained.card.items() if key not in RESERVED},
    }
    text = "# SPDX-License-Identifier: BSD-3-Clause\n" + yaml.safe_dump(card, sort_keys=False)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _replace(path.with_suffix(".npz"), content)
        _replace(path, text.encode())
    except OSError as error:
        raise ModelFileError(f"{path}: cannot be written: {error.strerror}") from None


RESERVED = ("format", "version", "arrays", "labels", "garbage", "features", "score")


def load(path: str | Path | None = None) -> TrainedGestures:
    """Read a card and its arrays, the shipped ones unless a path is given.

    Raises ModelFileError naming the file, the entry and its value: not our format or version,
    arrays that are not the card's, shapes, sums, numbers that are not finite.
    """
    path = _card_path(path or shipped())
    card = _read_card(path)
    arrays = _read_arrays(path, card)
    try:
        model = GestureModel(
            labels=tuple(str(name) for name in card["labels"]), garbage=card["garbage"], **arrays
        )
        score = settings_from(ScoreSettings, card["score"])
        features = settings_from(FeatureSettings, card["features"])
        if len(features.names) != model.width:
            raise ValueError(f"features are {len(features.names)}, the model has {model.width}")
    except (ValueError, TypeError, AttributeError) as error:
        raise ModelFileError(f"{path}: {error}") from None
    return TrainedGestures(model, score, features, card)


def _card_path(path: str | Path) -> Path:
    path = Path(path)
    if path.suffix != ".yaml":
        raise ModelFileError(f"{path}: the card of a model must end in .yaml")
    return path


def _read_card(path: Path) -> dict[str, Any]:
    try:
        card = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ModelFileError(f"{path}: cannot be read: {error.strerror}") from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ModelFileError(f"{path}: is not YAML: {error}") from None
    if not isinstance(card, dict) or card.get("format") != FORMAT:
        raise ModelFileError(f"{path}: is no card of a gesture model ('format: {FORMAT}')")
    if card.get("version") != VERSION:
        raise ModelFileError(f"{path}: version is {card.get('version')!r}; {VERSION} is read")
    for name in RESERVED:
        if name not in card:
            raise ModelFileError(f"{path}: {name} is missing")
    return card


def _read_arrays(path: Path, card: Mapping[str, Any]) -> dict[str, Any]:
    entry = card["arrays"]
    if not isinstance(entry, dict) or not isinstance(entry.get("file"), str):
        raise ModelFileError(f"{path}: arrays is {entry!r}; it must name a file and its sha256")
    file = path.parent / Path(entry["file"]).name
    try:
        content = file.read_bytes()
    except OSError as error:
        raise ModelFileError(f"{file}: cannot be read: {error.strerror}") from None
    if hashlib.sha256(content).hexdigest() != entry.get("sha256"):
        raise ModelFileError(f"{file}: is not the file that {path.name} speaks of (sha256)")
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as loaded:
            missing = [name for name in ARRAYS if name not in loaded]
            if missing:
                raise ModelFileError(f"{file}: {missing[0]} is missing")
            return {name: loaded[name] for name in ARRAYS}
    except (ValueError, zipfile.BadZipFile, EOFError) as error:
        if isinstance(error, ModelFileError):
            raise
        raise ModelFileError(f"{file}: is no .npz: {error}") from None


def _replace(path: Path, content: bytes) -> None:
    part = path.with_name(f".{path.name}.{os.getpid()}")
    part.write_bytes(content)
    os.replace(part, path)


def _plain(values: dict[str, Any]) -> dict[str, Any]:
    return {key: list(v) if isinstance(v, tuple) else v for key, v in values.items()}
