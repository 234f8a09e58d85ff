# SPDX-License-Identifier: BSD-3-Clause
"""The store: appended, never changed, bound to its study; what is damaged is refused as it is."""

import json
import os
import random
import shutil
import sqlite3

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from study_play import SEED, small_protocol, small_study

from fabric_study.codes import CODE, LENGTH, LETTERS, new_code
from fabric_study.protocol import load_protocol
from fabric_study.store import Store, StoreError, digest_of, read_records
from fabric_study.study_data import load_study
from fabric_study.study_folder import open_study, read_study, reopen_study

GENESIS = "0" * 64
PASSING = ("study.lock", "study.sqlite-shm", "study.sqlite-wal")  # hold no record once closed


def snapshot(folder) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name not in PASSING
    }


@pytest.fixture
def filled(tmp_path):
    """The folder of a study with three records, closed."""
    with small_study(tmp_path) as study:
        for number in range(3):
            study.store.append(float(number), "", [("note", {"text": f"note {number}"})])
    return tmp_path / "study"


def test_records_are_numbered_without_gaps_and_each_carries_the_digest_of_all_before(tmp_path):
    with Store(tmp_path, "test", GENESIS) as store:
        store.append(1.5, "K7QF2M", [("note", {"text": "ä"}), ("note", {"text": "b"})])
        store.append(2.5, "", [("note", {"text": "c"})])
        records = list(store.records)
    assert read_records(tmp_path) == records
    assert [record.seq for record in records] == [1, 2, 3]
    digest = GENESIS
    for record in records:
        assert record.digest == digest_of(digest, record)
        digest = record.digest
    assert [record.content["text"] for record in records] == ["ä", "b", "c"]


def test_a_record_is_in_the_file_when_append_returns(tmp_path):
    with Store(tmp_path, "test", GENESIS) as store:
        for number in range(1, 6):
            store.append(1.0, "", [("note", {"text": str(number)})])
            assert len(read_records(tmp_path)) == number
        assert len(read_records(tmp_path, after=3)) == 2


def test_the_file_is_synced_at_each_commit_and_keeps_a_write_ahead_log(tmp_path):
    with Store(tmp_path, "test", GENESIS) as store:
        query = store._connection.execute
        assert query("PRAGMA journal_mode").fetchone()[0] == "wal"
        assert query("PRAGMA synchronous").fetchone()[0] == 2  # FULL


@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE record SET data = '{}' WHERE seq = 2",
        "DELETE FROM record WHERE seq = 3",
        "INSERT INTO record VALUES (5, 0, '', 'note', '{}', '')",
        "INSERT OR REPLACE INTO record VALUES (2, 0, '', 'note', '{}', '')",
        "INSERT INTO record VALUES (4, 0, '', NULL, '{}', '')",
    ],
)
def test_the_file_itself_refuses_to_change_drop_or_slip_in_a_record(filled, statement):
    before = read_records(filled)
    connection = sqlite3.connect(filled / "study.sqlite")
    with pytest.raises(sqlite3.IntegrityError):
        connection.execute(statement)
    connection.close()
    assert read_records(filled) == before


@pytest.mark.parametrize("stamp, data", [(float("nan"), {}), (1.0, {"value": float("inf")})])
def test_what_is_not_finite_is_refused_and_nothing_of_it_is_written(tmp_path, stamp, data):
    with Store(tmp_path, "test", GENESIS) as store:
        with pytest.raises(ValueError):
            store.append(stamp, "", [("note", {"text": "good"}), ("note", data)])
        assert read_records(tmp_path) == []
        store.append(1.0, "", [("note", {"text": "good"})])


def test_entries_written_together_are_there_together_or_not_at_all(tmp_path):
    with Store(tmp_path, "test", GENESIS) as store:
        store._connection.execute(
            "CREATE TRIGGER full BEFORE INSERT ON record WHEN NEW.kind = 'last' "
            "BEGIN SELECT raise(ABORT, 'disk full'); END"
        )
        with pytest.raises(StoreError, match="cannot be written: disk full"):
            store.append(1.0, "", [("note", {"text": "a"}), ("last", {})])
        assert read_records(tmp_path) == list(store.records) == []
        store.append(1.0, "", [("note", {"text": "a"})])
        assert len(read_records(tmp_path)) == 1


def damage(folder, *statements):
    connection = sqlite3.connect(folder / "study.sqlite", isolation_level=None)
    for trigger in ("record_stays", "record_remains", "record_follows"):
        connection.execute(f"DROP TRIGGER {trigger}")
    for statement in statements:
        connection.execute(statement)
    connection.close()


DAMAGES = [
    ('UPDATE record SET data = \'{"text":"x"}\' WHERE seq = 2', "record 2 .note. does not fit"),
    ("UPDATE record SET stamp = 9 WHERE seq = 1", "record 1 .note. does not fit"),
    ("UPDATE record SET visit = 'K7QF2M' WHERE seq = 3", "record 3 .note. does not fit"),
    ("DELETE FROM record WHERE seq = 1", "record 1 is missing; 2 follows 0"),
    ("DELETE FROM record WHERE seq = 2", "record 2 is missing; 3 follows 1"),
    ("DELETE FROM record WHERE seq = 3", "study.head tells of 3 records, the last one is 2"),
]


@pytest.mark.parametrize("statement, complaint", DAMAGES, ids=[text for _, text in DAMAGES])
def test_a_damaged_store_is_refused_with_the_record_and_left_as_it_is(filled, statement, complaint):
    damage(filled, statement)
    before = snapshot(filled)
    for attempt in (reopen_study, load_study):
        with pytest.raises(StoreError, match=complaint):
            attempt(filled)
    assert snapshot(filled) == before


@pytest.mark.parametrize("content", [b"", b"this is no database, but long enough to be one" * 50])
def test_a_file_that_is_no_store_is_refused_and_left_as_it_is(filled, content):
    for name in ("study.sqlite", "study.sqlite-wal", "study.sqlite-shm"):
        (filled / name).unlink(missing_ok=True)
    (filled / "study.sqlite").write_bytes(content)
    with pytest.raises(StoreError, match=r"study\.sqlite: "):
        reopen_study(filled)
    assert (filled / "study.sqlite").read_bytes() == content


def test_a_database_of_something_else_is_refused(tmp_path):
    connection = sqlite3.connect(tmp_path / "study.sqlite")
    connection.execute("CREATE TABLE record (seq INTEGER)")
    connection.close()
    with pytest.raises(StoreError, match="is no store of version 1"):
        Store(tmp_path, "test", GENESIS)


def test_the_lock_ends_with_the_store_also_after_a_refusal(tmp_path, filled):
    shutil.copytree(filled, tmp_path / "copy")
    damage(tmp_path / "copy", "DELETE FROM record WHERE seq = 2")
    for _ in range(2):
        with pytest.raises(StoreError, match="record 2 is missing"):
            reopen_study(tmp_path / "copy")
    reopen_study(filled).close()
    reopen_study(filled).close()


def test_a_study_says_what_it_is_and_opens_again_only_as_that(tmp_path):
    protocol = small_protocol(tmp_path / "plan")
    open_study(tmp_path / "s", protocol, 101, simulated=True).close()
    told = json.loads((tmp_path / "s" / "study.json").read_text(encoding="utf-8"))
    assert (told["protocol"], told["hash"]) == ("small", protocol.hash)
    assert (told["seed"], told["simulated"]) == (101, True)
    assert read_study(tmp_path / "s").protocol == protocol
    before = snapshot(tmp_path / "s")
    others = [
        ((load_protocol("experiment-2"), 101, True), "protocol is 'small', not 'experiment-2'"),
        ((protocol, 102, True), "seed is 101, not 102"),
        ((protocol, 101, False), "simulated is True, not False"),
    ]
    for other, complaint in others:
        with pytest.raises(StoreError, match=complaint):
            open_study(tmp_path / "s", *other)
    assert snapshot(tmp_path / "s") == before


def test_a_protocol_that_was_reworded_is_refused_by_its_hash(tmp_path):
    small_study(tmp_path).close()
    file = tmp_path / "plan" / "after.yaml"
    text = file.read_text(encoding="utf-8").replace("trust (deutsch)", "Vertrauen")
    file.write_text(text, encoding="utf-8")
    reworded = load_protocol(str(tmp_path / "plan" / "small.yaml"))
    with pytest.raises(StoreError, match="hash is "):
        open_study(tmp_path / "study", reworded, SEED, simulated=False)


@pytest.mark.parametrize("name", ["study.sqlite", "run.json"])
def test_a_folder_that_holds_something_else_is_refused(tmp_path, name):
    protocol = small_protocol(tmp_path / "plan")
    (tmp_path / "s").mkdir()
    (tmp_path / "s" / name).write_text("{}")
    with pytest.raises(StoreError, match=f"holds {name}, but no study.json"):
        open_study(tmp_path / "s", protocol, 101, simulated=False)
    assert os.listdir(tmp_path / "s") == [name]


EDITS = [
    ("seed", 102, "record 1 .note. does not fit"),
    ("simulated", True, "record 1 .note. does not fit"),
    ("seed", -1, "seed: is -1; it must lie in"),
    ("simulated", "no", "simulated: must be true or false"),
    ("hash", "0", "hash: is '0', but the content says"),
    ("protocol", "other", "protocol: is 'other', but the content says"),
    ("colour", 1, "colour: is not known"),
]


@pytest.mark.parametrize("key, value, complaint", EDITS)
def test_an_edited_study_file_is_refused_with_its_key_or_no_longer_fits_its_records(
    filled, key, value, complaint
):
    path = filled / "study.json"
    content = {**json.loads(path.read_text(encoding="utf-8")), key: value}
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(StoreError, match=complaint):
        reopen_study(filled)


@pytest.mark.parametrize("text", ["", "{", "[1]", '{"id": "x"}', "\0"])
def test_a_study_file_that_says_nothing_is_refused_by_name(tmp_path, text):
    (tmp_path / "study.json").write_text(text, encoding="utf-8")
    with pytest.raises(StoreError, match=r"study\.json: "):
        read_study(tmp_path)


def test_run_folders_count_up_and_never_meet(tmp_path):
    with small_study(tmp_path) as study:
        assert study.new_run().name == "1"
        for name in ("1", "7", "notes"):
            (study.folder / "runs" / name).mkdir(parents=True)
        assert study.new_run().name == "8"


@settings(deadline=None)
@given(st.integers(0, 2**31))
def test_codes_are_easy_to_read_and_spell_no_word(seed):
    code = new_code((), random.Random(seed))
    assert CODE.fullmatch(code) and len(code) == LENGTH
    assert not set(code) & set("AEIOU01LBSZ5")


def test_a_code_that_is_taken_is_not_given_again():
    taken = [new_code((), random.Random(101))]
    second = new_code(taken, random.Random(101))
    assert second not in taken
    with pytest.raises(RuntimeError, match="no code is left"):
        new_code(EveryCode(), random.Random(101))


class EveryCode:
    """Every code is taken."""

    def __contains__(self, code):
        return set(code) <= set(LETTERS)

    def __len__(self):
        return len(LETTERS) ** LENGTH


def test_a_study_can_be_read_where_nothing_can_be_written(filled):
    before = sorted(filled.iterdir())
    assert len(read_records(filled)) == 3
    assert sorted(filled.iterdir()) == before


@pytest.mark.parametrize("torn", [b"", b"2"])
def test_a_head_that_a_power_cut_emptied_says_nothing_and_one_that_is_odd_is_refused(filled, torn):
    (filled / "study.head").write_bytes(torn)
    if torn:
        with pytest.raises(StoreError, match="study.head: must hold a number and a digest"):
            reopen_study(filled)
    else:
        reopen_study(filled).close()
        assert len(load_study(filled).meta["hash"]) == 64


def test_a_study_that_was_killed_before_its_first_record_begins_again(tmp_path):
    small_study(tmp_path).close()
    for path in (tmp_path / "study").glob("study.sqlite*"):
        path.unlink()
    with small_study(tmp_path) as study:
        assert list(study.store.records) == []
