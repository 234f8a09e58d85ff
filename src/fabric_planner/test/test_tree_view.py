# SPDX-License-Identifier: BSD-3-Clause
"""The search tree as text, nested dicts and a picture."""

import json
from pathlib import Path

import pytest

import fabric_planner as fp
from fabric_planner.tree_plot import ROWS, _pruned, write_tree_plot
from fabric_planner.tree_view import as_text, likeliest_path, nested

TIGER = Path(__file__).parent / "models" / "tiger.pomdpx"
PNG = b"\x89PNG\r\n\x1a\n"


def row(parent, action, observation, probability, lower, upper, expanded=0):
    return {
        "kind": "belief" if parent < 0 or observation >= 0 else "action",
        "parent": parent, "action": action, "observation": observation,
        "probability": probability, "lower": lower, "upper": upper, "expanded": expanded,
    }  # fmt: skip


ROOT = row(-1, -1, -1, 1.0, 4.0, 6.0, 2)
LISTEN, OPEN = row(0, 0, -1, 1.0, 4.0, 6.0), row(0, 1, -1, 1.0, -45.0, 2.0)
HEARD_RIGHT, HEARD_LEFT = row(1, 0, 1, 0.25, 3.0, 5.0), row(1, 0, 0, 0.75, 5.0, 7.0, 1)
AGAIN = row(4, 2, -1, 1.0, 5.0, 7.0)


@pytest.fixture
def model():
    return fp.load_pomdpx(TIGER)


@pytest.fixture
def tree(model):
    return nested([ROOT, LISTEN, OPEN, HEARD_RIGHT, HEARD_LEFT, AGAIN], model)


@pytest.fixture
def searched(model):
    planner = fp.OnlinePlanner(model, fp.PlannerOptions(1e6, 1e-3, 40))
    decision = planner.decide(model.initial_belief)
    return decision, nested(planner.tree(max_depth=3), model)


def test_rows_become_beliefs_and_actions_with_names(tree):
    assert [action["action"] for action in tree["actions"]] == ["listen", "open_left"]
    listen = tree["actions"][0]
    assert listen["best"] and not tree["actions"][1]["best"]
    assert [belief["observation"] for belief in listen["outcomes"]] == ["left", "right"]
    assert listen["outcomes"][0]["actions"][0]["action"] == "open_right"


def test_the_likeliest_path_follows_best_actions_and_observations(tree):
    assert [belief["lower"] for belief in likeliest_path(tree)] == [4.0, 5.0]


def test_the_text_marks_the_path_and_tells_bounds_and_probabilities(tree):
    assert as_text(tree, depth=2).splitlines() == [
        "root [4, 6]",
        "├─> listen    [4, 6]",
        "│   ├─> 0.750 left [5, 7]",
        "│   │   └─> open_right [5, 7]",
        "│   └─  0.250 right [3, 5]",
        "└─  open_left [-45, 2]",
    ]
    assert as_text(tree, depth=1).splitlines()[3] == "│   └─  0.250 right [3, 5]"


def test_a_root_that_was_not_expanded_is_told(model):
    assert as_text(nested([ROOT], model)) == "root [4, 6], not expanded"


def test_the_tree_of_a_search_agrees_with_its_decision(searched, model):
    decision, tree = searched
    best = next(action for action in tree["actions"] if action["best"])
    assert best["action"] == model.actions[decision.action]
    assert best["lower"] == pytest.approx(decision.value)
    assert tree["lower"] == pytest.approx(decision.lower_bound)
    assert tree["upper"] == pytest.approx(decision.upper_bound)
    for action in tree["actions"]:
        assert sum(belief["probability"] for belief in action["outcomes"]) == pytest.approx(1.0)


def test_the_nested_tree_can_be_written_as_json(searched):
    assert json.loads(json.dumps(searched[1])) == searched[1]


def test_the_picture_is_written_and_holds_no_more_rows_than_fit(searched, tmp_path):
    write_tree_plot(searched[1], tmp_path / "tree.png", "tiger")
    assert (tmp_path / "tree.png").read_bytes().startswith(PNG)
    assert 3 < _pruned(searched[1]).leaves() <= ROWS


def test_the_picture_of_a_root_alone_is_written(model, tmp_path):
    write_tree_plot(nested([ROOT], model), tmp_path / "root.png", "nothing searched")
    assert (tmp_path / "root.png").read_bytes().startswith(PNG)
