# SPDX-License-Identifier: BSD-3-Clause
"""Candidates: the dials turn what they say and keep the structure; the reward is never touched."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

import fabric_planner as fp
from fabric_abps import candidates
from fabric_abps.candidates import BaseModel, CandidateError
from fabric_abps.dials import DIALS, Setting

MODELS = Path(__file__).parents[2] / "fabric_planner" / "models"
SCENARIOS = ("inspection", "sorting")
DRAWS = [Setting.draw(np.random.default_rng(seed)) for seed in range(101, 131)]


def base_of(scenario: str) -> BaseModel:
    return BaseModel(MODELS / f"{scenario}_proactive.pomdpx")


def model_of(base: BaseModel, setting: Setting, folder: Path) -> fp.Pomdp:
    path = folder / "candidate.pomdpx"
    path.write_text(base.text(setting, "A candidate."))
    return fp.load(path)


def turned(**factors: float) -> Setting:
    return Setting({dial.name: factors.get(dial.name, 1.0) for dial in DIALS})


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_ways_neither_appear_nor_vanish_and_rows_sum_to_one(scenario, tmp_path) -> None:
    base = base_of(scenario)
    for setting in DRAWS:
        model = model_of(base, setting, tmp_path)
        for new, old in (
            (model.transition, base.model.transition),
            (model.observation, base.model.observation),
        ):
            assert ((new > 0.0) == (old > 0.0)).all()
            assert np.allclose(new.sum(axis=2), 1.0, atol=1e-12)
            assert (new[new > 0.0] >= 1e-4).all()
        assert (model.terminal == base.model.terminal).all()
        assert (model.initial_belief == base.model.initial_belief).all()


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_the_reward_is_copied_as_it_is_written(scenario) -> None:
    base = base_of(scenario)
    written = re.search("<RewardFunction>.*</RewardFunction>", base.path.read_text(), re.DOTALL)
    for setting in DRAWS:
        assert written.group() in base.text(setting, "A candidate.")


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_all_dials_at_one_give_the_base_model(scenario, tmp_path) -> None:
    base = base_of(scenario)
    model = model_of(base, Setting.base(), tmp_path)
    assert np.allclose(model.transition, base.model.transition, atol=1e-5)
    assert np.allclose(model.observation, base.model.observation, atol=6e-4)
    assert np.allclose(model.reward, base.model.reward, atol=1e-4)


def test_a_dial_multiplies_the_odds_of_its_ways_and_of_no_others() -> None:
    """Row 0.6 0.3 0.1, the last way three times as likely: 0.6 0.3 0.3 over 1.2."""
    states = ["task_assigned_to_human", "may_be_tired", "may_be_distracted"]
    T = np.array([[[0.6, 0.3, 0.1], [0.5, 0.5, 0.0], [0.0, 0.0, 1.0]]])
    found = turned(wandering=3.0).transition(states, ["idle"], T)
    assert np.allclose(found[0, 0], [0.5, 0.25, 0.25])
    assert np.allclose(found[0, 1:], T[0, 1:])


def test_trust_makes_likely_symbols_likelier_and_doubt_levels_them() -> None:
    """Row .8 .2 to the power of two: .64 .04 over .68; to the power of one half: 2 to 1."""
    O = np.array([[[0.8, 0.2]]])  # noqa: E741
    assert np.allclose(turned(trust=2.0).observation(["a"], [False], O), [[[16 / 17, 1 / 17]]])
    assert np.allclose(turned(trust=0.5).observation(["a"], [False], O), [[[2 / 3, 1 / 3]]])


@pytest.mark.parametrize(("observability", "hidden"), [("mdp", 0.0), ("mixed", 1.0)])
def test_a_symbol_names_the_state_of_an_mdp_and_the_trouble_of_a_mixed_one(
    observability, hidden
) -> None:
    states = ["task_assigned_to_human", "may_be_tired", "may_be_distracted"]
    O = np.array([[[0.6, 0.2, 0.2], [0.2, 0.5, 0.3], [0.2, 0.3, 0.5]]])  # noqa: E741
    setting = Setting({dial.name: 1.0 for dial in DIALS}, observability)
    found = setting.observation(states, [False] * 3, O)[0]
    assert found[0, 0] > 0.97
    assert found[1:, 0].max() < 0.01
    assert (found[1, 2] > 0.3) == bool(hidden)


def test_draws_reach_both_ends_and_repeat_with_the_seed() -> None:
    assert Setting.draw(np.random.default_rng(101)) == DRAWS[0]
    assert {setting.observability for setting in DRAWS} == {"pomdp", "mixed", "mdp"}
    for dial in DIALS:
        values = [setting.factors[dial.name] for setting in DRAWS]
        assert dial.low <= min(values) < math.sqrt(dial.low)
        assert math.sqrt(dial.high) < max(values) <= dial.high


def test_a_draw_behaves_otherwise_than_the_base_model(tmp_path) -> None:
    """Fear of warnings: who expects to be refused five times as often does not take over."""
    base = base_of("inspection")
    belief = np.zeros(base.model.n_states)
    belief[base.model.state_index("may_be_tired")] = 1.0
    actions = {}
    for refusal in (0.2, 5.0):
        model = model_of(base, turned(refusal=refusal), tmp_path)
        actions[refusal] = model.actions[candidates.solve(model).action(belief)]
    assert actions[0.2] == "grasp"
    assert actions[5.0] != "grasp"


def test_the_checker_refuses_what_is_not_wrong_with_the_base_model(tmp_path) -> None:
    base = base_of("inspection")
    base.check(base.model, "the base model")
    path = tmp_path / "odd.pomdpx"
    path.write_text(base.path.read_text().replace(">-3<", ">3<"))
    with pytest.raises(CandidateError, match="odd: .*"):
        base.check(fp.load(path), "odd")


@pytest.mark.parametrize(
    ("factors", "more", "message"),
    [
        ({"refusal": 0.0}, {}, "dial refusal is 0.0; it must be positive"),
        ({"refusal": math.nan}, {}, "dial refusal is nan"),
        ({"refusal": math.inf}, {}, "dial refusal is inf"),
        ({}, {"observability": "clear"}, "observability is 'clear', none of pomdp"),
        ({}, {"jitter": math.nan}, "jitter is nan"),
        ({}, {"jitter": -0.1}, "jitter is -0.1"),
    ],
)
def test_a_bad_setting_is_refused_by_dial(factors, more, message) -> None:
    with pytest.raises(ValueError, match=message):
        Setting({dial.name: factors.get(dial.name, 1.0) for dial in DIALS}, **more)
    with pytest.raises(ValueError, match="factors must be of"):
        Setting({"refusal": 1.0})


def test_a_model_without_what_is_to_be_varied_is_refused_by_element() -> None:
    with pytest.raises(CandidateError, match="reactive.pomdpx: has 0 elements ObsFunction"):
        BaseModel(MODELS / "inspection_reactive.pomdpx")
