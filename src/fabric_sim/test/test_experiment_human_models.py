# SPDX-License-Identifier: BSD-3-Clause
"""The command human-models: what it refuses, its tables and its page, from results made up."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from fabric_sim.experiments import dial_fit, likelihood_matrix, watching_fit
from fabric_sim.experiments.dial_fit import Fit
from fabric_sim.experiments.human_models import main, write
from fabric_sim.experiments.human_models_report import Results, json_rows, text_of
from fabric_sim.experiments.likelihood_matrix import TYPES, Explained, Matrix, short_name
from fabric_sim.experiments.people_fit import PeopleResult, PersonResult, fit_person
from fabric_sim.experiments.recovery import Recovery
from fabric_sim.experiments.sorting_people import MEASURES, ROBOTS, SortingPeople
from fabric_sim.experiments.trials import by_person, read_folder
from fabric_sim.experiments.watching import Watching
from fabric_sim.sensing import DirectParameters, load_sensing

SENSING = DirectParameters(0.05, 0.5, (0.2, 0.4), (0.8, 0.9), 0.03, (0.8, 0.9), {0: (0.5, 1.5)})
PACKAGE = Path(__file__).parents[1]
SHIPPED = PACKAGE / "recorded"
SHIPPED_SENSING = load_sensing(PACKAGE / "config" / "sensing.yaml")


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
    sorting = SortingPeople(np.full((3, len(ROBOTS), len(MEASURES)), 0.25), 101)
    return Results(types, matrix(2), PeopleResult("folder", (person,)), recovery, sorting)


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
    for part in (
        "the recorded types",
        "Fig. 6.18",
        "Fig. 6.29a",
        "Fig. 6.29b",
        "0.50 (0.40-0.60)",
        "NOT met",
    ):
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
    assert parts == {
        "recorded types", "sorting", "type explained", "person", "comparison", "recovery", "goal"
    }  # fmt: skip


def test_a_person_is_fitted_and_predicted_from_a_folder(monkeypatch):
    for name, value in {"_FIRST": 16, "_ROUND": 16, "_ROUNDS": 1, "_POLISH": 1}.items():
        monkeypatch.setattr(dial_fit, name, value)
    own = by_person(read_folder(SHIPPED))["simulated02"][:2]
    found = fit_person("simulated02", own, Watching.of(SHIPPED_SENSING), 101)
    assert found.types.scores.shape == (2, 16)
    assert found.predictions.shape == (2, 5)
    assert np.isfinite(found.predictions).all()
    assert found.fit.log_likelihood >= found.types.scores.sum(axis=0).max()


def test_what_a_type_did_is_explained_better_by_it_than_by_its_opposite(monkeypatch):
    monkeypatch.setattr(likelihood_matrix, "TYPES", (TYPES[2], TYPES[13]))
    found = likelihood_matrix.run(Watching.of(SHIPPED_SENSING), 2, 101, 1)
    first, second = (row.likelihood for row in found.rows)
    assert first[2] > first[13]
    assert second[13] > second[2]


def test_how_people_were_watched_is_learnt_from_the_other_group(monkeypatch):
    ladders = {"held": (0.0, 0.6), "confusion": (0.05,), "report": (1.0, 6.0)}
    monkeypatch.setattr(watching_fit, "LADDERS", ladders)
    trials = [trial for trial in read_folder(SHIPPED) if trial.task == 1]
    found = watching_fit.watching_of_people(trials, Watching.of(SHIPPED_SENSING))
    assert found["simulated01"] is found["simulated03"]
    assert found["simulated02"] is found["simulated04"]
    assert found["simulated01"] is not found["simulated02"]
    assert all((w.held, w.report) == (0.0, 1.0) for w in found.values())
