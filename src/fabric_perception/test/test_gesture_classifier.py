# SPDX-License-Identifier: BSD-3-Clause
"""The generic classifier: training on difficult classes, scores, refusals."""

import numpy as np
import pytest
from gesture_data import MAKERS, NAMES, labelled, ramp, still, wave
from hmmlearn.hmm import GMMHMM

from fabric_perception.gestures.classifier import GmmHmmClassifier
from fabric_perception.gestures.hmm_training import train_class
from fabric_perception.gestures.scoring import StreamingScore, class_scores
from fabric_perception.gestures.settings import PLAIN, ContextSettings, HmmSettings, ScoreSettings
from fabric_perception.gestures.streams import Stream

SMALL = HmmSettings(states=4, mixtures=1, iterations=5)


@pytest.fixture(scope="module")
def trained():
    sequences, labels = labelled(np.random.default_rng(101))
    return GmmHmmClassifier(SMALL, PLAIN, seed=101).fit(sequences, labels, NAMES)


@pytest.mark.parametrize("context", [PLAIN, ContextSettings(lags=(0, 2), dimensions=2)])
@pytest.mark.parametrize("hmm", [SMALL, HmmSettings(states=3, mixtures=2, left_right=False)])
def test_every_class_is_told_from_the_others_even_one_that_never_moves(context, hmm):
    rng = np.random.default_rng(102)
    classifier = GmmHmmClassifier(hmm, context, seed=101).fit(*labelled(rng), NAMES)
    for name in NAMES:
        found = [classifier.predict(MAKERS[name](rng, 30)) for _ in range(10)]
        assert found.count(name) >= 9


def test_a_posterior_is_a_distribution_over_the_classes_in_their_order(trained):
    posterior = trained.predict_proba(ramp(np.random.default_rng(103)))
    assert trained.labels == NAMES
    assert posterior.shape == (3,)
    assert posterior.sum() == pytest.approx(1.0)
    assert posterior.argmax() == NAMES.index("ramp")


def test_training_twice_gives_the_same_and_another_seed_another_model():
    sequences, labels = labelled(np.random.default_rng(101), each=3)
    models = [
        GmmHmmClassifier(SMALL, PLAIN, seed=seed).fit(sequences, labels, NAMES).model
        for seed in (101, 101, 102)
    ]
    assert np.array_equal(models[0].means, models[1].means)
    assert not np.array_equal(models[0].means, models[2].means)


def test_the_likelihood_of_training_never_falls_and_variances_keep_above_the_floor():
    rng = np.random.default_rng(104)
    hmm = HmmSettings(states=4, mixtures=2, variance_floor=0.1)
    for make in (still, ramp, wave):
        found = train_class("it", [make(rng) for _ in range(8)], hmm, rng)
        assert np.all(np.diff(found.history) > -1e-6)
        assert found.variances.min() >= 0.1
        assert np.all(np.isfinite(found.means))


def test_a_left_right_model_never_goes_back():
    rng = np.random.default_rng(105)
    found = train_class("ramp", [ramp(rng) for _ in range(8)], SMALL, rng)
    assert np.array_equal(found.follow, np.triu(found.follow))
    assert found.start.tolist() == [1.0, 0.0, 0.0, 0.0]


def test_the_score_of_a_class_is_that_of_hmmlearn(trained):
    sequence = ramp(np.random.default_rng(106), 30)
    model = trained.model
    for k in range(3):
        mine = model.owner == k
        reference = GMMHMM(4, 1, init_params="")
        reference.startprob_ = model.start[mine]
        reference.transmat_ = model.follow[np.ix_(mine, mine)]
        reference.weights_, reference.means_ = model.weights[mine], model.means[mine]
        reference.covars_ = model.variances[mine]
        z = (sequence - model.centre) @ model.projection
        per_frame = reference.score(z) / len(z)
        if per_frame > -700.0:  # further away sums underflow, there as here
            assert class_scores(model, sequence)[k] == pytest.approx(per_frame, rel=1e-6)


JOINT = ScoreSettings(evidence_weight=0.5, interruption=0.01, late_entry=0.1)


def test_a_streaming_step_is_bayes_rule_over_all_states(trained):
    stream = StreamingScore(trained.model, JOINT)
    frames = ramp(np.random.default_rng(107), 6)
    for frame, alpha in zip(frames, _forward(trained.model, frames), strict=True):
        assert stream.step(frame) == pytest.approx(_classes(trained.model, alpha), abs=1e-9)


def test_a_lag_tells_of_the_frame_so_long_ago_in_the_light_of_those_since(trained):
    model, lag = trained.model, 3
    frames = np.concatenate([ramp(np.random.default_rng(108), 5), np.full((3, 2), 0.5)])
    stream = StreamingScore(model, JOINT, lag=lag)
    told = [stream.step(frame) for frame in frames]
    joint, alphas = _joint(model), _forward(model, frames)
    later = np.ones(len(model.owner))
    for frame in frames[: -lag - 1 : -1]:
        later = joint @ (_evidence(model, frame) * later)
    then = alphas[-lag - 1] * later
    assert told[-1] == pytest.approx(_classes(model, then / then.sum()), abs=1e-9)
    assert told[0] == pytest.approx(_classes(model, alphas[0]), abs=1e-9)
    assert stream.states == pytest.approx(alphas[-1], abs=1e-9)


def test_a_lag_survives_frames_without_anything_and_ends_at_a_reset(trained):
    stream = trained.streaming(lag=4)
    first = stream.step([0.5, 0.5])
    posteriors = [stream.step(frame) for frame in ([0.5, 0.5], None, None, [1e200, 0.0], None)]
    assert np.array(posteriors).sum(axis=1) == pytest.approx(np.ones(5))
    stream.reset()
    assert stream.step([0.5, 0.5]) == pytest.approx(first)
    with pytest.raises(ValueError, match="lag is -1 frames"):
        trained.streaming(lag=-1)


def _joint(model):
    """(N, N) transitions of all classes' states, one by one."""
    n, size = len(model.owner), np.bincount(model.owner)
    joint = np.zeros((n, n))
    for i in range(n):
        end = max(model.leave[i], JOINT.interruption)
        for j in range(n):
            entry = (1 - JOINT.late_entry) * model.start[j] + JOINT.late_entry / size[
                model.owner[j]
            ]
            begins = model.next_class[model.owner[i], model.owner[j]] * entry
            joint[i, j] = (1 - end) * model.follow[i, j] + end * begins
    return joint


def _evidence(model, frame):
    """(N,) density of a frame to the power of its weight."""
    z = (frame - model.centre) @ model.projection
    gauss = np.exp(-0.5 * (z - model.means) ** 2 / model.variances)
    density = (gauss / np.sqrt(2 * np.pi * model.variances)).prod(axis=2)
    return (model.weights * density).sum(axis=1) ** JOINT.evidence_weight


def _forward(model, frames):
    """The states (N,) after each of the frames."""
    size, joint = np.bincount(model.owner), _joint(model)
    alpha = model.prior[model.owner] / size[model.owner]
    rows = []
    for frame in frames:
        alpha = (alpha @ joint) * _evidence(model, frame)
        alpha = alpha / alpha.sum()
        rows.append(alpha)
    return rows


def _classes(model, alpha):
    return [alpha[model.owner == k].sum() for k in range(model.n_classes)]


def test_a_stream_follows_changes_and_frames_without_anything_leave_a_distribution(trained):
    rng = np.random.default_rng(108)
    stream = trained.streaming()
    parts = [still(rng, 30), wave(rng, 30), still(rng, 30)]
    last = [stream.run(part)[-1].argmax() for part in parts]
    assert last == [0, 2, 0]
    blind = [stream.step(None) for _ in range(200)]
    assert np.array(blind).sum(axis=1) == pytest.approx(np.ones(200))
    assert blind[-1].max() < 0.9


def test_reset_forgets_what_was_seen(trained):
    stream = trained.streaming()
    first = stream.step([0.5, 0.5])
    stream.run(wave(np.random.default_rng(109)))
    stream.reset()
    assert stream.step([0.5, 0.5]) == pytest.approx(first)


def test_what_is_like_nothing_becomes_garbage():
    rng = np.random.default_rng(110)
    sequences, labels = labelled(rng)
    classifier = GmmHmmClassifier(SMALL, PLAIN, garbage="still", seed=101).fit(sequences, labels)
    far = np.c_[np.full(30, -4.0), np.full(30, 4.0)] + rng.standard_normal((30, 2))
    assert classifier.predict(far) == "still"
    assert classifier.predict(ramp(rng)) == "ramp"


def test_frames_far_beyond_everything_are_scored_all_the_same(trained):
    posterior = trained.predict_proba(np.full((20, 2), 1e200))
    assert np.all(np.isfinite(posterior))
    assert np.all(np.isfinite(trained.streaming().run(np.full((20, 2), -1e200))))


def test_streams_teach_what_follows_on_what():
    rng = np.random.default_rng(111)
    order = ("still", "ramp", "still", "wave") * 4
    parts = [MAKERS[name](rng, 20) for name in order]
    labels = [name for name in order for _ in range(20)]
    stream = Stream(np.concatenate(parts), labels)
    model = GmmHmmClassifier(SMALL, PLAIN, seed=101).fit_streams([stream] * 3, NAMES).model
    assert model.next_class[1].argmax() == 0  # after a ramp comes stillness
    assert model.next_class[1, 2] < 0.1


@pytest.mark.parametrize(
    ("sequence", "words"),
    [
        ([[1.0, np.nan]], "frame 0 feature 1 is nan"),
        ([[1.0, 2.0], [np.inf, 0.0]], "frame 1 feature 0 is inf"),
        ([[1.0]], "has 1 features a frame; the model has 2"),
        (np.empty((0, 2)), "is empty"),
        ([1.0, 2.0], r"shape \(2,\)"),
        ([["a", "b"]], "is not a table of numbers"),
        (None, "shape"),
    ],
)
def test_a_damaged_sequence_is_refused_by_frame_and_value(trained, sequence, words):
    with pytest.raises(ValueError, match=words):
        trained.predict_proba(sequence)


def test_a_damaged_frame_is_refused_and_changes_nothing(trained):
    stream = trained.streaming()
    before = stream.step([0.5, 0.5])
    for frame in ([np.nan, 0.0], [1.0], [1.0, 2.0, 3.0], []):
        with pytest.raises(ValueError, match="frame"):
            stream.step(frame)
        assert np.array_equal(stream.posterior, before)


@pytest.mark.parametrize(
    ("sequences", "labels", "words"),
    [
        ([], [], "there are no sequences"),
        ([[[1.0]]], ["a", "b"], "1 sequences but 2 labels"),
        ([[[1.0]], [[1.0, 2.0]]], ["a", "a"], "sequence 1 has 2 features"),
        ([[[1.0]], [[np.nan]]], ["a", "a"], "sequence 1 frame 0 feature 0 is nan"),
        ([[[1.0]] * 2], ["a"], "class 'a' has 2 frames; 4 are needed"),
        ([np.empty((3, 0))], ["a"], "no features"),
    ],
)
def test_training_data_that_cannot_be_used_is_refused(sequences, labels, words):
    with pytest.raises(ValueError, match=words):
        GmmHmmClassifier(SMALL, PLAIN).fit(sequences, labels)


def test_a_class_without_sequences_or_an_unknown_label_is_named():
    sequences, labels = labelled(np.random.default_rng(112), each=2)
    with pytest.raises(ValueError, match="class 'jump' has no sequences"):
        GmmHmmClassifier(SMALL, PLAIN).fit(sequences, labels, (*NAMES, "jump"))
    with pytest.raises(ValueError, match="is 'wave'; the classes are still, ramp"):
        GmmHmmClassifier(SMALL, PLAIN).fit(sequences, labels, ("still", "ramp"))


def test_constant_sequences_in_every_class_still_give_finite_posteriors():
    sequences = [np.full((20, 3), value) for value in (0.0, 0.0, 1.0, 1.0)]
    for context in (PLAIN, ContextSettings(lags=(0, 1), dimensions=4)):
        classifier = GmmHmmClassifier(SMALL, context).fit(sequences, ["a", "a", "b", "b"])
        assert classifier.predict(np.full((10, 3), 1.0)) == "b"


def test_without_training_there_is_nothing_to_ask():
    with pytest.raises(ValueError, match="call fit first"):
        GmmHmmClassifier().predict([[1.0]])


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: HmmSettings(states=0), "states is 0"),
        (lambda: HmmSettings(mixtures=1.5), "mixtures is 1.5"),
        (lambda: HmmSettings(dither=float("nan")), "dither is nan"),
        (lambda: HmmSettings(left_right=1), "left_right is 1"),
        (lambda: ContextSettings(lags=(1, 2)), "lags are"),
        (lambda: ContextSettings(lags=(0, 0)), "lags are"),
        (lambda: ScoreSettings(evidence_weight=0.0), "evidence_weight is 0.0"),
    ],
)
def test_a_setting_out_of_its_range_is_named(make, words):
    with pytest.raises(ValueError, match=words):
        make()
