# SPDX-License-Identifier: BSD-3-Clause
"""Recognition in a stream: people not trained on, warnings, lost hands, damaged input, files."""

from types import SimpleNamespace as Message

import numpy as np
import pytest
import yaml
from gesture_data import PICK_POINT, REST, STOP, recording

from fabric_msgs.msg import Cube
from fabric_perception.gestures.classifier import GmmHmmClassifier
from fabric_perception.gestures.model_file import ModelFileError, TrainedGestures, load, save
from fabric_perception.gestures.recogniser import (
    GestureRecogniser,
    RecogniserParameters,
    object_of_interest,
)
from fabric_perception.gestures.recording import Recording
from fabric_perception.gestures.settings import ContextSettings, HmmSettings
from fabric_perception.gestures.workshop import Recipe, Watched, judge, leave_one_person_out, train

QUICK = Recipe(
    hmm=HmmSettings(states=4, mixtures=1, iterations=6),
    context=ContextSettings(lags=(0, 2, 4), dimensions=8),
)


@pytest.fixture(scope="module")
def trained():
    watched = [Watched.of(recording(f"P{i}", i), QUICK.features) for i in range(101, 107)]
    model = train(watched, QUICK, 101).model
    return TrainedGestures(model, QUICK.score, QUICK.features, {"trained": "today"})


def recogniser(trained, **parameters):
    return GestureRecogniser(trained, RecogniserParameters(**parameters))


def percepts(seer, t, hands):
    """The percepts of hands, 0.1 s apart from time t on."""
    return [seer.on_hand(t + 0.1 * k, hand) for k, hand in enumerate(hands)]


def raising(frames=12):
    """From the resting place up against the robot, and held there."""
    steps = np.minimum(1.0, np.arange(frames) / 6.0)[:, None]
    return REST + steps * (STOP - REST)


def test_people_not_trained_on_are_followed():
    watched = [Watched.of(recording(f"P{i}", i), QUICK.features) for i in range(111, 115)]
    lines = []
    scores = leave_one_person_out(watched, QUICK, 101, lines.append)
    figures = scores[""].figures()
    assert len(lines) == 4
    assert figures["accuracy_settled"] > 0.85  # from three people, with a small model
    assert figures["warning_recall"] >= 0.75
    assert figures["change_seen_median_s"] < 1.0


def test_leaving_a_person_out_needs_two():
    with pytest.raises(ValueError, match="there is 1 person"):
        leave_one_person_out([Watched.of(recording("P1", 101), QUICK.features)], QUICK, 101)


def test_the_node_sees_what_the_evaluation_sees(trained):
    one = recording("P9", 109)
    seer = recogniser(trained)
    percepts_of = [
        seer.on_hand(t, None if np.isnan(hand[0]) else hand)
        for t, hand in zip(one.t, one.hand, strict=True)
    ]
    posteriors = np.array([p.posterior for p in percepts_of if p is not None])
    still = Recording("P9", one.t, one.hand, np.full_like(one.hand, np.nan), one.labels)
    watched = Watched.of(still, trained.features)
    classifier = GmmHmmClassifier.of(trained.model, trained.score)
    lag, _ = RecogniserParameters().lags(QUICK.features.period)
    stream = classifier.streaming(lag=lag)
    assert posteriors == pytest.approx(stream.run(watched.frames), abs=1e-9)
    assert judge(classifier, watched, QUICK).warnings == 4


def test_a_warning_is_told_once_and_soon(trained):
    seer = recogniser(trained)
    percepts(seer, 0.0, [REST] * 20)
    told = [p.warning for p in percepts(seer, 2.0, [*raising(), *[STOP] * 30])]
    assert told.count(True) == 1
    assert told.index(True) < 12


def test_a_resting_hand_is_idle_and_says_how_old_the_evidence_is(trained):
    percept = percepts(recogniser(trained), 0.0, [REST] * 20)[-1]
    assert percept.posterior.argmax() == 0
    assert percept.detected and not percept.warning
    assert percept.evidence_age == 0.0


def test_a_lost_hand_ages_then_the_person_is_gone_and_forgotten(trained):
    seer = recogniser(trained, lost_after=0.5)
    percepts(seer, 0.0, [*[REST] * 20, *raising(10)])
    lost = percepts(seer, 3.0, [None] * 12)
    assert lost[0].detected
    assert lost[3].evidence_age == pytest.approx(0.4)
    assert not lost[-1].detected
    assert lost[-1].posterior == pytest.approx([0.25] * 4)
    again = percepts(seer, 5.0, [REST] * 15)[-1]
    assert again.detected and again.posterior.argmax() == 0


def test_a_silent_tracker_is_told_and_never_a_new_warning(trained):
    seer = recogniser(trained, silence=0.5)
    assert seer.on_silence(10.0) is None
    percepts(seer, 0.0, [REST] * 5)
    assert seer.on_silence(0.8) is None
    old = seer.on_silence(1.4)
    assert old.evidence_age == pytest.approx(1.0)
    assert not old.warning


@pytest.mark.parametrize(
    ("t", "hand", "words"),
    [
        (0.4, REST, "not after 0.4 s"),
        (0.2, REST, "not after 0.4 s"),
        (np.nan, REST, "t is nan"),
        (0.5, (np.nan, 0.0, 0.0), "hand is"),
        (0.5, (0.0, 0.0), "hand is"),
    ],
)
def test_a_stale_or_damaged_hand_is_refused_and_changes_nothing(trained, t, hand, words):
    seer, twin = recogniser(trained), recogniser(trained)
    percepts(seer, 0.0, [REST] * 5)
    percepts(twin, 0.0, [REST] * 5)
    with pytest.raises(ValueError, match=words):
        seer.on_hand(t, hand)
    assert seer.on_hand(0.5, REST).posterior == pytest.approx(twin.on_hand(0.5, REST).posterior)


def test_time_that_jumps_far_back_begins_anew(trained):
    seer = recogniser(trained)
    percepts(seer, 100.0, raising())
    first = seer.on_hand(1.0, REST)
    assert first.posterior == pytest.approx(recogniser(trained).on_hand(1.0, REST).posterior)


def cube(number, where, x):
    place = Message(x=x, y=0.0, z=0.1)
    return Message(id=number, where=where, pose=Message(position=place))


def test_the_object_of_interest_is_in_the_hand_else_next_to_the_pick_point():
    belt = [cube(1, Cube.WHERE_BELT, 0.1), cube(2, Cube.WHERE_PICK_POINT, 0.28)]
    away = [cube(3, Cube.WHERE_CONTAINER, 0.281), cube(4, Cube.WHERE_ROBOT, 0.281)]
    held = cube(5, Cube.WHERE_PERSON, 0.5)
    assert object_of_interest([*belt, *away], PICK_POINT)[0] == 0.28
    assert object_of_interest([*belt, held], PICK_POINT)[0] == 0.5
    assert object_of_interest(away, PICK_POINT) is None
    with pytest.raises(ValueError, match="cube 6 is at"):
        object_of_interest([cube(6, Cube.WHERE_BELT, np.nan)], PICK_POINT)


def test_old_cubes_are_not_used(trained):
    seer, blind = recogniser(trained), recogniser(trained)
    seer.on_cubes(0.0, [cube(1, Cube.WHERE_PERSON, 0.9)])
    late = [percepts(one, 5.0, [REST] * 3)[-1].posterior for one in (seer, blind)]
    assert late[0] == pytest.approx(late[1])


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"warning_threshold": 1.0}, "warning_threshold is 1.0"),
        ({"warning_threshold": 0.4}, "warning_rearm is 0.5"),
        ({"lost_after": float("nan")}, "lost_after is nan"),
        ({"look_back": -0.1}, "look_back is -0.1"),
    ],
)
def test_parameters_out_of_range_are_named(parameters, words):
    with pytest.raises(ValueError, match=words):
        RecogniserParameters(**parameters)


# -- files --------------------------------------------------------------------------------------


def test_a_saved_model_recognises_as_before_and_keeps_its_card(trained, tmp_path):
    save(tmp_path / "g.yaml", trained)
    again = load(tmp_path / "g.yaml")
    hands = [*[REST] * 10, *raising()]
    before = percepts(recogniser(trained), 0.0, hands)[-1].posterior
    assert percepts(recogniser(again), 0.0, hands)[-1].posterior == pytest.approx(before)
    assert again.card["trained"] == "today"
    assert again.features == trained.features


def test_a_card_of_other_arrays_is_refused(trained, tmp_path):
    save(tmp_path / "g.yaml", trained)
    (tmp_path / "g.npz").write_bytes(b"something else")
    with pytest.raises(ModelFileError, match="g.npz: is not the file that g.yaml speaks of"):
        load(tmp_path / "g.yaml")


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("format", "other", "no card of a gesture model"),
        ("version", 2, "version is 2; 1 is read"),
        ("labels", ["idle"], "must be"),
        ("garbage", 9, "garbage is 9"),
        ("score", {"evidence_weight": -1.0}, "evidence_weight is -1.0"),
        ("score", {"weight": 1.0}, "unknown parameter 'weight'"),
        ("features", {"kind": "thesis"}, "features are 3, the model has 10"),
        ("arrays", "g.npz", "it must name a file"),
        ("arrays", {"file": "none.npz", "sha256": ""}, "none.npz: cannot be read"),
    ],
)
def test_a_card_that_is_wrong_is_refused_by_its_entry(trained, tmp_path, key, value, words):
    save(tmp_path / "g.yaml", trained)
    card = yaml.safe_load((tmp_path / "g.yaml").read_text())
    (tmp_path / "g.yaml").write_text(yaml.safe_dump({**card, key: value}))
    with pytest.raises(ModelFileError, match=words):
        load(tmp_path / "g.yaml")


@pytest.mark.parametrize("name", ["means", "follow", "prior", "variances", "owner", "lags"])
def test_a_model_with_a_number_that_makes_no_sense_is_refused_by_its_array(trained, name):
    values = {**vars(trained.model)}
    spoilt = np.array(values[name], dtype=float)
    spoilt.flat[0] = np.nan
    with pytest.raises(ValueError, match=name):
        type(trained.model)(**{**values, name: spoilt})


@pytest.mark.parametrize(
    ("text", "words"), [("[", "is not YAML"), ("- 1", "no card"), ("", "no card")]
)
def test_what_is_no_card_is_refused(tmp_path, text, words):
    (tmp_path / "g.yaml").write_text(text)
    with pytest.raises(ModelFileError, match=words):
        load(tmp_path / "g.yaml")
    with pytest.raises(ModelFileError, match="cannot be read"):
        load(tmp_path / "none.yaml")
