# SPDX-License-Identifier: BSD-3-Clause
"""A study as tables: what was recorded is what is analysed, exported and mirrored."""

import csv
import json
import random

import pandas as pd
import pytest
import sqlalchemy as sa
from study_play import RunFolder, answer_of, play, small_study

from fabric_study import command
from fabric_study.meter import COLUMNS
from fabric_study.store import read_records
from fabric_study.store_mirror import Mirror, MirrorError
from fabric_study.study_data import load_study, study_from_frames
from fabric_study.study_export import export
from fabric_study.study_folder import read_study
from fabric_study.visit import Visit, begin_visit

PEOPLE = ("K7QF2M", "W7QF2M", "C7QF2M")


@pytest.fixture(scope="module")
def played(tmp_path_factory):
    """A study of three people, of whom the last one left early; its folder."""
    folder = tmp_path_factory.mktemp("played")
    with small_study(folder) as study:
        for index, person in enumerate(PEOPLE):
            visit = Visit(study, person, 1000.0, index)
            if index < 2:
                play(study, visit, RunFolder(study.new_run()))
        visit.finish_step(1001.0)
        visit.answer(1002.0, "age", 40)
        visit.note(1003.25, 'said: "zu laut; zu hell",\nwent home')
        visit.close(1004.0, "aborted", "felt unwell")
    return folder / "study"


def test_people_have_their_order_of_conditions_status_and_demographics(played):
    people = load_study(played).people.set_index("person")
    protocol = read_study(played).protocol
    assert list(people.index) == list(PEOPLE)
    assert list(people["status"]) == ["finished", "finished", "aborted"]
    for index, person in enumerate(PEOPLE):
        assert people.loc[person, "order"] == " ".join(protocol.condition_order(index, 101))
    assert people.loc["C7QF2M", "age"] == 40


def test_tasks_have_the_columns_of_results_and_leave_practice_out(played):
    data = load_study(played)
    assert list(data.tasks.columns)[5:] == list(COLUMNS)
    for person in PEOPLE[:2]:
        own = data.tasks[data.tasks["person"] == person]
        assert list(own["number"]) == [1, 2, 3, 4]
        assert sorted(own["condition"]) == ["alone", "quick", "quick", "slow"]
        assert list(own[own["condition"] == "quick"]["in_condition"]) == [1, 2]
    assert data.tasks["human_succeeded"].dtype == "int64"
    assert data.tasks["discounted_reward"].isna().all()


def test_answers_are_those_given_with_kind_and_category_of_their_item(played):
    data = load_study(played)
    protocol = read_study(played).protocol
    items = {i.id: i for one in protocol.instruments.values() for i in one.items}
    assert len(data.answers) == 2 * 20 + 1
    for row in data.answers.itertuples():
        assert (row.kind, row.category) == (items[row.item].kind, items[row.item].category)
    for index, person in enumerate(PEOPLE[:2]):
        for step in protocol.visit_steps(index, 101):
            for item in protocol.instruments[step.instrument].items if step.instrument else ():
                found = data.answers[
                    (data.answers["person"] == person)
                    & (data.answers["condition"] == step.condition)
                    & (data.answers["number"] == step.number)
                    & (data.answers["item"] == item.id)
                ]
                assert list(found["value"]) == [answer_of(person, step.id, item)]


def test_a_study_without_visits_gives_empty_tables_with_their_columns(tmp_path):
    small_study(tmp_path).close()
    data = load_study(tmp_path / "study")
    assert len(data.people) == len(data.tasks) == len(data.answers) == 0
    assert {"person", "condition", "efficiency"} <= set(data.tasks.columns)


def test_tables_made_in_memory_become_a_study_as_if_it_was_read(played):
    data = load_study(played)
    made = study_from_frames({"protocol": "small", "simulated": True}, data.tasks, data.answers)
    assert made.simulated and not data.simulated
    assert list(made.people["person"]) == list(PEOPLE)
    assert list(made.people["order"])[:2] == list(data.people["order"])[:2]
    with pytest.raises(ValueError, match="tasks lacks the columns condition"):
        study_from_frames(made.meta, data.tasks.drop(columns="condition"), data.answers)
    with pytest.raises(ValueError, match="meta lacks simulated"):
        study_from_frames({"protocol": "small"}, data.tasks, data.answers)


def rows_of(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_the_export_holds_every_answer_long_and_wide_and_reads_back(played, tmp_path):
    export(played, tmp_path / "out")
    data = load_study(played)
    long = rows_of(tmp_path / "out" / "answers.csv")
    assert len(long) == len(data.answers)
    wide = rows_of(tmp_path / "out" / "answers_wide.csv")
    cells = {(r["person"], r["condition"], r["number"], r["instrument"]): r for r in wide}
    assert len(cells) == len(wide)
    for row in long:
        place = (row["person"], row["condition"], row["number"], row["instrument"])
        assert cells[place][row["item"]] == row["value"]
    tasks = rows_of(tmp_path / "out" / "tasks.csv")
    assert [row["seed"] for row in tasks] == [str(seed) for seed in data.tasks["seed"]]
    assert {row["simulated"] for row in [*long, *wide, *tasks]} == {"0"}


def test_the_code_book_has_every_wording_and_the_notes_their_time(played, tmp_path):
    export(played, tmp_path / "out")
    book = {row["item"]: row for row in rows_of(tmp_path / "out" / "codebook.csv")}
    assert set(book) == {"age", "hand", "trust", "tired", "bored", "effort", "pick", "remark"}
    assert book["hand"]["values_de"] == "left = left (deutsch); right = right (deutsch)"
    assert (book["age"]["low"], book["age"]["high"]) == ("16.0", "99.0")
    (note,) = rows_of(tmp_path / "out" / "notes.csv")
    assert note["text"] == 'said: "zu laut; zu hell",\nwent home'
    assert (note["time"], note["person"]) == ("1970-01-01T00:16:43.250+00:00", "C7QF2M")


def test_an_export_never_writes_over_anything(played, tmp_path, capsys):
    (tmp_path / "notes.csv").write_text("mine")
    assert command.main(["export", str(played), str(tmp_path)]) == 2
    assert "notes.csv is there already" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["notes.csv"]
    assert command.main(["export", str(played), str(tmp_path / "new")]) == 0
    assert len(capsys.readouterr().out.splitlines()) == 6


def test_an_export_of_a_damaged_study_is_refused(tmp_path, capsys):
    with small_study(tmp_path) as study:
        study.store.append(1.0, "", [("note", {"text": "x"})])
    (tmp_path / "study" / "study.head").write_text(f"1 {'0' * 64}\n")
    assert command.main(["export", str(tmp_path / "study")]) == 1
    assert "study.head tells of another record 1" in capsys.readouterr().err
    assert not (tmp_path / "study" / "export").exists()


def mirrored(path, study_id=None):
    engine = sa.create_engine(f"sqlite:///{path}")
    query = "SELECT seq, stamp, visit, kind, data, digest FROM record {} ORDER BY study, seq"
    where = f"WHERE study = '{study_id}'" if study_id else ""
    with engine.connect() as connection:
        return [tuple(row) for row in connection.execute(sa.text(query.format(where)))]


def test_a_mirror_holds_the_same_records_and_copies_only_what_is_new(tmp_path):
    with small_study(tmp_path) as study:
        mirror = Mirror(f"sqlite:///{tmp_path / 'm.sqlite'}", study.folder, study.info)
        visit = begin_visit(study, 1.0, random.Random(101))
        assert (mirror.catch_up(), mirror.catch_up()) == (2, 0)
        play(study, visit, RunFolder(study.new_run()))
        visit.note(2.0, "日本 'quoted' \0")
        total = len(study.store.records)
        assert (mirror.catch_up(), mirror.catch_up()) == (total - 2, 0)
        assert mirrored(tmp_path / "m.sqlite") == [tuple(r) for r in read_records(study.folder)]
        mirror.close()


def test_a_mirror_that_was_away_catches_up_after_the_break(tmp_path):
    place = tmp_path / "away" / "m.sqlite"
    with small_study(tmp_path) as study:
        mirror = Mirror(f"sqlite:///{place}", study.folder, study.info)
        begin_visit(study, 1.0, random.Random(101))
        with pytest.raises(MirrorError, match="unable to open database file"):
            mirror.catch_up()
        place.parent.mkdir()
        assert mirror.catch_up() == 2
        place.rename(place.with_suffix(".gone"))
        study.store.append(2.0, "", [("note", {"text": "x"})])
        mirror.close()
        place.mkdir()
        with pytest.raises(MirrorError):
            mirror.catch_up()
        place.rmdir()
        place.with_suffix(".gone").rename(place)
        assert mirror.catch_up() == 1


def test_several_cells_share_a_database_and_a_stranger_of_the_same_name_is_refused(tmp_path):
    url = f"sqlite:///{tmp_path / 'm.sqlite'}"
    for cell in ("a", "b"):
        with small_study(tmp_path / cell) as study:
            study.store.append(1.0, "", [("note", {"text": cell})])
            Mirror(url, study.folder, study.info).catch_up()
            assert len(mirrored(tmp_path / "m.sqlite", study.info.id)) == 1
    assert len(mirrored(tmp_path / "m.sqlite")) == 2
    engine = sa.create_engine(url)
    with engine.begin() as connection:
        connection.execute(sa.text("UPDATE record SET digest = 'x'"))
    with small_study(tmp_path / "a") as study:
        with pytest.raises(MirrorError, match="has another record 1 of"):
            Mirror(url, study.folder, study.info).catch_up()
    path = tmp_path / "a" / "study" / "study.json"
    told = json.loads(path.read_text())
    path.write_text(json.dumps({**told, "seed": 102}))
    with pytest.raises(MirrorError, match="is told of otherwise there"):
        Mirror(url, path.parent, read_study(path.parent)).catch_up()


@pytest.mark.parametrize("url", ["nonsense", "postgresqlx://lab:secret@host/x", "://"])
def test_an_address_that_cannot_be_meant_is_refused_without_its_password(url, tmp_path):
    with small_study(tmp_path) as study:
        with pytest.raises(ValueError, match="^database ") as refused:
            Mirror(url, study.folder, study.info)
    assert "secret" not in str(refused.value)


def test_pandas_reads_the_exported_numbers_as_they_were(played, tmp_path):
    export(played, tmp_path)
    tasks = pd.read_csv(tmp_path / "tasks.csv")
    assert list(tasks["efficiency"]) == list(load_study(played).tasks["efficiency"])
