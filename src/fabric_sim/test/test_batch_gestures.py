# SPDX-License-Identifier: BSD-3-Clause
"""Simulated people for the gesture classifier, and the command that trains it."""

import numpy as np
import pytest

from fabric_perception.gestures.model_file import load
from fabric_perception.gestures.recording import GRASP, IDLE, OTHER, UNLABELLED, WARN
from fabric_sim import batch_gestures, batch_gestures_picture
from fabric_sim.batch_files import Files
from fabric_sim.batch_gestures_other import PLACES, excursion
from fabric_sim.batch_gestures_people import _as_seen, simulate_person
from fabric_sim.camera.manner import manner_of

WORK = 15.0  # s in each scenario


@pytest.fixture(scope="module")
def people():
    return [simulate_person(101, person, WORK) for person in (1, 2)]


def test_a_person_does_everything_that_is_to_be_told_apart(people):
    for meddled, helped in people:
        done = set(meddled.labels) | set(helped.labels)
        assert {IDLE, GRASP, OTHER} <= done
    assert any(WARN in one.labels for mine in people for one in mine)


def test_equal_seeds_give_equal_people_and_others_others(people):
    again = simulate_person(101, 1, WORK)
    assert np.array_equal(again[0].hand, people[0][0].hand, equal_nan=True)
    assert np.array_equal(again[0].labels, people[0][0].labels)
    other = simulate_person(102, 1, WORK)
    assert len(other[0].t) != len(again[0].t) or not np.array_equal(
        other[0].hand, again[0].hand, equal_nan=True
    )


def test_a_tracker_loses_some_frames_and_never_the_whole_hand(people):
    for mine in people:
        for one in mine:
            lost = np.isnan(one.hand[one.labels != UNLABELLED][:, 0]).mean()
            assert 0.02 < lost < 0.2


def test_a_wish_becomes_a_gesture_when_the_hand_moves():
    t = 0.1 * np.arange(30)
    hand = np.zeros((30, 3))
    hand[12:20, 0] = 0.1  # set out 0.2 s after the wish at frame 10, back at frame 20
    labels = np.array([IDLE] * 10 + [GRASP] * 12 + [IDLE] * 8)
    seen = _as_seen(t, hand, labels)
    assert np.flatnonzero(seen == GRASP).tolist() == list(range(12, 20))


@pytest.mark.parametrize("kind", list(PLACES))
def test_an_irrelevant_gesture_begins_and_ends_where_the_hand_rested(kind):
    home, rng = np.array([0.24, -0.16, 0.06]), np.random.default_rng(101)
    way = excursion(kind, home, manner_of(101, 1), rng, 5.0)
    assert way.at(5.0).p == pytest.approx(home)
    assert way.at(way.done_at).p == pytest.approx(home)
    farthest = max(np.linalg.norm(way.at(t).p - home) for t in np.arange(5.0, way.done_at, 0.05))
    assert farthest > 0.1


@pytest.mark.parametrize(
    ("word", "text"),
    [
        ("people:=1", "people:=1 is refused: it must be a whole number from 2"),
        ("seed:=-1", "seed:=-1 is refused"),
        ("compare:=maybe", "it must be true or false"),
        ("speed:=3", "unknown argument 'speed'"),
        ("nowhere", "'nowhere' is no folder"),
        ("cell_file:=none.yaml", "cell_file goes with a folder of bags"),
    ],
)
def test_a_bad_word_is_refused_with_2_by_its_name(capsys, word, text):
    assert batch_gestures.main([word]) == 2
    assert text in capsys.readouterr().err


def test_the_command_writes_a_model_with_its_card(people, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(batch_gestures, "simulate_person", lambda seed, n: people[n - 1])
    assert (
        batch_gestures.main(["people:=2", "seed:=101", "compare:=true", f"out_dir:={tmp_path}"])
        == 0
    )
    card = load(tmp_path / "gestures.yaml").card
    assert card["data"]["people"] == 2
    judged = card["leave_one_person_out"]
    assert judged["all"]["accuracy"] > 0.6
    assert set(judged) == {"all", *(one.situation for one in people[0])}
    assert "confusion" in judged["all"]
    assert set(card["comparison"]) >= {"default", "1-NN DTW over 1 s, default features"}
    told = capsys.readouterr().out
    assert "| **warn** |" in told
    assert "| thesis' three scalars, each frame alone |" in told
    picture = tmp_path / "gestures.png"
    assert batch_gestures_picture.main([str(tmp_path / "gestures.yaml"), str(picture)]) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_picture_of_nothing_is_refused(tmp_path, capsys):
    with pytest.raises(ValueError, match="no leave_one_person_out.all"):
        batch_gestures_picture.draw({}, tmp_path / "none.png")
    assert batch_gestures_picture.main([str(tmp_path / "none.yaml"), "none.png"]) == 2
    assert "none.yaml: cannot be read" in capsys.readouterr().err


def test_the_shipped_model_refers_to_the_places_of_the_cell():
    there = batch_gestures.places()
    features = load(None).features
    assert there.rest == pytest.approx(features.rest)
    assert there.pick_point == pytest.approx(features.pick_point)
    geometry = Files().cell().geometry
    assert there.rest == pytest.approx(geometry.person.to_cell(geometry.body.rest))


def test_bags_that_cannot_be_used_write_nothing(tmp_path, capsys):
    (tmp_path / "bags").mkdir()
    assert batch_gestures.main([str(tmp_path / "bags"), f"out_dir:={tmp_path}"]) == 2
    assert "holds no .bag" in capsys.readouterr().err
    assert not (tmp_path / "gestures.yaml").exists()
