# SPDX-License-Identifier: BSD-3-Clause
"""A copy of the records of several cells in one database; the SQLite files stay the truth.

    mirror = Mirror("postgresql://lab@db.example/studies", folder, info)
    mirror.catch_up()          # after every append, or every few seconds; returns what was copied

The table `record` is that of the store with `study` before it. A database that is away is no
fault: `catch_up` raises MirrorError, and the next one that succeeds copies what is missing.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import sqlalchemy as sa

from fabric_study.store import read_records
from fabric_study.study_folder import StudyInfo

BATCH = 500  # records a transaction
TIMEOUT = 5  # s to connect
METADATA = sa.MetaData()
STUDY = sa.Table(
    "study",
    METADATA,
    sa.Column("study", sa.String(32), primary_key=True),
    sa.Column("protocol", sa.String(64), nullable=False),
    sa.Column("hash", sa.String(64), nullable=False),
    sa.Column("seed", sa.BigInteger, nullable=False),
    sa.Column("simulated", sa.Boolean, nullable=False),
)
RECORD = sa.Table(
    "record",
    METADATA,
    sa.Column("study", sa.String(32), sa.ForeignKey("study.study"), primary_key=True),
    sa.Column("seq", sa.BigInteger, primary_key=True, autoincrement=False),
    sa.Column("stamp", sa.Float(53), nullable=False),
    sa.Column("visit", sa.String(16), nullable=False),
    sa.Column("kind", sa.String(32), nullable=False),
    sa.Column("data", sa.Text, nullable=False),
    sa.Column("digest", sa.String(64), nullable=False),
)


class MirrorError(RuntimeError):
    """The database is away, refuses, or holds something else; the text says which."""


class Mirror:
    """Copies the records of one study. It reads the store's file, so any thread may own it."""

    def __init__(self, url: str, folder: Path, info: StudyInfo) -> None:
        """Raises ValueError for an address that cannot be meant; nothing is connected yet."""
        self._folder = folder
        self._info = info
        self._prepared = False
        try:
            address = sa.engine.make_url(url)
            self._where = repr(address)  # without the password
            timeout = "timeout" if address.get_backend_name() == "sqlite" else "connect_timeout"
            self._engine = sa.create_engine(
                address, connect_args={timeout: TIMEOUT}, pool_pre_ping=True
            )
        except (sa.exc.SQLAlchemyError, ImportError) as error:
            raise ValueError(f"database {_shown(url)}: {error}") from error

    def catch_up(self) -> int:
        """Copy every record that the database lacks; return how many.

        Raises MirrorError; what was copied stays, and the next call goes on from there.
        """
        copied = 0
        try:
            self._prepare()
            for batch in self._batches():
                with self._engine.begin() as connection:
                    connection.execute(RECORD.insert(), batch)
                copied += len(batch)
        except sa.exc.SQLAlchemyError as error:
            reason = getattr(error, "orig", None) or error
            raise MirrorError(f"{self._where}: {str(reason).strip()}") from error
        return copied

    def _prepare(self) -> None:
        if not self._prepared:
            METADATA.create_all(self._engine)
            with self._engine.begin() as connection:
                self._announce(connection)
            self._prepared = True

    def _announce(self, connection: sa.engine.Connection) -> None:
        values = {
            "study": self._info.id,
            "protocol": self._info.protocol.name,
            "hash": self._info.protocol.hash,
            "seed": self._info.seed,
            "simulated": self._info.simulated,
        }
        query = sa.select(STUDY).where(STUDY.c.study == self._info.id)
        found = connection.execute(query).mappings().first()
        if found is None:
            connection.execute(STUDY.insert(), values)
        elif dict(found) != values:
            raise MirrorError(f"{self._where}: study {self._info.id} is told of otherwise there")

    def _batches(self) -> Iterator[list[dict[str, Any]]]:
        last, digest = self._last()
        records = read_records(self._folder, max(last - 1, 0))
        if last and (not records or records[0].digest != digest):
            raise MirrorError(f"{self._where}: has another record {last} of {self._info.id}")
        for begin in range(min(last, 1), len(records), BATCH):
            batch = records[begin : begin + BATCH]
            yield [{"study": self._info.id, **record._asdict()} for record in batch]

    def _last(self) -> tuple[int, str]:
        query = (
            sa.select(RECORD.c.seq, RECORD.c.digest)
            .where(RECORD.c.study == self._info.id)
            .order_by(RECORD.c.seq.desc())
            .limit(1)
        )
        with self._engine.connect() as connection:
            found = connection.execute(query).first()
        return (found.seq, found.digest) if found else (0, "")

    def close(self) -> None:
        """Let go of the connections."""
        self._engine.dispose()


def _shown(url: str) -> str:
    """Return what of an address may be shown: never what stands before an @."""
    scheme, _, rest = url.rpartition("@")
    return f"{scheme.partition('//')[0]}//...@{rest}" if scheme else rest
