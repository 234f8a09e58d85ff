# SPDX-License-Identifier: BSD-3-Clause
"""The Python side of the planner core."""

import gc
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse

import fabric_planner as fp
from fabric_planner.bench_tabular import tiger
from fabric_planner.paths import shipped_models

TIGER = Path(__file__).parent / "models" / "tiger.pomdpx"
AMPLE = 1e6  # s: a deadline that never ends a search


def test_tables_have_the_shapes_promised():
    model = fp.load_pomdpx(TIGER)
    assert model.transition.shape == (3, 2, 2)
    assert model.observation.shape == (3, 2, 2)
    assert model.reward.shape == (3, 2)
    assert model.initial_belief.tolist() == [0.5, 0.5]
    assert model.terminal.dtype == bool and not model.terminal.any()
    assert (model.n_states, model.n_actions, model.n_observations) == (2, 3, 2)


def test_a_model_from_arrays_equals_the_one_from_the_file():
    ours, file = tiger(), fp.load_pomdpx(str(TIGER))
    for name in ("transition", "observation", "reward", "initial_belief"):
        np.testing.assert_array_equal(getattr(ours, name), getattr(file, name))


def test_reward_and_initial_belief_are_read_only_views_that_keep_the_model_alive():
    model = tiger()
    for name in ("reward", "initial_belief"):
        view = getattr(model, name)
        assert np.shares_memory(view, getattr(model, name)), name
        assert not view.flags.writeable and not view.flags.owndata, name
        with pytest.raises(ValueError, match="read-only"):
            view[...] = 7.0
    reward, belief = model.reward, model.initial_belief
    del model
    gc.collect()
    assert reward.max() == 10.0 and belief.tolist() == [0.5, 0.5]


def test_other_arrays_handed_out_are_copies():
    model = fp.load_pomdpx(TIGER)
    belief_filter = fp.BeliefFilter(model)
    for array in (model.transition, model.observation, belief_filter.belief):
        array[...] = 7.0
    assert model.transition.max() == model.observation[1:].max() * 2 == 1.0
    assert belief_filter.belief.sum() == 1.0


def test_sparse_tables_are_the_dense_ones_without_zeros():
    model = fp.load_pomdpx(shipped_models()[0])
    for action in range(model.n_actions):
        transition, observation = model.transition_sparse(action), model.observation_sparse(action)
        assert scipy.sparse.isspmatrix_csr(transition)
        assert scipy.sparse.isspmatrix_csc(observation)
        np.testing.assert_array_equal(transition.toarray(), model.transition[action])
        np.testing.assert_array_equal(observation.toarray(), model.observation[action])
        assert (transition.data != 0.0).all() and (observation.data != 0.0).all()
    with pytest.raises(IndexError, match="action 99"):
        model.transition_sparse(99)


def from_tables(model, transition, observation):
    return fp.Pomdp(
        model.states, model.actions, model.observations, transition, observation, model.reward,
        model.discount, model.initial_belief,
    )  # fmt: skip


@pytest.mark.parametrize("made", [scipy.sparse.csr_matrix, scipy.sparse.coo_matrix])
def test_a_model_from_sparse_tables_equals_the_dense_one(made):
    model = fp.load_pomdpx(shipped_models()[0])
    ours = from_tables(
        model, [made(t) for t in model.transition], [made(o) for o in model.observation]
    )
    np.testing.assert_array_equal(ours.transition, model.transition)
    np.testing.assert_array_equal(ours.observation, model.observation)


def test_bad_sparse_tables_are_refused_by_row_or_shape():
    model = tiger()
    rows = [scipy.sparse.csr_matrix(t) for t in model.transition]
    rows[2].data[0] = np.nan
    with pytest.raises(fp.ModelError, match=r"T\[open_right\] row left column left is NaN"):
        from_tables(model, rows, model.observation)
    with pytest.raises(fp.ModelError, match=r"T\[listen\] is 1 x 2, expected 2 x 2"):
        from_tables(model, [r[:1] for r in rows], model.observation)
    with pytest.raises(fp.ModelError, match="T is no array of numbers"):
        from_tables(model, "left", model.observation)


def test_model_error_is_a_value_error_that_names_the_place():
    model = tiger()
    transition = model.transition
    transition[1, 0] = [0.5, 0.43]
    with pytest.raises(fp.ModelError, match=r"T\[open_left\] row left sums to 0.93") as error:
        fp.Pomdp(
            model.states, model.actions, model.observations, transition, model.observation,
            model.reward, model.discount, model.initial_belief,
        )  # fmt: skip
    assert isinstance(error.value, ValueError)


def with_rewards(rewards):
    model = tiger()
    return fp.Pomdp(
        model.states, model.actions, model.observations, model.transition, model.observation,
        rewards, model.discount, model.initial_belief,
    )  # fmt: skip


def test_rewards_of_next_state_and_observation_are_kept_as_their_expectation():
    rng = np.random.default_rng(1)
    full = rng.normal(size=(3, 2, 2, 2))
    model = tiger()
    expected = np.einsum("asn,ano,asno->as", model.transition, model.observation, full)
    np.testing.assert_allclose(with_rewards(full).reward, expected, atol=1e-12)
    expected = np.einsum("asn,asn->as", model.transition, full[..., 0])
    np.testing.assert_allclose(with_rewards(full[..., 0]).reward, expected, atol=1e-12)


def test_bad_rewards_are_refused_by_place():
    with pytest.raises(fp.ModelError, match="R has 3 entries in dimension 3, expected 2"):
        with_rewards(np.zeros((3, 2, 2, 3)))
    with pytest.raises(fp.ModelError, match="R has 1 dimensions, expected 2, 3 or 4"):
        with_rewards(np.zeros(3))
    bad = np.zeros((3, 2, 2))
    bad[1, 1, 0] = np.nan
    with pytest.raises(fp.ModelError, match=r"R\[open_left\] at right is NaN"):
        with_rewards(bad)


def test_the_filter_says_when_it_recovered():
    model = fp.Pomdp(
        ["a", "b"], ["wait"], ["see_a", "see_b"], np.eye(2)[None], np.eye(2)[None],
        np.zeros((1, 2)), 0.9, [1.0, 0.0],
    )  # fmt: skip
    belief_filter = fp.BeliefFilter(model)
    assert belief_filter.update(0, 0) == fp.UpdateStatus.OK
    assert belief_filter.update(0, 1) == fp.UpdateStatus.RECOVERED
    assert belief_filter.belief.tolist() == [0.0, 1.0]
    assert belief_filter.recoveries == 1
    belief_filter.reset([0.5, 0.5])
    assert belief_filter.recoveries == 0
    assert belief_filter.update_many([0, 0], [1, 0]) == 1
    with pytest.raises(IndexError, match="action 5"):
        belief_filter.update(5, 0)


def test_threads_may_share_a_filter():
    belief_filter = fp.BeliefFilter(tiger())
    actions, observations = np.zeros(20_000, dtype=int), np.arange(20_000) % 2
    sums = []

    def work(many: bool) -> None:
        for _ in range(20):
            if many:
                belief_filter.update_many(actions, observations)
            else:
                belief_filter.update(1, 0)
                sums.append(belief_filter.belief.sum())

    threads = [threading.Thread(target=work, args=(i % 2 == 0,)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sums == pytest.approx([1.0] * 40, abs=1e-12)
    assert belief_filter.recoveries == 0


def test_mdp_from_arrays_and_from_a_model_agree():
    model = fp.load_pomdpx(TIGER)
    ours = fp.solve_mdp_arrays(model.transition, model.reward, model.discount)
    assert ours.value == pytest.approx([200.0, 200.0])
    assert ours.policy.tolist() == [2, 1]
    np.testing.assert_allclose(fp.solve_mdp(model).q, ours.q)


def test_bad_arrays_are_refused_by_row():
    with pytest.raises(fp.ModelError, match=r"T\[0\] row 1 sums to 0.5"):
        fp.solve_mdp_arrays([[[1.0, 0.0], [0.5, 0.0]]], [[0.0, 0.0]], 0.9)
    with pytest.raises(fp.ModelError, match="T has 2 dimensions"):
        fp.solve_mdp_arrays(np.eye(2), [[0.0, 0.0]], 0.9)


def test_bounds_are_ordered_at_the_initial_belief():
    for path in shipped_models():
        model = fp.load_pomdpx(path)
        bounds = (fp.blind_bound, fp.point_based_bound, fp.fast_informed_bound, fp.qmdp)
        values = [(bound(model) @ model.initial_belief).max() for bound in bounds]
        assert values == pytest.approx(sorted(values), abs=1e-9), path.name


def test_decision_on_tiger():
    planner = fp.OnlinePlanner(fp.load_pomdpx(TIGER), fp.PlannerOptions(deadline=AMPLE, gap=1e-3))
    decision = planner.decide([0.5, 0.5])
    assert decision.action == 0 and decision.ended_by == fp.EndedBy.GAP
    assert decision.value == pytest.approx(19.3713, abs=2e-3)
    assert decision.lower_bound <= decision.upper_bound <= decision.lower_bound + 1e-3
    assert not decision.fallback_used and not decision.deadline_missed


def test_every_shipped_model_loads_and_ends_for_good():
    paths = shipped_models()
    assert paths
    for path in paths:
        model = fp.load_pomdpx(path)
        ends = [s for s in model.states if s in ("global_success", "global_fail")]
        assert all(model.terminal[model.state_index(s)] for s in ends), path.name


def noise(n: int = 12) -> fp.Pomdp:
    """A model that takes long to solve."""
    rng = np.random.default_rng(1)
    return fp.Pomdp(
        [f"s{i}" for i in range(n)], ["a", "b"], [f"o{i}" for i in range(n)],
        rng.dirichlet(np.ones(n), (2, n)), rng.dirichlet(np.ones(n), (2, n)),
        rng.normal(size=(2, n)), 0.99, np.full(n, 1 / n),
    )  # fmt: skip


def search() -> bool:
    options = fp.PlannerOptions(deadline=0.5, gap=0.0, max_nodes=10**6)
    model = noise()
    decision = fp.OnlinePlanner(model, options).decide(model.initial_belief)
    return decision.ended_by == fp.EndedBy.DEADLINE


def solve() -> bool:
    return fp.solve(noise(), time=0.3, gap=0.0).gap > 0.0


@pytest.mark.parametrize("work", [search, solve])
def test_other_threads_run_while_the_core_works(work):
    started, answers = threading.Event(), []

    def run() -> None:
        started.set()
        answers.append(work())

    thread = threading.Thread(target=run)
    thread.start()
    started.wait()
    turns = 0
    while not answers:
        turns += 1
        thread.join(0.001)
    assert turns > 5
    assert answers[0]


def test_the_core_needs_no_ros():
    code = (
        "import sys\n"
        "for name in ('rospy', 'roscpp', 'rosbag', 'actionlib', 'tf', 'tf2_ros'):\n"
        "    sys.modules[name] = None\n"
        "import fabric_planner, fabric_planner.plan, fabric_planner.bench\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
