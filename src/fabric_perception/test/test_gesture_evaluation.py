# SPDX-License-Identifier: BSD-3-Clause
"""Figures by hand-worked streams, recordings from bags, the plain reference classifier."""

import itertools
from types import SimpleNamespace as Message

import numpy as np
import pytest

from fabric_perception.gestures import bags
from fabric_perception.gestures.bags import RecordingError, read_folder, read_labels
from fabric_perception.gestures.evaluation import confusion_table, score_stream
from fabric_perception.gestures.features import FeatureSettings
from fabric_perception.gestures.recording import GRASP, IDLE, UNLABELLED, WARN, Recording
from fabric_perception.gestures.reference import NearestWindow, warped_distances
from fabric_perception.gestures.streams import Stream, segments


def judged(labels, found, told=(), lag=0):
    """The score of a stream at 10 Hz."""
    t = 0.1 * np.arange(len(labels))
    told = np.isin(np.arange(len(t)), told)
    return score_stream(t, np.array(labels), np.eye(4)[found], told, lag)


def test_frames_are_counted_with_and_without_those_after_a_change():
    labels = [IDLE] * 10 + [GRASP] * 10
    found = [IDLE] * 13 + [GRASP] * 6 + [IDLE]
    figures = judged(labels, found).figures()
    assert figures["accuracy"] == pytest.approx(16 / 20)
    assert figures["accuracy_settled"] == pytest.approx(14 / 15)


def test_what_is_said_later_is_judged_by_its_moment_and_delays_by_when_it_is_said():
    labels = [IDLE] * 10 + [GRASP] * 10
    score = judged(labels, [IDLE] * 13 + [GRASP] * 7, lag=3)
    assert score.figures()["accuracy"] == 1.0
    assert score.confusion.sum() == 17
    assert score.figures()["accuracy_at_once"] == pytest.approx(17 / 20)
    assert score.delays == pytest.approx((0.4,))
    nothing = judged(labels, labels, lag=50)
    assert nothing.confusion.sum() == 0
    assert nothing.figures()["accuracy_at_once"] == 1.0


def test_a_change_is_seen_when_two_readings_in_a_row_say_so():
    labels = [IDLE] * 10 + [GRASP] * 10 + [IDLE] * 10
    found = [IDLE] * 11 + [GRASP, IDLE] + [GRASP] * 17
    score = judged(labels, found)
    assert score.delays == pytest.approx((0.4, np.inf))
    assert score.figures()["changes_never_seen"] == 0.5


def test_a_warning_told_in_time_is_recalled_and_one_without_a_reason_is_false():
    labels = [IDLE] * 10 + [WARN] * 10 + [IDLE] * 20 + [WARN] * 10 + [IDLE] * 10
    score = judged(labels, labels, told=(5, 13, 30))
    assert (score.warnings, score.recalled, score.false_warnings) == (2, 1, 2)
    assert score.warning_delays == pytest.approx((0.3, np.inf))
    assert score.figures()["false_warnings_in_10_min"] == pytest.approx(2 * 600 / 6.0)


def test_what_nobody_labelled_is_not_judged():
    score = judged([IDLE] * 10 + [UNLABELLED] * 10, [IDLE] * 10 + [WARN] * 10, told=(15,))
    assert score.figures()["accuracy"] == 1.0
    assert score.false_warnings == 0
    assert score.labelled == pytest.approx(1.0)


def test_scores_add_up():
    one, other = judged([IDLE] * 10, [IDLE] * 10), judged([GRASP] * 10, [IDLE] * 10)
    assert (one + other).figures()["accuracy"] == 0.5
    assert "| **grasp** | 100.0 | 0.0 | 0.0 | 0.0 | 10 |" in confusion_table(other.confusion)


def test_streams_of_unequal_lengths_are_refused():
    with pytest.raises(ValueError, match="3 times, 2 labels"):
        score_stream(np.arange(3.0), np.zeros(2, int), np.ones((3, 4)), np.zeros(3, bool))


# -- streams and recordings -----------------------------------------------------------------------


def test_stretches_leave_out_what_was_not_seen_and_keep_their_context():
    frames = np.array([[0.0], [1.0], [np.nan], [3.0], [4.0], [5.0]])
    found = segments(Stream(frames, ["a", "a", "a", "a", "b", "b"]), (0, 1))
    assert [label for label, _ in found] == ["a", "b"]
    assert found[0][1].tolist() == [[0.0, 0.0], [1.0, 0.0], [3.0, 1.0]]
    assert found[1][1].tolist() == [[4.0, 3.0], [5.0, 4.0]]


def test_a_stream_that_is_damaged_is_refused():
    with pytest.raises(ValueError, match="are no stream"):
        segments(Stream(np.zeros((3, 1)), ["a"]), (0,))
    with pytest.raises(ValueError, match="stream frame 1 feature 0 is inf"):
        segments(Stream(np.array([[0.0], [np.inf]]), ["a", "a"]), (0,))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"t": np.array([0.0, 1.0, 1.0])}, r"t\[2\] is 1.0 s, not after"),
        ({"t": np.array([0.0, np.nan, 1.0])}, r"t\[1\] is nan"),
        ({"hand": np.array([[0.0, np.nan, 0.0]] * 3)}, r"hand\[0\] is"),
        ({"target": np.zeros((2, 3))}, "target has shape"),
        ({"labels": np.array([0, 4, 0])}, r"labels\[1\] is 4"),
        ({"t": np.array([])}, "is empty"),
    ],
)
def test_a_recording_that_is_damaged_is_refused_by_row_and_value(change, words):
    fields = {"person": "P1", "t": np.arange(3.0), "hand": np.zeros((3, 3))}
    fields |= {"target": np.zeros((3, 3)), "labels": np.zeros(3, int), **change}
    with pytest.raises(ValueError, match=words):
        Recording(**fields)


def test_a_table_of_labels_is_read(tmp_path):
    table = tmp_path / "P01_a.csv"
    table.write_text("start,end,label\n0,1.5,idle\n1.5,2,warn\n")
    assert read_labels(table) == [(0.0, 1.5, IDLE), (1.5, 2.0, WARN)]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "first line must be"),
        ("begin,end,label\n", "first line must be"),
        ("start,end,label\n0,1,idle\n0.5,2,warn\n", "line 3: 0.5 to 2.0 s does not follow on 1.0"),
        ("start,end,label\n0,1,jump\n", "line 2: label is 'jump'"),
        ("start,end,label\n0,nan,idle\n", "line 2"),
        ("start,end,label\n0,x,idle\n", "line 2: start and end are '0', 'x'"),
        ("start,end,label\n0,1\n", "line 2: has 2 columns"),
    ],
)
def test_a_table_that_is_wrong_is_refused_by_its_line(tmp_path, text, words):
    table = tmp_path / "P01.csv"
    table.write_text(text)
    with pytest.raises(RecordingError, match=words):
        read_labels(table)


def test_a_folder_without_bags_or_a_bag_without_a_table_is_refused(tmp_path):
    with pytest.raises(RecordingError, match="holds no .bag"):
        read_folder(tmp_path, FeatureSettings())
    (tmp_path / "P01.bag").write_bytes(b"")
    with pytest.raises(RecordingError, match="P01.csv: cannot be read"):
        read_folder(tmp_path, FeatureSettings())


def test_labels_count_from_the_first_message_of_the_hand(tmp_path, monkeypatch):
    (tmp_path / "P07_b.bag").write_bytes(b"")
    (tmp_path / "P07_b.csv").write_text("start,end,label\n0.5,1,warn\n")
    messages = [("/human/hand", hand(10.0 + 0.1 * k, 0.1 * k), None) for k in range(20)]
    monkeypatch.setattr(bags, "_messages", lambda path: itertools.chain(messages))
    (one,) = read_folder(tmp_path, FeatureSettings())
    assert one.person == "P07"
    assert np.flatnonzero(one.labels == WARN).tolist() == [5, 6, 7, 8, 9]
    assert one.hand[3] == pytest.approx((0.3, 0.0, 0.0))


def hand(t, x):
    stamp = Message(to_sec=lambda: t)
    place = Message(x=x, y=0.0, z=0.0)
    return Message(header=Message(stamp=stamp), visible=True, position=place)


# -- the plain reference --------------------------------------------------------------------------


def test_warped_distances_are_those_of_the_textbook():
    rng = np.random.default_rng(101)
    window, windows = rng.standard_normal((6, 2)), rng.standard_normal((5, 6, 2))
    expected = [_dtw(window, other) for other in windows]
    assert warped_distances(window, windows) == pytest.approx(expected)


def _dtw(a, b):
    cost = {(0, 0): 0.0}
    for i, j in itertools.product(range(1, len(a) + 1), range(1, len(b) + 1)):
        if abs(i - j) <= 3:
            before = [cost.get(key, np.inf) for key in ((i - 1, j), (i, j - 1), (i - 1, j - 1))]
            cost[i, j] = ((a[i - 1] - b[j - 1]) ** 2).sum() + min(before)
    return cost[len(a), len(b)]


def test_the_nearest_window_decides():
    windows = np.array([np.zeros((4, 1)), np.ones((4, 1))])
    nearest = NearestWindow(windows, [7, 9])
    assert nearest.predict(np.full((4, 1), 0.8)) == 9
    with pytest.raises(ValueError, match="window has 3 frames"):
        nearest.predict(np.zeros((3, 1)))
