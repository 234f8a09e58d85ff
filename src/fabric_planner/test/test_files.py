# SPDX-License-Identifier: BSD-3-Clause
"""Models and policies in files, and what lint says of models, from Python."""

from pathlib import Path

import numpy as np
import pytest

import fabric_planner as fp

MODELS = Path(__file__).parent / "models"
TIGER = MODELS / "tiger.pomdpx"


def assert_equal_models(one, other):
    for name in ("states", "actions", "observations", "discount"):
        assert getattr(one, name) == getattr(other, name)
    for name in ("transition", "observation", "reward", "initial_belief"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_load_reads_every_format_whatever_the_ending(tmp_path):
    disguised = tmp_path / "tiger.txt"
    disguised.write_bytes(TIGER.read_bytes())
    models = [fp.load(TIGER), fp.load(str(MODELS / "tiger.pomdp")), fp.load(disguised)]
    models += [fp.load_pomdpx(TIGER), fp.load_pomdp(MODELS / "tiger.pomdp")]
    for model in models:
        assert model.name == "tiger"
        assert_equal_models(model, models[0])


def test_a_refused_file_names_itself_the_line_and_the_token(tmp_path):
    path = tmp_path / "bad.POMDP"
    path.write_text((MODELS / "tiger.pomdp").read_text().replace("0.85 0.15", "0.85 much"))
    with pytest.raises(fp.ModelError, match=r"bad\.POMDP: line 15: O\[listen\] row left: 'much'"):
        fp.load(path)
    with pytest.raises(fp.ModelError, match="no such file"):
        fp.load(tmp_path / "none.pomdpx")


def test_normalise_rescales_rows_of_both_formats(tmp_path):
    path = tmp_path / "tiger.pomdp"
    path.write_text((MODELS / "tiger.pomdp").read_text().replace("0.85 0.15", "0.85 0.2"))
    with pytest.raises(fp.ModelError, match=r"line 14: O\[listen\] row left sums to 1\.05"):
        fp.load(path)
    assert fp.load(path, normalise=True).observation[0, 0, 0] == pytest.approx(0.85 / 1.05)


def test_a_converted_model_is_the_same_model(tmp_path):
    model = fp.load(MODELS / "tiger.pomdp")
    fp.save_pomdpx(model, tmp_path / "tiger.pomdpx")
    assert_equal_models(fp.load(tmp_path / "tiger.pomdpx"), model)


def test_a_policy_survives_its_file_bit_by_bit(tmp_path):
    model = fp.load(TIGER)
    vectors = np.random.default_rng(3).normal(size=(5, 2)) * 1e3
    policy = fp.AlphaVectors(vectors, [0, 1, 2, 0, 1])
    fp.save_policy(policy, model, tmp_path / "tiger.policy")
    again = fp.load_policy(str(tmp_path / "tiger.policy"), model)
    np.testing.assert_array_equal(again.vectors, vectors)
    assert again.actions == [0, 1, 2, 0, 1]


def test_a_policy_for_another_model_is_refused(tmp_path):
    tiger, other = fp.load(TIGER), fp.load(MODELS.parents[1] / "models" / "none.pomdpx")
    path = tmp_path / "tiger.policy"
    fp.save_policy(fp.AlphaVectors([[0.0, 1.0]], [2]), tiger, path)
    with pytest.raises(fp.ModelError, match=r"tiger\.policy: line \d+: vectors of 2 numbers"):
        fp.load_policy(path, other)
    with pytest.raises(fp.ModelError, match="vectors of 2 numbers"):
        fp.save_policy(fp.AlphaVectors([[0.0, 1.0]], [2]), other, path)


def test_alpha_vectors_take_the_largest():
    policy = fp.AlphaVectors([[1.0, 2.0], [3.0, 0.0]], [0, 2])
    assert len(policy) == 2
    assert policy.value([0.5, 0.5]) == 1.5
    assert (policy.action([1.0, 0.0]), policy.action([0.0, 1.0])) == (2, 0)
    with pytest.raises(fp.ModelError, match="belief has 3 entries for vectors of 2"):
        policy.value([0.2, 0.3, 0.5])
    with pytest.raises(fp.ModelError, match="2 rows for 1 actions"):
        fp.AlphaVectors([[1.0, 2.0], [3.0, 0.0]], [0])
    with pytest.raises(fp.ModelError, match="finite"):
        fp.AlphaVectors([[1.0, np.nan]], [0])


def test_alpha_vectors_are_seen_without_a_copy_and_cannot_be_written():
    policy = fp.AlphaVectors([[1.0, 2.0], [3.0, 0.0]], [0, 2])
    vectors = policy.vectors
    assert np.shares_memory(vectors, policy.vectors)
    with pytest.raises(ValueError, match="read-only"):
        vectors[0, 0] = 7.0
    del policy
    assert vectors[1, 0] == 3.0  # the view keeps its owner alive


def test_lint_tells_kind_severity_places_and_a_sentence():
    silent = [f for f in fp.lint(fp.load(TIGER)) if f.kind == "silent_action"]
    assert [f.places for f in silent] == [["open_left"], ["open_right"]]
    assert silent[0].severity == "info"
    assert "open_left says nothing" in silent[0].sentence
