# SPDX-License-Identifier: BSD-3-Clause
"""The command human-models: what it refuses, its tables and its page, from results made up."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from fabric_sim.experiments.dial_fit import Fit
from fabric_sim.experiments.human_models import main, write
from fabric_sim.experiments.human_models_report import Results, json_rows, text_of
from fabric_sim.experiments.likelihood_matrix import TYPES, Explained, Matrix, short_name
from fabric_sim.experiments.people_fit import PeopleResult, PersonResult
from fabric_sim.experiments.recovery import Recovery
from fabric_sim.experiments.watching import Watching
from fabric_sim.sensing import DirectParameters

SENSING = DirectParameters(0.05, 0.5, (0.2, 0.4), (0.8, 0.9), 0.03, (0.8, 0.9), {0: (0.5, 1.5)})


def fit_at(*dials):
    best = np.array(dials)
    return Fit(best, np.maximum(best - 0.1, 0.0), np.minimum(best + 0.1, 1.0), best, -10.0, 99.0)


def matrix(wrong_rows):
    rows = []
    for i in range(16):
        scores = np.full((2, 16), -20.0)
        scores[:, (i + 1) % 16 if i < wrong_rows else i] = -10.0
        rows.append(Explained(scores, np.array([5, 5])))
    return Matrix(tuple(rows), 2, 1)


@pytest.fixture
def results():
    types = SimpleNamespace(
        passed=True, text=lambda: "the recorded types", html=lambda: "<p>recorded</p>",
        json_rows=lambda: [{"type": "beginner"}], figures=list,
    )  # fmt: skip
    predictions = np.array([[-10.0, -11.0, -50.0, -13.0, -10.5]] * 3)
    explained = Explained(np.linspace(-20.0, -10.0, 48).reshape(3, 16), np.array([5, 5, 5]))
    watching = Watching.of(SENSING)
    person = PersonResult("<p1>", fit_at(0.5, 1.0, 0.2, 0.0), explained, predictions, watching)
    true = np.array([[0.5, 0.5, 0.5, 0.5], [0.1, 0.9, 0.2, 0.8], [0.9, 0.2, 0.7, 0.3]])
    recovery = Recovery(true, tuple(fit_at(*(row + 0.05)) for row in true))
    return Results(types, matrix(2), PeopleResult("folder", (person,)), recovery)


def test_a_folder_that_cannot_be_used_is_refused_by_name(tmp_path, capsys):
    assert main([str(tmp_path / "nowhere")]) == 2
    assert "nowhere: no such folder" in capsys.readouterr().err


def test_every_goal_is_told_with_its_figure(results):
    gates = {title: (met, figure) for title, met, figure in results.gates()}
    assert gates["diagonal largest in at least 14 of 16 rows"] == (True, "14 of 16")
    assert gates["fitted dials predict better than best known type"][0]
    assert gates["intervals hold at least 85% of known dials"] == (True, "100%")


def test_thirteen_rows_on_the_diagonal_are_not_enough():
    assert matrix(2).passed
    assert not matrix(3).passed


def test_likelihoods_are_geometric_means_per_observation():
    explained = Explained(np.array([[-2.0] * 16, [-8.0] * 16]), np.array([2, 3]))
    assert explained.likelihood[0] == pytest.approx(np.exp(-10.0 / 5.0))
    assert explained.task_mean[0] == pytest.approx((np.exp(-1.0) + np.exp(-8.0 / 3.0)) / 2.0)


def test_short_names_tell_all_types_apart():
    assert short_name("expert_rested_attentive_collaborative") == "ERAC"
    assert len({short_name(name) for name in TYPES}) == 16


def test_the_text_holds_every_part(results):
    text = text_of(results)
    for part in ("the recorded types", "Fig. 6.29a", "Fig. 6.29b", "0.50 (0.40-0.60)", "NOT met"):
        assert (part in text) == (part != "NOT met"), part


def test_the_page_and_the_json_stand_by_themselves(results, tmp_path):
    paths = write(results, tmp_path / "out")
    page = paths[1].read_text(encoding="utf-8")
    assert page.count("<svg") == 6
    assert "&lt;p1&gt;" in page
    for loaded in ("<script", "<link", "<img", "url(http"):
        assert loaded not in page
    rows = json.loads(paths[0].read_text(encoding="utf-8"))
    assert rows == json.loads(json.dumps(json_rows(results)))
    parts = {row["part"] for row in rows}
    assert parts == {"recorded types", "type explained", "person", "comparison", "recovery", "goal"}
