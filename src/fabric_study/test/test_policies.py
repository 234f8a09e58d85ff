# SPDX-License-Identifier: BSD-3-Clause
"""Names of policies stand for decision models; what does not exist is refused with a reason."""

from pathlib import Path

import pytest

from fabric_study.policies import model_path, policy_names


@pytest.fixture
def models(tmp_path: Path) -> Path:
    for name in ("sorting_proactive", "sorting_on_a_whim", "inspection_reactive", "none"):
        (tmp_path / f"{name}.pomdpx").touch()
    return tmp_path


def test_the_names_are_those_of_the_scenario_and_none(models):
    assert policy_names("sorting", models) == ["on_a_whim", "proactive", "none"]
    assert policy_names("inspection", models) == ["reactive", "none"]


def test_a_name_stands_for_the_model_of_the_scenario(models):
    path = model_path("proactive", "sorting", models)
    assert path == models / "sorting_proactive.pomdpx"
    assert model_path("none", "inspection", models) == models / "none.pomdpx"


def test_a_model_file_stands_for_itself(models):
    path = models / "inspection_reactive.pomdpx"
    assert model_path(str(path), "sorting", models) == path


@pytest.mark.parametrize("policy", ["reactive", "../none", "", "abps", "sorting_proactive"])
def test_a_name_without_a_model_is_refused_with_those_that_have_one(models, policy):
    with pytest.raises(ValueError) as caught:
        model_path(policy, "sorting", models)
    said = f"policy {policy!r} is none of abps, on_a_whim, proactive, none and no model file"
    assert str(caught.value) == said


def test_a_model_file_that_is_not_there_is_refused(models):
    with pytest.raises(ValueError, match="no_such.pomdpx: there is no such model file"):
        model_path(str(models / "no_such.pomdpx"), "sorting", models)
