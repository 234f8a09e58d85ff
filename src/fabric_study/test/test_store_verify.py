# SPDX-License-Identifier: BSD-3-Clause
"""Verification: a whole study is whole, and whatever is taken from it or changed is found."""

import hashlib
import json
import shutil
import sqlite3

import pytest
import rosbag
from std_msgs.msg import String
from study_play import RunFolder, play, small_study

from fabric_study import command
from fabric_study.bag_index import BagError, check_bag
from fabric_study.store import Record, digest_of, read_records
from fabric_study.store_verify import verify
from fabric_study.study_folder import read_study
from fabric_study.visit import Visit

MESSAGES = 7


def write_bag(path) -> None:
    with rosbag.Bag(str(path), "w", chunk_threshold=120) as bag:
        for number in range(MESSAGES):
            bag.write("words" if number % 2 else "others", String(f"word {number}" * 5))


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A study of two visits with bags, one run folder each, closed."""
    folder = tmp_path_factory.mktemp("whole")
    with small_study(folder) as study:
        for index, person in enumerate(("K7QF2M", "W7QF2M")):
            visit, run = Visit(study, person, 1.0, index), RunFolder(study.new_run())
            play(study, visit, run)
            visit.note(2000.0, "all well")
            parameters = {"parameters": {"record": True}}
            (run.path / "run.json").write_text(json.dumps(parameters))
            for task_id in range(1, run.tasks + 1):
                write_bag(run.path / f"task_{task_id:03d}.bag")
    return folder / "study"


@pytest.fixture
def copy(whole, tmp_path):
    return shutil.copytree(whole, tmp_path / "study")


def test_a_whole_study_has_no_fault_and_says_what_was_checked(whole):
    verdict = verify(whole)
    assert verdict.faults == []
    info = read_study(whole)
    told = "\n".join(verdict.checked)
    for words in (
        f"study.json: small, seed 101, hash of the protocol {info.protocol.hash[:16]}",
        f"study.sqlite: {len(read_records(whole))} records, numbers and digests",
        "visits: 2 finished; every step in its order",
        "answers: 40,",
        "tasks: 10 done, each with its row as in results.csv; 50 events as in events.jsonl",
        "bags: 10 closed, with an index that can be read",
    ):
        assert words in told


def rewrite(folder, change) -> None:
    """Change the list of records and make all digests fit again, as only a forger would."""
    records = change(read_records(folder))
    digest, made = read_study(folder).genesis, []
    for seq, record in enumerate(records, 1):
        record = record._replace(seq=seq)
        digest = digest_of(digest, record)
        made.append(record._replace(digest=digest))
    connection = sqlite3.connect(folder / "study.sqlite", isolation_level=None)
    for trigger in ("record_stays", "record_remains"):
        connection.execute(f"DROP TRIGGER {trigger}")
    connection.execute("DELETE FROM record")
    connection.executemany("INSERT INTO record VALUES (?, ?, ?, ?, ?, ?)", made)
    connection.close()
    (folder / "study.head").write_text(f"{len(made)} {digest}\n")


def without(kind, place=0):
    def change(records):
        chosen = [r for r in records if r.kind == kind][place]
        return [r for r in records if r is not chosen]

    return change


def doubled(kind):
    def change(records):
        at = next(i for i, r in enumerate(records) if r.kind == kind)
        return [*records[: at + 1], *records[at:]]

    return change


def edited(kind, **changes):
    def change(records):
        at = next(i for i, r in enumerate(records) if r.kind == kind)
        data = json.dumps({**records[at].content, **changes})
        return [*records[:at], records[at]._replace(data=data), *records[at + 1 :]]

    return change


def untouched(records: list[Record]) -> list[Record]:
    return records


FORGED = [
    (without("answer"), "step start_demographics is done without"),
    (without("step_entered"), "has not been entered"),
    (without("step_done"), "step is"),
    (without("visit_opened"), "the visit has not been opened"),
    (without("task_begun"), "no task runs in practice_3"),
    (without("task_event"), "events.jsonl task 1: event 1 is not what the store has"),
    (without("task_event", 2), "event 4 of run 1: 3 must come next"),
    (without("task_event", 4), "its row comes before the event of its end"),
    (without("task_done"), "step practice_3 is done, but its task is not"),
    (doubled("task_done"), "no task runs in practice_3"),
    (doubled("step_entered"), "step start_1 is entered twice"),
    (doubled("visit_opened"), "the visit is opened twice"),
    (edited("answer", value=1000), "answer in start_demographics: "),
    (edited("answer", item="eye"), "has no item 'eye'"),
    (edited("answer", colour="red"), "answer holds colour, "),
    (edited("task_begun", seed=5), "seed of its row is "),
    (edited("task_begun", policy="eager"), "policy is 'eager'"),
    (edited("task_event", score=99), "event 1 is not what the store has"),
    (edited("visit_opened", protocol="0"), "visit_opened: protocol is '0', not "),
    (edited("visit_opened", conditions=["slow"]), "visit_opened: conditions is ['slow'], not"),
    (edited("visit_opened", index=1), "conditions"),
    (
        lambda records: [r._replace(visit="X") if r.kind == "note" else r for r in records],
        "'X' is no code of a person whose visit was opened",
    ),
]


@pytest.mark.parametrize("change, complaint", FORGED, ids=[text for _, text in FORGED])
def test_records_that_cannot_follow_are_found_although_every_digest_fits(copy, change, complaint):
    rewrite(copy, change)
    assert any(complaint in fault for fault in verify(copy).faults), verify(copy).faults


def test_rewriting_without_a_change_is_no_fault(copy):
    rewrite(copy, untouched)
    assert verify(copy).faults == []


def change_cell(folder, column, text):
    path = folder / "runs" / "1" / "results.csv"
    header, first, *rest = path.read_text().splitlines()
    cells = first.split(",")
    cells[header.split(",").index(column)] = text
    path.write_text("\n".join([header, ",".join(cells), *rest]) + "\n")


def drop_lines(path, *numbers):
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(line for n, line in enumerate(lines) if n not in numbers))


def cut(path, size):
    path.write_bytes(path.read_bytes()[:size])


def edit_study(folder, key, value):
    path = folder / "study.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), key: value}))


BAG = "runs/1/task_002.bag"
LOST = [
    (lambda f: change_cell(f, "duration_s", "1.000000"), "runs/1/results.csv task 1: duration_s"),
    (lambda f: drop_lines(f / "runs/1/results.csv", 2), "runs/1/results.csv task 2: has no row"),
    (lambda f: (f / "runs/1/results.csv").unlink(), "runs/1/results.csv task 5: has no row"),
    (lambda f: drop_lines(f / "runs/1/events.jsonl", 24), "events.jsonl task 5: has 4 events, th"),
    (lambda f: drop_lines(f / "runs/1/events.jsonl", 3), "line 4: sequence is 5, not 4"),
    (lambda f: (f / "runs/1/events.jsonl").unlink(), "events.jsonl task 1: has 0 events, the st"),
    (lambda f: shutil.rmtree(f / "runs/2"), "runs/2: there is no such folder"),
    (lambda f: (f / BAG).unlink(), "runs/1/task_002.bag: cannot be read"),
    (lambda f: (f / BAG).rename(f / f"{BAG}.active"), "runs/1/task_002.bag.active: was not closed"),
    (lambda f: cut(f / BAG, 5000), "runs/1/task_002.bag: "),
    (lambda f: edit_study(f, "simulated", True), "record 1 (visit_opened) does not fit"),
    (lambda f: edit_study(f, "hash", "0"), "hash: is '0', but the content says"),
    (lambda f: (f / "study.sqlite").unlink(), "study.sqlite: there is no such file"),
    (lambda f: (f / "study.json").unlink(), "study.json: cannot be read"),
    (lambda f: (f / "study.head").write_text("x"), "study.head: must hold a number and a digest"),
]  # fmt: skip


@pytest.mark.parametrize("deed, complaint", LOST, ids=[text for _, text in LOST])
def test_whatever_is_lost_or_changed_on_the_disk_is_found_with_its_place(copy, deed, complaint):
    deed(copy)
    assert any(complaint in fault for fault in verify(copy).faults), verify(copy).faults


def test_a_row_that_is_in_no_visit_is_found(copy):
    path = copy / "runs" / "1" / "results.csv"
    header, first, *_ = path.read_text().splitlines()
    with path.open("a") as file:
        file.write(f"9{first[first.index(',') :]}\n")
    assert "runs/1/task 9: is in no visit" in verify(copy).faults


def test_a_row_that_counts_other_placements_than_happened_is_found(copy):
    def change(records):
        at = next(i for i, r in enumerate(records) if r.kind == "task_done")
        data = records[at].content
        data["row"]["human_succeeded"] += 1
        return [*records[:at], records[at]._replace(data=json.dumps(data)), *records[at + 1 :]]

    rewrite(copy, change)
    assert any("human_succeeded is" in fault and "such events" in fault
               for fault in verify(copy).faults)  # fmt: skip


def test_verifying_changes_nothing_and_leaves_nothing(copy):
    def digests():
        files = [path for path in sorted(copy.rglob("*")) if path.is_file()]
        return {path: hashlib.sha256(path.read_bytes()).hexdigest() for path in files}

    before = digests()
    assert verify(copy).faults == []
    assert digests() == before


def test_the_index_of_a_bag_counts_what_was_written(tmp_path):
    write_bag(tmp_path / "a.bag")
    assert check_bag(tmp_path / "a.bag") == MESSAGES
    rosbag.Bag(str(tmp_path / "empty.bag"), "w").close()
    assert check_bag(tmp_path / "empty.bag") == 0


def test_a_bag_that_is_cut_off_anywhere_is_refused_with_its_name(tmp_path):
    path = tmp_path / "a.bag"
    write_bag(path)
    whole = path.read_bytes()
    for size in [*range(0, 60), *range(60, len(whole), 97), len(whole) - 1]:
        path.write_bytes(whole[:size])
        with pytest.raises(BagError, match=r"a\.bag: "):
            check_bag(path)


def test_a_bag_that_was_never_closed_is_refused(tmp_path):
    path = tmp_path / "a.bag"
    bag = rosbag.Bag(str(path), "w")
    bag.write("words", String("x" * 100))
    shutil.copy(path, tmp_path / "b.bag")
    bag.close()
    with pytest.raises(BagError, match="b.bag: was not closed: it has no index"):
        check_bag(tmp_path / "b.bag")


def test_the_command_tells_what_it_checked_and_ends_with_1_when_there_is_a_fault(copy, capsys):
    assert command.main(["verify", str(copy)]) == 0
    told = capsys.readouterr().out
    assert "checked  study.sqlite: " in told and told.endswith(": nothing is missing\n")
    (copy / BAG).unlink()
    assert command.main(["verify", str(copy)]) == 1
    told = capsys.readouterr().out
    assert "FAULT    runs/1/task_002.bag: " in told and told.endswith(": 1 fault\n")


@pytest.mark.parametrize(
    "words",
    [[], ["verify"], ["verify", "a", "b"], ["verify", "nowhere"], ["sing", "a"], ["export"]],
)
def test_a_command_that_cannot_be_meant_ends_with_2_and_a_sentence(words, capsys):
    assert command.main(words) == 2
    assert capsys.readouterr().err.strip()
