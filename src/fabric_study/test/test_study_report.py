# SPDX-License-Identifier: BSD-3-Clause
"""The report of a study: what it holds, that it says when people are simulated, and never NaN."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest
from made_up_study import made_up

from fabric_study.report import main
from fabric_study.study_analysis import analyse
from fabric_study.study_report import study_html

PROTOCOLS = ("experiment-0", "experiment-1", "experiment-2")
PEOPLE = 5


@pytest.fixture(scope="module", params=PROTOCOLS)
def study(request):
    return made_up(request.param, PEOPLE)


@pytest.fixture(scope="module")
def page(study):
    return study_html(analyse(study), [])


def captions(page: str) -> list[str]:
    return re.findall(r"<(?:fig)?caption>(.*?)</(?:fig)?caption>", page, re.DOTALL)


def test_every_table_and_figure_says_that_people_are_simulated(page):
    found = captions(page)
    assert len(found) > 5
    assert [caption for caption in found if "simulated" not in caption.lower()] == []


def test_no_table_shows_a_number_that_is_none(page):
    cells = re.findall(r"<td[^>]*>(.*?)</td>", page, re.DOTALL)
    assert [cell for cell in cells if re.search(r"\b(nan|inf|None)\b", cell)] == []


def test_a_page_fetches_nothing(page):
    assert re.findall(r"""(?:src|href)=["'](?!#|data:)""", page) == []


def test_the_report_of_real_people_does_not_call_them_simulated():
    study = made_up("experiment-1", PEOPLE)
    real = replace(study, meta={**study.meta, "simulated": False})
    assert "SIMULATED" not in study_html(analyse(real), [])


def test_one_person_gives_a_page_with_sentences_in_place_of_tests():
    study_html(analyse(made_up("experiment-1", 1)), [])


def test_a_folder_with_a_damaged_store_is_refused_by_name(tmp_path, capsys):
    (tmp_path / "study.sqlite").write_bytes(b"no database")
    assert main([str(tmp_path)]) == 2
    assert str(tmp_path) in capsys.readouterr().err
    assert not (tmp_path / "report.html").exists()
