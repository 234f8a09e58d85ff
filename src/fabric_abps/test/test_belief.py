# SPDX-License-Identifier: BSD-3-Clause
"""Eq. 5.1 against a table worked by hand, and what must hold for any evidence."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fabric_abps import TypeBelief


def test_update_follows_the_hand_worked_table_of_equation_5_1() -> None:
    # prior (1/2, 1/3, 1/6), likelihood (.1, .3, .6):
    # products .05, .1, .1; sum .25; posterior .2, .4, .4
    belief = TypeBelief(["a", "b", "c"], 0.0, 1e-12, prior=[1 / 2, 1 / 3, 1 / 6])
    belief.update(np.log([0.1, 0.3, 0.6]))
    assert belief.probability == pytest.approx([0.2, 0.4, 0.4], abs=1e-9)
    # again with (.5, .25, .1): .1, .1, .04; sum .24
    belief.update(np.log([0.5, 0.25, 0.1]))
    assert belief.probability == pytest.approx([10 / 24, 10 / 24, 4 / 24], abs=1e-9)
    assert belief.most_likely == "a"


def test_forgetting_mixes_with_the_prior_before_bayes() -> None:
    # belief (.8, .2), forgetting .5 -> (.65, .35); likelihood (1, 2) -> .65, .70 -> /1.35
    belief = TypeBelief(["a", "b"], 0.0, 1e-12)
    belief.update(np.log([0.8, 0.2]))
    belief.forgetting = 0.5
    belief.update(np.log([1.0, 2.0]))
    assert belief.probability == pytest.approx([0.65 / 1.35, 0.70 / 1.35], abs=1e-9)


def test_floor_lets_a_type_come_back_after_overwhelming_evidence() -> None:
    belief = TypeBelief(["a", "b"], 0.0, 1e-3)
    for _ in range(100):
        belief.update([0.0, -1000.0])
    assert belief.probability[1] == pytest.approx(1e-3, rel=1e-2)
    for _ in range(3):
        belief.update([-5.0, 0.0])
    assert belief.most_likely == "b"


def test_entropy_is_log_n_when_ignorant_and_near_zero_when_certain() -> None:
    belief = TypeBelief(list("abcd"), 0.0, 1e-9)
    assert belief.entropy == pytest.approx(np.log(4))
    belief.update([0.0, -99.0, -99.0, -99.0])
    assert belief.entropy < 1e-6
    belief.reset()
    assert belief.entropy == pytest.approx(np.log(4))


@settings(max_examples=200, deadline=None)
@given(
    evidence=st.lists(
        st.lists(st.floats(-1e6, 0.0), min_size=4, max_size=4), min_size=1, max_size=20
    ),
    forgetting=st.floats(0.0, 0.9),
    floor=st.floats(1e-9, 0.2),
)
def test_belief_sums_to_one_and_never_holds_a_zero(evidence, forgetting, floor) -> None:
    belief = TypeBelief(list("abcd"), forgetting, floor)
    for row in evidence:
        belief.update(row)
        assert belief.probability.sum() == pytest.approx(1.0, abs=1e-12)
        assert (belief.probability >= floor * (1 - 1e-9)).all()
        assert 0.0 <= belief.entropy <= np.log(4) + 1e-12


@settings(max_examples=50, deadline=None)
@given(row=st.permutations([-1.0, -2.5, -7.0, 0.0]))
def test_belief_does_not_depend_on_the_order_of_the_types(row) -> None:
    names = [f"t{value}" for value in row]
    belief = TypeBelief(names, 0.1, 1e-3)
    belief.update(row)
    reference = TypeBelief(sorted(names), 0.1, 1e-3)
    reference.update([row[names.index(name)] for name in sorted(names)])
    for name in names:
        mine = belief.probability[names.index(name)]
        assert mine == pytest.approx(reference.probability[sorted(names).index(name)])


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_evidence_that_is_not_finite_is_refused_by_type_and_changes_nothing(value) -> None:
    belief = TypeBelief(["a", "b"])
    before = belief.probability
    with pytest.raises(ValueError, match="'b' is not finite"):
        belief.update([0.0, value])
    assert (belief.probability == before).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([], 0.1, 0.1), "distinct names"),
        ((["a", "a"], 0.1, 0.1), "distinct names"),
        ((["a", "b"], 1.0, 0.1), "forgetting"),
        ((["a", "b"], float("nan"), 0.1), "forgetting"),
        ((["a", "b"], 0.1, 0.5), "floor"),
        ((["a", "b"], 0.1, 0.0), "floor"),
        ((["a", "b"], 0.1, 0.1, [0.5, 0.6]), "prior"),
    ],
)
def test_impossible_settings_are_refused(arguments, message) -> None:
    with pytest.raises(ValueError, match=message):
        TypeBelief(*arguments)
