# SPDX-License-Identifier: BSD-3-Clause
"""Our statistics against independent libraries (data/statistics.json says which)."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from fabric_study.statistics.as_published import one_way_anova, tukey_hsd
from fabric_study.statistics.compare import compare
from fabric_study.statistics.holm import holm
from fabric_study.statistics.layout import person_means
from fabric_study.statistics.mixed import learning, mixed_conditions
from fabric_study.statistics.pairs import _normal_p, paired_t, rank_biserial, snap, wilcoxon
from fabric_study.statistics.reliability import cronbach_alpha
from fabric_study.statistics.repeated import friedman, mauchly, repeated_anova

SETS = json.loads((Path(__file__).parent / "data/statistics.json").read_text())["sets"]
SEVERAL = ["continuous", "likert"]


def close(value: float):
    return pytest.approx(value, rel=1e-6, abs=1e-9)


def rows(name: str) -> pd.DataFrame:
    frame = pd.DataFrame(SETS[name]["rows"], columns=["person", "condition", "number", "value"])
    return frame.assign(condition=frame["condition"].astype("category"))


def means(name: str) -> pd.DataFrame:
    return person_means(rows(name), sorted(rows(name)["condition"].unique()))


def samples(name: str) -> list[np.ndarray]:
    return [group["value"].to_numpy() for _, group in rows(name).groupby("condition")]


def pairs():
    return [
        pytest.param(name, pair, id=f"{name}-{pair['first']}-{pair['second']}")
        for name, content in SETS.items()
        for pair in content["expected"]["pairs"]
    ]


@pytest.mark.parametrize(("name", "expected"), pairs())
def test_paired_t_agrees(name, expected):
    table = means(name)
    result = paired_t(table[expected["first"]] - table[expected["second"]])
    assert (result.value, result.p) == (close(expected["t"]), close(expected["p"]))
    difference = result.effects[0]
    assert [difference.low, difference.high] == [close(end) for end in expected["ci"]]


@pytest.mark.parametrize(("name", "expected"), pairs())
def test_wilcoxon_agrees_with_all_permutations(name, expected):
    table = means(name)
    result = wilcoxon(table[expected["first"]] - table[expected["second"]])
    assert result.p == close(expected["wilcoxon_exact_p"])
    assert result.value == close(expected["w_plus"])


@pytest.mark.parametrize(("name", "expected"), pairs())
def test_wilcoxon_without_permutations_agrees(name, expected):
    table = means(name)
    differences = snap((table[expected["first"]] - table[expected["second"]]).to_numpy())
    ranks = np.rint(2.0 * stats.rankdata(np.abs(differences))).astype(int)
    p = _normal_p(ranks[differences != 0], int(ranks[differences > 0].sum()))
    assert p == close(expected["wilcoxon_normal_p"])


@pytest.mark.parametrize(("name", "expected"), pairs())
def test_rank_biserial_agrees_where_nobody_ties(name, expected):
    table = means(name)
    differences = snap((table[expected["first"]] - table[expected["second"]]).to_numpy())
    moved = differences[differences != 0]
    assert float(rank_biserial(moved)) == close(expected["rank_biserial_without_zeros"])


def test_some_of_the_data_have_ties_and_zeros():
    assert sum(pair["zeros"] for pair in SETS["likert"]["expected"]["pairs"]) > 3


@pytest.mark.parametrize("name", SETS)
def test_holm_agrees(name):
    expected = SETS[name]["expected"]
    adjusted = holm([pair["p"] for pair in expected["pairs"]])
    assert adjusted == [close(p) for p in expected["holm"]]


@pytest.mark.parametrize("name", SEVERAL)
def test_repeated_measures_anova_agrees(name):
    expected = SETS[name]["expected"]["anova"]
    result = repeated_anova(means(name).to_numpy())
    effects = {effect.name: effect.value for effect in result.effects}
    assert (result.value, result.p) == (close(expected["F"]), close(expected["p_gg"]))
    assert effects["epsilon"] == close(expected["epsilon"])
    assert effects["ges"] == pytest.approx(expected["ges"], abs=1e-6)


@pytest.mark.parametrize("name", SEVERAL)
def test_repeated_measures_anova_agrees_with_statsmodels(name):
    from statsmodels.stats.anova import AnovaRM

    table = rows(name).groupby(["person", "condition"], observed=True)["value"].mean().reset_index()
    told = AnovaRM(table, "value", "person", within=["condition"]).fit().anova_table
    assert repeated_anova(means(name).to_numpy()).value == close(told["F Value"].iloc[0])


@pytest.mark.parametrize("name", SEVERAL)
def test_mauchly_agrees(name):
    expected = SETS[name]["expected"]["mauchly"]
    result = mauchly(means(name).to_numpy())
    assert (result.value, result.p) == (close(expected["W"]), close(expected["p"]))


@pytest.mark.parametrize("name", SEVERAL)
def test_friedman_agrees(name):
    expected = SETS[name]["expected"]["friedman"]
    result = friedman(means(name).to_numpy())
    assert (result.value, result.p) == (close(expected["chi2"]), close(expected["p"]))
    assert result.effects[0].value == close(expected["W"])


@pytest.mark.parametrize("name", SEVERAL)
def test_one_way_anova_agrees(name):
    expected = SETS[name]["expected"]["one_way"]
    result = one_way_anova(samples(name))
    assert (result.value, result.p) == (close(expected["F"]), close(expected["p"]))
    assert result.effects[0].value == pytest.approx(expected["eta2"], abs=1e-6)


@pytest.mark.parametrize("name", SEVERAL)
def test_tukey_agrees(name):
    found = tukey_hsd(samples(name), ["c0", "c1", "c2"])
    expected = SETS[name]["expected"]["tukey"]
    for pair, wanted in zip(found, expected, strict=True):
        assert pair.outcome.p == pytest.approx(wanted["p"], abs=1e-6)
        assert pair.outcome.effects[0].value == close(wanted["difference"])
        q, df = pair.outcome.value, pair.outcome.df
        assert stats.studentized_range.sf(q, *df) == pytest.approx(wanted["p"], abs=1e-6)


@pytest.mark.parametrize("name", SEVERAL)
def test_cronbach_alpha_agrees(name):
    assert cronbach_alpha(means(name)) == close(SETS[name]["expected"]["cronbach"])


def test_mixed_model_of_balanced_data_is_the_paired_t_test():
    rng = np.random.default_rng(103)
    people, conditions = np.divmod(np.arange(84) // 3, 2)
    level = rng.normal(size=14)[people] + rng.normal(size=28)[2 * people + conditions]
    frame = pd.DataFrame(
        {"person": people, "number": 1.0, "value": level + 0.5 * rng.normal(size=84)}
    )
    frame["condition"] = pd.Categorical(np.array(["a", "b"])[conditions])
    table = person_means(frame, ["a", "b"])
    expected, result = paired_t(table["a"] - table["b"]), mixed_conditions(frame)
    assert (result.value, result.p) == (close(expected.value), close(expected.p))
    assert result.effects[0].low == close(expected.effects[0].low)


def test_learning_is_the_slope_of_another_fit():
    """Against statsmodels started elsewhere, with another optimiser."""
    import statsmodels.formula.api as formulas

    frame = rows("continuous")
    frame["number"] -= frame["number"].mean()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model = formulas.mixedlm(
            "value ~ C(condition) + number",
            frame,
            groups="person",
            re_formula="1",
            vc_formula={"slope": "0 + number"},
        )
        told = model.fit(method=["nm"], xtol=1e-12, ftol=1e-14, maxiter=5000)
    effect = learning(rows("continuous")).effects[0]
    half = stats.t.ppf(0.975, 13) * told.bse_fe["number"]
    assert effect.value == close(told.fe_params["number"])
    assert effect.high - effect.value == pytest.approx(half, rel=1e-5)


def test_comparison_says_what_its_parts_say():
    frame = rows("continuous")
    found = compare(frame, "value", ["c0", "c1", "c2"])
    expected = SETS["continuous"]["expected"]
    assert found.omnibus.p == close(expected["anova"]["p_gg"])
    assert [pair.p_holm for pair in found.pairs] == [close(p) for p in expected["holm"]]
    assert found.published_omnibus.value == close(expected["one_way"]["F"])
