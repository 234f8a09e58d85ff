# SPDX-License-Identifier: BSD-3-Clause
"""A run folder becomes one HTML file that needs nothing else."""

from html.parser import HTMLParser

import pytest
from test_results import row

from fabric_study.report import main
from fabric_study.results import ResultsWriter
from fabric_study.run_record import RunRecord
from fabric_study.statistics.descriptive import moving_average


def fill(folder, *rows):
    RunRecord(folder, {"human": "<b>expert</b>", "seed": 1})
    writer = ResultsWriter(folder / "results.csv")
    for values in rows:
        writer.write(values)
    writer.close()


class Tags(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.tags, self.links = [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        values = (
            value or "" for name, value in attributes if name in ("src", "href", "xlink:href")
        )
        self.links += [value for value in values if not value.startswith("#")]


def test_the_report_holds_tables_and_a_figure_and_fetches_nothing(tmp_path, capsys):
    fill(tmp_path, row(), row(task=2, policy="reactive", warnings=2))
    assert main([str(tmp_path)]) == 0
    path = tmp_path / "report.html"
    assert capsys.readouterr().out.strip() == str(path)
    text = path.read_text()
    page = Tags(text)
    assert page.tags.count("table") == 3
    assert page.tags.count("svg") == 1
    assert page.links == []
    assert "&lt;b&gt;expert" in text
    assert "reactive" in text


def test_equal_folders_give_equal_figures(tmp_path):
    pages = []
    for _ in range(2):
        folder = tmp_path / str(len(pages)) / "run"
        fill(folder, row())
        main([str(folder)])
        text = (folder / "report.html").read_text()
        pages.append(text[: text.index("<h2>Run</h2>")])
    assert pages[0] == pages[1]


@pytest.mark.parametrize("rows, message", [(None, "holds no run"), ([], "holds no task")])
def test_a_folder_without_results_is_refused_by_name(tmp_path, capsys, rows, message):
    if rows is not None:
        fill(tmp_path, *rows)
    assert main([str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert message in said
    assert str(tmp_path) in said


def test_the_moving_average_begins_with_what_there_is():
    assert moving_average([1.0, 3.0, 5.0, 7.0], 2) == [1.0, 2.0, 4.0, 6.0]
