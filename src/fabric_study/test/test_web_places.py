# SPDX-License-Identifier: BSD-3-Clause
"""What study.launch asks before anything starts."""

import random

from study_play import small_study

from fabric_study.visit import begin_visit
from fabric_study.web.places import main


def told(capsys, *arguments: str) -> str:
    assert main(arguments) == 0
    return capsys.readouterr().out


def test_a_new_study_has_its_first_run_and_nobody(tmp_path, capsys):
    assert told(capsys, "run", str(tmp_path / "new")) == str(tmp_path / "new" / "runs" / "1")
    assert told(capsys, "people", str(tmp_path / "new")) == str(tmp_path / "new" / "people")
    assert told(capsys, "person", str(tmp_path / "new")) == ""
    assert not (tmp_path / "new").exists()


def test_the_person_in_a_visit_is_told_until_it_is_closed(tmp_path, capsys):
    with small_study(tmp_path) as study:
        visit = begin_visit(study, 1.0, random.Random(1))
        study.new_run().mkdir(parents=True)
        assert told(capsys, "person", str(study.folder)) == visit.person
        assert told(capsys, "run", str(study.folder)) == str(study.folder / "runs" / "2")
        visit.close(2.0, "aborted", "felt unwell")
        assert told(capsys, "person", str(study.folder)) == ""


def test_paths_begin_at_the_root_wherever_it_is_asked(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert told(capsys, "folder", "pilot") == str(tmp_path / "pilot")
    assert told(capsys, "run", "pilot") == str(tmp_path / "pilot" / "runs" / "1")


def test_what_cannot_be_meant_is_refused(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    for arguments in ((), ("run",), ("run", ""), ("walk", "x"), ("run", str(tmp_path / "file"))):
        assert main(arguments) == 2
        told = capsys.readouterr()
        assert told.out == "" and told.err
