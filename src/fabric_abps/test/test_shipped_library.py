# SPDX-License-Identifier: BSD-3-Clause
"""The shipped libraries: twenty sound policies that want the same and behave differently."""

import re
from pathlib import Path

import numpy as np
import pytest

import fabric_planner as fp
from fabric_abps import Library

PACKAGE = Path(__file__).parent.parent
MODELS = PACKAGE.parent / "fabric_planner" / "models"
SHIPPED = sorted(path.parent.name for path in (PACKAGE / "library").glob("*/library.yaml"))
WRITTEN = ("proactive", "reactive", "none")
LARGEST = 3e6  # bytes of a folder


@pytest.fixture(scope="module", params=SHIPPED)
def library(request) -> Library:
    return Library.load(PACKAGE / "library" / request.param, request.param)


def drawn(library: Library) -> list[str]:
    return [name for name in library.names if name not in WRITTEN]


def test_there_are_twenty_with_the_written_ones_first(library) -> None:
    assert len(library.names) == 20
    assert library.names[:2] == ["proactive", "reactive"]


def test_a_new_person_starts_with_the_policy_whose_card_tells_of_most_reward(library) -> None:
    earned = {policy.name: _reward(policy.card.read_text("utf-8")) for policy in library.policies}
    assert earned[library.base] == max(earned.values())


def _reward(card: str) -> float:
    found = re.search(r"\| reward, points \| (-?[\d.]+) \|", card)
    assert found is not None, card
    return float(found[1])


def test_written_policies_are_the_robots_of_the_planner(library) -> None:
    for name in set(WRITTEN) & set(library.names):
        source = MODELS / ("none.pomdpx" if name == "none" else f"{library.scenario}_{name}.pomdpx")
        for end in (".pomdpx", ".obs.yaml"):
            copy = library[name].path.with_suffix("").with_suffix(end)
            assert copy.read_bytes() == source.with_suffix("").with_suffix(end).read_bytes()


def test_structure_and_reward_are_those_of_the_base_model(library) -> None:
    base = library["proactive"].path
    model, written = fp.load(base), re.compile("<RewardFunction>.*</RewardFunction>", re.DOTALL)
    for name in drawn(library):
        path = library[name].path
        assert written.search(path.read_text())[0] == written.search(base.read_text())[0]
        found = fp.load(path)
        assert ((found.transition > 0.0) == (model.transition > 0.0)).all()
        assert ((found.observation > 0.0) == (model.observation > 0.0)).all()
        assert np.allclose(found.transition.sum(axis=2), 1.0, atol=1e-12)
        assert (found.terminal == model.terminal).all()


def test_the_checker_says_no_more_than_of_the_base_model(library) -> None:
    known = {finding.sentence for finding in fp.lint(fp.load(library["proactive"].path))}
    for name in drawn(library):
        fresh = {f.sentence for f in fp.lint(fp.load(library[name].path)) if f.severity != "info"}
        assert fresh <= known


def test_all_are_solved_and_no_two_decide_alike(library) -> None:
    """At beliefs on the edges between two states, where policies begin to differ."""
    decisions = set()
    for name in drawn(library):
        model, vectors = fp.load(library[name].path), library[name].vectors()
        rng = np.random.default_rng(101)
        beliefs = rng.dirichlet(np.full(model.n_states, 0.15), size=400)
        decisions.add(tuple(vectors.action(belief) for belief in beliefs))
    assert len(decisions) == len(drawn(library))


def test_each_has_a_card_that_names_it_and_the_folder_is_small(library) -> None:
    for policy in library.policies:
        assert f"# {policy.name}\n" in policy.card.read_text()
    files = list(library.index.parent.iterdir())
    assert sum(path.stat().st_size for path in files) < LARGEST
