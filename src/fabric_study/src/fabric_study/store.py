# SPDX-License-Identifier: BSD-3-Clause
"""study.sqlite: everything a study is told, appended and never changed (DESIGN section 7).

    with Store(folder, "console", genesis) as store:
        store.append(t, "K7QF2M", [("note", {"text": "late"})])  # on the disk when it returns

Each record carries the digest of itself and of the one before it, so a record that was changed,
dropped or slipped in shows. One process writes; whoever reads needs no lock.
"""

import fcntl
import hashlib
import json
import math
import os
import socket
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

STORE_FILE = "study.sqlite"
LOCK_FILE = "study.lock"
HEAD_FILE = "study.head"  # number and digest of the last record, to show a file that lost its end
SCHEMA_VERSION = 1
SCHEMA = """
BEGIN;
CREATE TABLE record (
    seq INTEGER PRIMARY KEY, stamp REAL NOT NULL, visit TEXT NOT NULL, kind TEXT NOT NULL,
    data TEXT NOT NULL, digest TEXT NOT NULL
) STRICT;
CREATE TRIGGER record_follows BEFORE INSERT ON record
    WHEN NEW.seq IS NOT (SELECT coalesce(max(seq), 0) + 1 FROM record)
    BEGIN SELECT raise(ABORT, 'records are numbered without gaps'); END;
CREATE TRIGGER record_stays BEFORE UPDATE ON record
    BEGIN SELECT raise(ABORT, 'records are never changed'); END;
CREATE TRIGGER record_remains BEFORE DELETE ON record
    BEGIN SELECT raise(ABORT, 'records are never deleted'); END;
PRAGMA user_version = 1;
COMMIT;
"""
COLUMNS = "seq, stamp, visit, kind, data, digest"

Entry = tuple[str, Mapping[str, Any]]  # kind, data
Head = tuple[int, str]  # number and digest of a record


class StoreError(ValueError):
    """A store is damaged, of another study or in use; the text names the file and the place."""


class Record(NamedTuple):
    """One line of the store, as it stands in the file."""

    seq: int  # 1, 2, 3 ...
    stamp: float  # s since 1970
    visit: str  # code of the person; empty when nobody is meant
    kind: str
    data: str  # JSON
    digest: str

    @property
    def content(self) -> dict[str, Any]:
        """The data, parsed."""
        return json.loads(self.data)


def digest_of(before: str, record: Record) -> str:
    """Return what the digest of a record must be, given the digest before it."""
    parts = (before, record.seq, repr(record.stamp), record.visit, record.kind, record.data)
    return hashlib.sha256("\n".join(map(str, parts)).encode()).hexdigest()


def read_records(folder: Path, after: int = 0) -> list[Record]:
    """Return the records of a study folder behind number `after`, also while another writes.

    Raises StoreError naming a file that is missing or no store.
    """
    path = folder / STORE_FILE
    if not path.is_file():
        raise StoreError(f"{path}: there is no such file")
    still = not path.with_name(f"{STORE_FILE}-wal").exists()  # closed; leave no file beside it
    mode = "immutable=1" if still else "mode=ro"
    try:
        connection = sqlite3.connect(f"{path.resolve().as_uri()}?{mode}", uri=True)
        try:
            return _records(connection, after)
        finally:
            connection.close()
    except sqlite3.Error as error:
        raise StoreError(f"{path}: cannot be read: {error}") from error


def sound_records(folder: Path, genesis: str) -> list[Record]:
    """Return all records of a folder. Raises StoreError naming the first that is damaged."""
    head = read_head(folder)  # before the records, of which more may come meanwhile
    records = read_records(folder)
    for fault in faults_in(records, genesis, head):
        raise StoreError(f"{folder / STORE_FILE}: {fault}")
    return records


def _records(connection: sqlite3.Connection, after: int = 0) -> list[Record]:
    rows = connection.execute(f"SELECT {COLUMNS} FROM record WHERE seq > ? ORDER BY seq", (after,))
    return [Record(*row) for row in rows]


def _write(connection: sqlite3.Connection, records: Sequence[Record]) -> None:
    connection.execute("BEGIN IMMEDIATE")
    try:
        connection.executemany("INSERT INTO record VALUES (?, ?, ?, ?, ?, ?)", records)
        connection.execute("COMMIT")
    except BaseException:
        if connection.in_transaction:
            connection.execute("ROLLBACK")
        raise


def read_head(folder: Path) -> Head:
    """Return number and digest of the last record that was told of; (0, "") when none was.

    Raises StoreError naming a file that says neither.
    """
    path = folder / HEAD_FILE
    if not path.exists():
        return 0, ""
    words = path.read_text(encoding="utf-8", errors="replace").split()
    if not words:  # what a power cut may leave of it
        return 0, ""
    if len(words) != 2 or not words[0].isdecimal():
        raise StoreError(f"{path}: must hold a number and a digest, not {' '.join(words)!r}")
    return int(words[0]), words[1]


def faults_in(records: Sequence[Record], genesis: str, head: Head) -> Iterator[str]:
    """Yield a sentence for each place where something is missing, changed or slipped in.

    `genesis` stands before the first record; `head` is what `read_head` gave before the reading.
    """
    digest, seq = genesis, 0
    for record in records:
        seq += 1
        if record.seq != seq:
            yield f"record {seq} is missing; {record.seq} follows {seq - 1}"
            seq = record.seq
        elif record.digest != digest_of(digest, record):
            yield f"record {seq} ({record.kind}) does not fit its digest and the record before it"
        digest = record.digest
    last, digest = head
    if last > seq:
        yield f"{HEAD_FILE} tells of {last} records, the last one is {seq}"
    elif last and digest not in {record.digest for record in records if record.seq == last}:
        yield f"{HEAD_FILE} tells of another record {last}"


class Store:
    """The one writer of a study folder. Not for several threads."""

    def __init__(self, folder: Path, owner: str, genesis: str) -> None:
        """Open or create the store; `owner` names the writer to others, `genesis` the study.

        Raises StoreError, and changes nothing, when another process writes or a record is damaged.
        """
        self.folder = folder
        self._path = folder / STORE_FILE
        self._lock = _locked(folder, owner)
        self._connection: sqlite3.Connection | None = None
        try:
            head = read_head(folder)
            self._connection = sqlite3.connect(self._path, isolation_level=None)
            self._prepare(self._connection, head)
            self._records = self._sound_records(self._connection, genesis, head)
        except sqlite3.Error as error:
            self.close()
            raise StoreError(f"{self._path}: cannot be opened: {error}") from error
        except BaseException:
            self.close()
            raise
        self._digest = self._records[-1].digest if self._records else genesis

    def __enter__(self) -> "Store":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _prepare(self, connection: sqlite3.Connection, head: Head) -> None:
        version = connection.execute("PRAGMA user_version").fetchone()[0]
        tables = connection.execute("SELECT count(*) FROM sqlite_schema").fetchone()[0]
        if version != SCHEMA_VERSION and (version or tables):
            raise StoreError(f"{self._path}: is no store of version {SCHEMA_VERSION}")
        if not version and head[0]:
            raise StoreError(f"{self._path}: is empty, but {HEAD_FILE} tells of {head[0]} records")
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("PRAGMA synchronous = FULL")
        if not version:
            connection.executescript(SCHEMA)

    def _sound_records(
        self, connection: sqlite3.Connection, genesis: str, head: Head
    ) -> list[Record]:
        records = _records(connection)
        for fault in faults_in(records, genesis, head):
            raise StoreError(f"{self._path}: {fault}")
        return records

    @property
    def records(self) -> Sequence[Record]:
        """All records so far, in order; not to be changed."""
        return self._records

    def append(self, stamp: float, visit: str, entries: Sequence[Entry]) -> None:
        """Write entries, all or none; they are on the disk when this returns.

        Raises ValueError for NaN and infinity, StoreError when the disk refuses.
        """
        if self._connection is None:
            raise StoreError(f"{self._path}: has been closed")
        records = self._made(stamp, visit, entries)
        try:
            _write(self._connection, records)
        except sqlite3.Error as error:
            raise StoreError(f"{self._path}: cannot be written: {error}") from error
        self._records += records
        self._digest = self._records[-1].digest
        self._tell_head()

    def _made(self, stamp: float, visit: str, entries: Sequence[Entry]) -> list[Record]:
        if not math.isfinite(stamp):
            raise ValueError(f"stamp is {stamp}; it must be finite")
        made: list[Record] = []
        digest, seq = self._digest, len(self._records)
        for kind, data in entries:
            seq += 1
            text = json.dumps(data, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
            record = Record(seq, float(stamp), visit, kind, text, "")
            digest = digest_of(digest, record)
            made.append(record._replace(digest=digest))
        return made

    def _tell_head(self) -> None:
        """Never ahead of the store, so it needs no sync of its own."""
        scratch = self.folder / f"{HEAD_FILE}.tmp"
        scratch.write_text(f"{len(self._records)} {self._digest}\n", encoding="utf-8")
        os.replace(scratch, self.folder / HEAD_FILE)

    def close(self) -> None:
        """Close the file and let others write; closing twice does nothing."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None
        if self._lock >= 0:
            os.close(self._lock)
            self._lock = -1


def _locked(folder: Path, owner: str) -> int:
    """Return the descriptor that holds the lock; the kernel frees it however the process ends."""
    path = folder / LOCK_FILE
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        holder = os.pread(descriptor, 1000, 0).decode("utf-8", "replace").strip()
        os.close(descriptor)
        raise StoreError(f"{folder}: is being written by {holder or 'another process'}") from error
    os.ftruncate(descriptor, 0)
    os.pwrite(descriptor, f"{owner}, process {os.getpid()} on {socket.gethostname()}\n".encode(), 0)
    return descriptor
