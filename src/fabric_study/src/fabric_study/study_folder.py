# SPDX-License-Identifier: BSD-3-Clause
"""The folder of a study: `study.json` says what it is, the store keeps what it is told.

DIR/study.json     protocol with all wording, its hash, seed, whether people are simulated
DIR/study.sqlite   the store
DIR/runs/K/        a run folder of the recorder for each launch
"""

import hashlib
import json
import os
import uuid
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

from fabric_study.instruments import Text
from fabric_study.protocol import Protocol, protocol_from
from fabric_study.run_record import FILE_NAME as RUN_FILE
from fabric_study.run_record import versions
from fabric_study.store import STORE_FILE, Store, StoreError
from fabric_study.strict_yaml import Section

STUDY_FILE = "study.json"
RUNS = "runs"
LARGEST_SEED = 2**31 - 1


@dataclass(frozen=True)
class StudyInfo:
    """What `study.json` says."""

    id: str
    protocol: Protocol
    seed: int
    simulated: bool  # people and answers are made up
    content: dict[str, Any]  # the whole file
    genesis: str  # SHA-256 of the file; the chain of the store begins with it

    @property
    def title(self) -> Text:
        """The title of the protocol."""
        return self.protocol.title


class Study:
    """A study that this process writes; close it, or use it as a context manager."""

    def __init__(self, folder: Path, info: StudyInfo, owner: str) -> None:
        self.folder = folder
        self.info = info
        self.store = Store(folder, owner, info.genesis)

    def __enter__(self) -> "Study":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    @property
    def protocol(self) -> Protocol:
        """The protocol as it was when the study began."""
        return self.info.protocol

    def new_run(self) -> Path:
        """Return the path of the next run folder, `runs/K`, which does not exist yet."""
        return next_run(self.folder)

    def close(self) -> None:
        """Let others write."""
        self.store.close()


def next_run(folder: Path) -> Path:
    """Return the path of the next run folder of a study, which does not exist yet."""
    taken = [int(path.name) for path in (folder / RUNS).glob("*") if path.name.isdecimal()]
    return folder / RUNS / str(max(taken, default=0) + 1)


def open_study(
    folder: Path, protocol: Protocol, seed: int, simulated: bool, owner: str = "console"
) -> Study:
    """Return the study in a folder, begun now if there is none, with the right to write.

    Raises StoreError, and changes nothing, when the folder holds something else: another protocol,
    seed or kind of people, a run, a damaged store - or when another process writes it.
    """
    if isinstance(seed, bool) or not 0 <= seed <= LARGEST_SEED:
        raise ValueError(f"seed is {seed}; it must lie in 0..{LARGEST_SEED}")
    if not (folder / STUDY_FILE).exists():
        _begin(folder, protocol, seed, simulated)
    info = read_study(folder)
    wanted = (protocol.name, protocol.hash, seed, simulated)
    found = (info.protocol.name, info.protocol.hash, info.seed, info.simulated)
    for name, want, have in zip(
        ("protocol", "hash", "seed", "simulated"), wanted, found, strict=True
    ):
        if want != have:
            raise StoreError(f"{folder / STUDY_FILE}: {name} is {have!r}, not {want!r}")
    return Study(folder, info, owner)


def reopen_study(folder: Path, owner: str = "console") -> Study:
    """Return the study that a folder holds, with the right to write. Raises as `open_study`."""
    return Study(folder, read_study(folder), owner)


def read_study(folder: Path) -> StudyInfo:
    """Return what the `study.json` of a folder says.

    Raises StoreError naming file, key and value of what cannot be meant, or a hash that differs.
    """
    path = folder / STUDY_FILE
    try:
        raw = path.read_bytes()
        content = json.loads(raw)
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise StoreError(f"{path}: cannot be read: {error}") from error
    try:
        return _info(path, raw, content)
    except StoreError:
        raise
    except ValueError as error:
        raise StoreError(str(error)) from error


def _info(path: Path, raw: bytes, content: Any) -> StudyInfo:
    top = Section(str(path), "", content)
    protocol = protocol_from(top.value("content"), f"{path}: content")
    for key, have in (("protocol", protocol.name), ("hash", protocol.hash)):
        if top.value(key) != have:
            raise top.error(key, f"is {top.value(key)!r}, but the content says {have!r}")
    if not isinstance(top.value("simulated"), bool):
        raise top.error("simulated", f"must be true or false, not {top.value('simulated')!r}")
    info = StudyInfo(
        id=str(top.value("id")),
        protocol=protocol,
        seed=top.integer("seed", 0, LARGEST_SEED),
        simulated=top.value("simulated"),
        content=content,
        genesis=hashlib.sha256(raw).hexdigest(),
    )
    top.value("versions")
    top.finish()
    return info


def _begin(folder: Path, protocol: Protocol, seed: int, simulated: bool) -> None:
    for name in (STORE_FILE, RUN_FILE):
        if (folder / name).exists():
            raise StoreError(f"{folder}: holds {name}, but no {STUDY_FILE}; it is no study")
    content = {
        "id": uuid.uuid4().hex,
        "protocol": protocol.name,
        "hash": protocol.hash,
        "seed": seed,
        "simulated": simulated,
        "versions": versions(),
        "content": protocol.content,
    }
    folder.mkdir(parents=True, exist_ok=True)
    scratch = folder / f"{STUDY_FILE}.tmp"
    with scratch.open("w", encoding="utf-8") as file:
        json.dump(content, file, ensure_ascii=False, indent=1)
        file.write("\n")
        file.flush()
        os.fsync(file.fileno())
    os.replace(scratch, folder / STUDY_FILE)
