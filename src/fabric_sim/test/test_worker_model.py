# SPDX-License-Identifier: BSD-3-Clause
"""The worker's MDP: valid rows, smooth and monotone dials, history, refusals by name."""

import copy

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from worker_bench import LIBRARY, MIDDLING, PARAMETERS

from fabric_sim.character import CORNERS, Character, named_generator
from fabric_sim.worker_model import (
    ACTION_INDEX,
    STATE_INDEX,
    History,
    ModelLibrary,
    TransitionTables,
    conditioned,
    effective_character,
)
from fabric_sim.worker_parameters import (
    ACTIONS,
    STATES,
    WorkerParameterError,
    WorkerParameters,
    default_path,
)

dial = st.floats(0.0, 1.0)
characters = st.builds(Character, dial, dial, dial, dial)
histories = st.builds(History, *(st.floats(0.0, 500.0),) * 3)


def entry(character, state, action, following):
    T = LIBRARY.build(character).T
    return T[ACTION_INDEX[action], STATE_INDEX[state], STATE_INDEX[following]]


def now(character, state, action, following):
    now = LIBRARY.build(character).now
    return now[ACTION_INDEX[action], STATE_INDEX[state], STATE_INDEX[following]]


@settings(max_examples=200)
@given(characters, histories)
def test_rows_sum_to_one_whatever_the_dials_and_the_history(character, history):
    person = effective_character(character, history, PARAMETERS.history)
    model = LIBRARY.build(person)
    for T in (model.T, model.now):
        assert T.shape == (5, 12, 12)
        assert T.min() >= 0.0
        assert np.allclose(T.sum(axis=2), 1.0, atol=1e-12)
    assert np.isfinite(model.R).all()


def test_rows_sum_to_one_for_ten_thousand_random_people_and_histories():
    rng = named_generator(101, "people")
    tables = TransitionTables(PARAMETERS.model)
    for unwanted, work, practised in rng.exponential(30.0, (10_000, 3)):
        history = History(unwanted, work, practised)
        person = effective_character(Character(*rng.random(4)), history, PARAMETERS.history)
        T = tables.matrix(person)
        for rows in (T, conditioned(T)):
            assert rows.min() >= 0.0
            assert abs(rows.sum(axis=2) - 1.0).max() < 1e-12


@settings(max_examples=100)
@given(characters, st.sampled_from(["expertise", "stamina", "attention", "collaborativeness"]))
def test_transitions_and_rewards_change_smoothly_with_the_dials(character, name):
    value = getattr(character, name)
    near = character.with_dials(**{name: min(1.0, value + 1e-4)})
    one, other = LIBRARY.build(character), LIBRARY.build(near)
    # Steep only where a power below 1 starts from 0.
    assert np.abs(one.T - other.T).max() < 1e-3
    assert np.abs(one.R - other.R).max() < 1e-2


def test_success_and_failure_are_absorbing_and_pay_nothing_more():
    model = LIBRARY.build(MIDDLING)
    for end in ("success", "failure"):
        s = STATE_INDEX[end]
        assert (model.T[:, s, s] == 1.0).all()
        assert (model.now[:, s, s] == 1.0).all()
        assert (model.R[:, s] == 0.0).all()


def test_in_a_running_task_success_comes_from_grasps_and_interference_from_robots():
    for character in CORNERS.values():
        now = LIBRARY.build(character).now
        others = [a for a in range(len(ACTIONS)) if ACTIONS[a] != "grasp"]
        living = [s for s in range(len(STATES)) if STATES[s] not in ("success", "failure")]
        for a in others:
            assert now[a][living, STATE_INDEX["success"]].max() == 0.0
        assert now[:, living, STATE_INDEX["failure"]].max() == 0.0
        for state in ("task_assigned", "evaluating", "no_attention", "tired", "failed_to_grasp"):
            assert now[:, STATE_INDEX[state], STATE_INDEX["robot_interfered"]].max() == 0.0


grid = np.linspace(0.0, 1.0, 11)


@given(characters)
@settings(max_examples=50)
def test_expertise_raises_the_success_of_every_grasp(character):
    for state in ("evaluating", "failed_to_grasp", "tired"):
        chances = [now(character.with_dials(expertise=e), state, "grasp", "success") for e in grid]
        assert np.all(np.diff(chances) > 0.0)


@given(characters)
@settings(max_examples=50)
def test_less_stamina_tires_more(character):
    for state, action in (
        ("task_assigned", "idle"),
        ("evaluating", "idle"),
        ("evaluating", "look_around"),
        ("failed_to_grasp", "idle"),
        ("tired", "idle"),
    ):
        chances = [now(character.with_dials(stamina=s), state, action, "tired") for s in grid]
        assert np.all(np.diff(chances) <= 1e-12)
        assert chances[0] > chances[-1]


@given(characters)
@settings(max_examples=50)
def test_less_attention_distracts_more(character):
    for state in ("task_assigned", "evaluating", "no_attention"):
        for action in ("idle", "look_around"):
            chances = [
                entry(character.with_dials(attention=a), state, action, "no_attention")
                for a in grid
            ]
            assert np.all(np.diff(chances) <= 1e-12)
            assert chances[0] > chances[-1]


@given(characters)
@settings(max_examples=50)
def test_less_collaborativeness_refuses_more(character):
    refusals = [LIBRARY.build(character.with_dials(collaborativeness=c)).refusal for c in grid]
    assert np.all(np.diff(refusals) < 0.0)
    assert refusals[-1] < 0.15
    assert refusals[0] > 0.45


@pytest.mark.parametrize("name", sorted(CORNERS))
def test_the_policy_keeps_to_what_makes_sense_in_a_state(name):
    model = LIBRARY.build(CORNERS[name])
    assert np.allclose(model.policy.sum(axis=1), 1.0)
    assert model.policy.T[~model.allowed].max() == 0.0
    walk = model.policy[:, ACTION_INDEX["walk_away"]]
    assert set(np.flatnonzero(walk)) == {STATE_INDEX["tired"]}
    assert model.policy[STATE_INDEX["warns_the_robot"], ACTION_INDEX["warn"]] == 1.0


def policy(character, state, action):
    return LIBRARY.build(character).policy[STATE_INDEX[state], ACTION_INDEX[action]]


def test_types_choose_differently():
    rested = Character.parse("expert_rested_attentive_collaborative")
    tired = rested.with_dials(stamina=0)
    distracted = rested.with_dials(attention=0)
    assert policy(rested, "evaluating", "grasp") > 0.8
    assert policy(tired, "tired", "walk_away") > policy(rested, "tired", "walk_away") + 0.3
    assert policy(distracted, "no_attention", "look_around") > 0.5
    assert policy(rested, "no_attention", "look_around") < 0.3


def test_interference_lowers_collaborativeness_and_only_that():
    p = PARAMETERS.history
    before = effective_character(MIDDLING, History(), p)
    annoyed = [effective_character(MIDDLING, History(unwanted=n), p) for n in (1, 3, 10, 100)]
    values = [before.collaborativeness] + [person.collaborativeness for person in annoyed]
    assert before == MIDDLING
    assert np.all(np.diff(values) < 0.0)
    assert all(person.dials[:3] == MIDDLING.dials[:3] for person in annoyed)
    # The direction survives in the model: more refusals, unlike with |P2 - P1|.
    refusals = [LIBRARY.build(person).refusal for person in [before, *annoyed]]
    assert np.all(np.diff(refusals) > 0.0)


def test_tasks_done_tire_bore_and_strain_up_to_the_horizon():
    p = PARAMETERS.history
    days = [effective_character(MIDDLING, History(work=k), p) for k in (0, 10, 40, 80)]
    for name in ("expertise", "stamina", "attention"):
        values = [getattr(day, name) for day in days]
        assert values[0] > values[1] > values[2] == values[3]
    tiring = [now(day, "evaluating", "idle", "tired") for day in days]
    assert tiring[0] < tiring[1] < tiring[2]


def test_practice_raises_expertise_slowly():
    p = PARAMETERS.history
    values = [
        effective_character(MIDDLING, History(practised=k), p).expertise for k in (0, 10, 100, 1e6)
    ]
    assert np.all(np.diff(values) > 0.0)
    assert values[1] - values[0] < 0.01
    assert values[-1] < 0.6


def test_models_are_shared_on_a_grid_and_policies_solved_once():
    calls = []

    def solver(T, R, discount):
        calls.append(discount)
        return type("Solution", (), {"q": R})

    library = ModelLibrary(PARAMETERS.model, solver)
    one = library.model(Character(0.501, 0.5, 0.5, 0.5))
    assert library.model(Character(0.5, 0.499, 0.5, 0.5)) is one
    assert calls == []
    assert one.policy is one.policy
    assert calls == [PARAMETERS.model.discount]


CONTENT = yaml.safe_load(default_path().read_text())


def changed(path, value):
    content = copy.deepcopy(CONTENT)
    place = content
    for key in path[:-1]:
        place = place[key]
    if value is None:
        del place[path[-1]]
    else:
        place[path[-1]] = value
    return content


ROW = ("model", "transitions", "evaluating", "grasp")


@pytest.mark.parametrize(
    ("path", "value", "named"),
    [
        (("history", "horizon"), None, ["history.horizon", "missing"]),
        (("history", "horizons"), 1.0, ["history.horizons", "unknown"]),
        (("history", "horizon"), float("nan"), ["history.horizon", "nan"]),
        (("history", "horizon"), -1.0, ["history.horizon", "-1"]),
        (("model", "discount"), 1.0, ["model.discount", "1"]),
        (("model", "temperature"), float("inf"), ["model.temperature", "inf"]),
        (("model", "temperature"), "hot", ["model.temperature", "'hot'"]),
        (("timing", "sorting", "idle", "mean"), 100.0, ["timing.sorting.idle", "100"]),
        (("truth", "stage_one"), 1.5, ["truth.stage_one", "1.5"]),
        (("memory", "known"), 2.0, ["memory.known", "2"]),
        (("responses", "pointing"), {"flying": 0.5}, ["pointing", "'flying'"]),
        (("memory", "taught"), -0.1, ["memory.taught", "-0.1"]),
        (("memory", "taught"), None, ["memory.taught", "missing"]),
        (("history", "work", "sorting"), None, ["history.work.sorting", "missing"]),
        (("responses", "person_counts", "sorting"), None, ["person_counts.sorting", "missing"]),
        (("responses", "origin_counts", "inspection"), None, ["origin_counts.insp", "missing"]),
        (("responses", "own_credit", "sorting"), None, ["own_credit.sorting", "missing"]),
        (("responses", "own_credit", "packing"), 1.0, ["own_credit", "'packing'"]),
        (("responses", "person_counts", "sorting"), -1.0, ["person_counts.sorting", "-1"]),
        (("responses", "origin_counts", "sorting"), float("nan"), ["origin_counts", "nan"]),
    ],
)
def test_a_bad_parameter_is_refused_by_name(path, value, named):
    with pytest.raises(WorkerParameterError) as refusal:
        WorkerParameters.of(changed(path, value))
    for word in named:
        assert word in str(refusal.value)


@pytest.mark.parametrize(
    ("path", "value", "named"),
    [
        ((*ROW, "base"), {"success": 0.9}, ["evaluating.grasp.base", "0.9"]),
        ((*ROW, "base"), {"succes": 1.0}, ["evaluating.grasp.base", "'succes'"]),
        ((*ROW, "base"), {"success": 1.5, "failure": -0.5}, ["base.failure", "negative"]),
        ((*ROW, "base"), {"success": float("nan")}, ["base.success", "nan"]),
        ((*ROW, "pulls"), [{"by": "luck", "most": 1, "to": {"success": 1}}], ["by", "'luck'"]),
        (
            (*ROW, "pulls"),
            [{"by": "expertise", "most": 1.2, "to": {"success": 1}}],
            ["pulls[0].most", "1.2"],
        ),
        ((*ROW, "pulls"), [{"by": "expertise"}], ["pulls[0]", "needs by, most, to"]),
        (ROW, None, ["evaluating.grasp", "missing"]),
        (("model", "transitions", "evaluating", "idle"), None, ["evaluating.idle", "missing"]),
        (("model", "allowed", "tired"), [], ["allowed.tired"]),
        (("model", "allowed", "tired"), ["fly"], ["allowed.tired", "'fly'"]),
    ],
)
def test_a_bad_table_is_refused_by_name(path, value, named):
    parameters = WorkerParameters.of(changed(path, value))
    with pytest.raises(WorkerParameterError) as refusal:
        TransitionTables(parameters.model)
    for word in named:
        assert word in str(refusal.value)


def test_bad_rewards_are_refused_by_name():
    parameters = WorkerParameters.of(changed(("model", "rewards", "next", "succes"), {"base": 1}))
    with pytest.raises(WorkerParameterError, match="'succes'"):
        ModelLibrary(parameters.model)
    parameters = WorkerParameters.of(changed(("model", "rewards", "misplaced"), float("nan")))
    with pytest.raises(WorkerParameterError, match="misplaced.*nan"):
        ModelLibrary(parameters.model)


def test_a_missing_file_is_refused_by_name(tmp_path):
    with pytest.raises(WorkerParameterError, match=r"nothing\.yaml"):
        WorkerParameters.load(tmp_path / "nothing.yaml")
