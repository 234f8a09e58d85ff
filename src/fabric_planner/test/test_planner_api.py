# SPDX-License-Identifier: BSD-3-Clause
"""Search from step to step, its tree, and evaluation, from Python."""

import threading
from pathlib import Path

import numpy as np
import pytest

import fabric_planner as fp

TIGER = Path(__file__).parent / "models" / "tiger.pomdpx"
AMPLE = 1e6  # s: a deadline that never ends a search


def tiger() -> fp.Pomdp:
    return fp.load_pomdpx(TIGER)


def planner(nodes: int = 200, gap: float = 0.0) -> fp.OnlinePlanner:
    return fp.OnlinePlanner(tiger(), fp.PlannerOptions(AMPLE, gap, nodes))


def test_the_tree_is_a_list_of_dicts_that_name_their_parents():
    search = planner()
    assert search.tree() == []
    decision = search.decide([0.5, 0.5])
    tree = search.tree(max_depth=2)
    root, first = tree[0], tree[1]
    assert root["kind"] == "belief" and root["parent"] == -1
    assert root["lower"] == decision.lower_bound and root["expanded"] == decision.nodes
    assert first["kind"] == "action" and first["parent"] == 0
    for entry in tree[1:]:
        parent = tree[entry["parent"]]
        assert parent["kind"] != entry["kind"]
        assert entry["reach"] == pytest.approx(parent["reach"] * entry["probability"])
        assert entry["lower"] <= entry["upper"]
    assert max(entry["depth"] for entry in tree) == 2
    assert all(entry["reach"] >= 0.5 for entry in search.tree(4, min_probability=0.5))


def test_a_decision_goes_on_after_advance_and_begins_again_after_reset():
    search, belief_filter = planner(), fp.BeliefFilter(tiger())
    first = search.decide(belief_filter.belief)
    belief_filter.update(first.action, 0)
    search.advance(first.action, 0)
    assert search.decide(belief_filter.belief).kept_nodes > 0
    search.reset()
    assert search.decide(belief_filter.belief).kept_nodes == 0
    with pytest.raises(IndexError, match="observation 9"):
        search.advance(0, 9)


def test_a_quickly_prepared_planner_keeps_its_promises():
    options = fp.PlannerOptions(AMPLE, 1e-3, 5000, preparation=fp.Preparation.QUICK)
    decision = fp.OnlinePlanner(tiger(), options).decide([0.5, 0.5])
    assert decision.lower_bound <= 19.3714 <= decision.upper_bound + 1e-3


def test_a_planner_searches_between_the_bounds_of_a_solution():
    model = tiger()
    solution = fp.solve(model, time=0.2)
    search = fp.OnlinePlanner(
        model, fp.PlannerOptions(AMPLE, 0.0, 0), lower=solution.lower, upper=solution.upper
    )
    decision = search.decide([0.5, 0.5])
    assert decision.lower_bound == pytest.approx(solution.lower.value([0.5, 0.5]))
    assert decision.upper_bound >= decision.lower_bound
    with pytest.raises(fp.ModelError, match="lower bound is of shape"):
        fp.OnlinePlanner(model, lower=fp.AlphaVectors(np.zeros((1, 5)), [0]))


def test_evaluate_takes_planners_vectors_and_functions():
    model = tiger()
    policies = [
        planner(nodes=20),
        fp.AlphaVectors(fp.qmdp(model), list(range(model.n_actions))),
        lambda belief: 0,
    ]
    ours, qmdp, listening = (fp.evaluate(model, p, episodes=50, seed=3) for p in policies)
    assert ours.cv == pytest.approx(19.3713, abs=0.05)
    assert listening.cv == pytest.approx(-20.0, abs=4.5 * listening.cv_standard_error)
    assert ours.cv > qmdp.cv - 0.05
    assert ours.decisions == 50 * 270 and ours.decision_time > 0.0
    assert "cv 19.3" in repr(ours)


def test_evaluate_refuses_what_is_no_policy_for_the_model():
    model = tiger()
    with pytest.raises(TypeError, match="a policy is"):
        fp.evaluate(model, 3)
    with pytest.raises(fp.ModelError, match="vectors of 5 entries for 2 states"):
        fp.evaluate(model, fp.AlphaVectors(np.zeros((1, 5)), [0]))
    with pytest.raises(IndexError, match="action 7"):
        fp.evaluate(model, lambda belief: 7, episodes=2)
    with pytest.raises(ZeroDivisionError):
        fp.evaluate(model, lambda belief: 1 // 0, episodes=2)


def test_simulate_repeats_with_its_seed():
    model, search = tiger(), planner(nodes=20)
    one, again = (fp.simulate(model, search, steps=30, seed=4) for _ in range(2))
    assert len(one) == 30
    assert [s.state for s in one] == [s.state for s in again]
    assert all(step.reward == model.reward[step.action, step.state] for step in one)
    assert one[0].belief.tolist() == [0.5, 0.5]


def test_other_threads_run_during_an_evaluation():
    model, search, done = tiger(), planner(nodes=500), threading.Event()
    turns = []

    def evaluate() -> None:
        fp.evaluate(model, search, episodes=40)
        done.set()

    thread = threading.Thread(target=evaluate)
    thread.start()
    while not done.wait(0.001):
        turns.append(len(turns))
    thread.join()
    assert len(turns) > 3
