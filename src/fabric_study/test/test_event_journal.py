# SPDX-License-Identifier: BSD-3-Clause
"""The journal of scored events: written before published, whole after a kill, checked when read."""

import errno
import itertools
import json
import os
import signal
from pathlib import Path
from typing import NoReturn

import pytest

from fabric_msgs.clock import header_of
from fabric_msgs.msg import TaskEvent
from fabric_study.event_journal import (
    FIELDS,
    JOURNAL_FILE,
    EventJournal,
    JournalError,
    entry_of,
    read_journal,
)


def event(sequence: int) -> TaskEvent:
    return TaskEvent(
        header=header_of(12.5 + sequence),
        sequence=sequence,
        task_id=3,
        kind=TaskEvent.SUBTASK_SUCCEEDED,
        by=TaskEvent.BY_ROBOT,
        cube_id=4,
        cube_colour=2,
        container="green",
        score=4,
    )


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / JOURNAL_FILE


def write(path: Path, count: int) -> None:
    with EventJournal(path) as journal:
        for sequence in range(1, count + 1):
            journal.append(event(sequence))


def test_what_was_appended_is_read_back(path: Path) -> None:
    write(path, 3)
    journal = read_journal(path)
    assert journal.entries == [entry_of(event(n)) for n in (1, 2, 3)]
    assert journal.torn == ""
    assert journal.entries[0] == {
        "sequence": 1, "task": 3, "stamp": 13.5, "what": "subtask_succeeded", "by": "robot",
        "cube": 4, "colour": 2, "container": "green", "score": 4,
    }  # fmt: skip


def test_an_event_is_readable_before_the_journal_is_closed(path: Path) -> None:
    with EventJournal(path) as journal:
        journal.append(event(1))
        assert len(read_journal(path).entries) == 1


def test_a_journal_without_events_is_empty(path: Path) -> None:
    write(path, 0)
    assert read_journal(path).entries == []


def test_the_journal_of_another_run_is_refused(path: Path) -> None:
    write(path, 1)
    with pytest.raises(FileExistsError):
        EventJournal(path)
    assert len(read_journal(path).entries) == 1


def test_an_event_out_of_sequence_is_refused(path: Path) -> None:
    with EventJournal(path) as journal:
        journal.append(event(1))
        with pytest.raises(JournalError, match="event 3 follows 1"):
            journal.append(event(3))
    assert len(read_journal(path).entries) == 1


def test_a_full_disk_leaves_whole_lines_and_the_next_event_fits(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real, calls = os.write, []

    def full(file: int, line: bytes) -> int:
        calls.append(line)
        if len(calls) > 1:
            raise OSError(errno.ENOSPC, "no space left")
        return real(file, line[:7])

    with EventJournal(path) as journal:
        journal.append(event(1))
        monkeypatch.setattr(os, "write", full)
        with pytest.raises(OSError, match="no space left"):
            journal.append(event(2))
        monkeypatch.setattr(os, "write", real)
        assert read_journal(path).torn == ""
        journal.append(event(2))
    assert [entry["sequence"] for entry in read_journal(path).entries] == [1, 2]


@pytest.mark.parametrize("keep", [1, 40])
def test_a_torn_last_line_is_named_and_the_rest_is_kept(path: Path, keep: int) -> None:
    write(path, 3)
    whole = path.read_bytes()
    last = whole.splitlines(keepends=True)[-1]
    path.write_bytes(whole[: -len(last)] + last[:keep])
    journal = read_journal(path)
    assert [entry["sequence"] for entry in journal.entries] == [1, 2]
    assert journal.torn == last[:keep].decode()


def test_blocks_that_were_never_written_count_as_torn(path: Path) -> None:
    write(path, 2)
    path.write_bytes(path.read_bytes() + b"\0\0\0\n")
    journal = read_journal(path)
    assert len(journal.entries) == 2
    assert journal.torn == "\0\0\0"


def test_a_damaged_line_that_is_not_the_last_is_refused_by_number(path: Path) -> None:
    write(path, 3)
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(lines[0] + b"{broken\n" + lines[2])
    with pytest.raises(JournalError, match=r"events\.jsonl: line 2: is no JSON"):
        read_journal(path)


@pytest.mark.parametrize("missing", [1, 2])
def test_a_missing_event_is_refused_by_number(path: Path, missing: int) -> None:
    write(path, 3)
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(line for n, line in enumerate(lines, 1) if n != missing))
    with pytest.raises(JournalError, match=f"line {missing}: sequence is {missing + 1}"):
        read_journal(path)


@pytest.mark.parametrize(
    ("field", "value"),
    [("stamp", float("nan")), ("stamp", "soon"), ("sequence", True), ("score", 1.5), ("by", None)],
)
def test_a_field_that_cannot_be_meant_is_refused_by_name(
    path: Path, field: str, value: object
) -> None:
    path.write_text(json.dumps(entry_of(event(1)) | {field: value}) + "\n")
    with pytest.raises(JournalError, match=f"line 1: {field} is"):
        read_journal(path)


def test_a_line_with_other_fields_is_refused(path: Path) -> None:
    path.write_text('{"sequence": 1}\n')
    with pytest.raises(JournalError, match=f"must have the fields {', '.join(FIELDS)}"):
        read_journal(path)


@pytest.mark.parametrize("published", [1, 2, 17])
def test_whatever_was_published_before_a_kill_is_in_the_journal(path: Path, published: int) -> None:
    told, tell = os.pipe()
    writer = os.fork()
    if writer == 0:
        _write_for_ever(path, tell)
    os.close(tell)
    with os.fdopen(told, "rb") as pipe:
        last = [int(pipe.readline()) for _ in range(published)][-1]
        os.kill(writer, signal.SIGKILL)
        os.waitpid(writer, 0)
        last = max([last, *map(int, pipe.read().split())])
    assert last <= len(read_journal(path).entries)


def _write_for_ever(path: Path, tell: int) -> NoReturn:
    try:
        journal = EventJournal(path)
        for sequence in itertools.count(1):
            journal.append(event(sequence))
            os.write(tell, b"%d\n" % sequence)
    finally:
        os._exit(1)
