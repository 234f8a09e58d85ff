# SPDX-License-Identifier: BSD-3-Clause
"""Recorded pictures through the perception nodes: what is played, when, and what is counted."""

from types import SimpleNamespace

import genpy
import pytest

from fabric_msgs.msg import HeadState, Heartbeat, HumanActivity, Progress
from fabric_perception import picture_replay
from fabric_perception.picture_replay import Books, Percepts, PictureReplayError, agreement

OURS = ["/cell/camera/rgb/image_raw", "/cell/camera/depth/image", "/human/head", "/task/state"]


def test_our_own_topics_are_found_in_whatever_namespace():
    chosen = picture_replay.inputs_of([f"/lab{t}" for t in OURS], {})
    assert chosen == {
        "/lab/cell/camera/rgb/image_raw": "cell/camera/rgb/image_raw",
        "/lab/cell/camera/depth/image": "cell/camera/depth/image",
        "/lab/task/state": "task/state",
    }


def test_what_perception_itself_tells_is_not_played():
    chosen = picture_replay.inputs_of([*OURS, "/human/activity", "/cell/cubes", "/observation"], {})
    assert set(chosen.values()) & set(picture_replay.OUTPUTS) == set()


def test_another_drivers_topics_are_played_under_our_names():
    names = picture_replay.parse_names(
        "cell/camera/rgb/image_raw=/camera/rgb/image_color, cell/camera/depth/image=camera/depth"
    )
    recorded = ["/camera/rgb/image_color", "/camera/depth", "/camera/ir/image"]
    assert picture_replay.inputs_of(recorded, names) == {
        "/camera/rgb/image_color": "cell/camera/rgb/image_raw",
        "/camera/depth": "cell/camera/depth/image",
    }


def test_a_named_topic_goes_before_our_own():
    names = {"camera/image": "head/camera/image_raw"}
    chosen = picture_replay.inputs_of(["/head/camera/image_raw", "/camera/image"], names)
    assert chosen == {"/camera/image": "head/camera/image_raw"}


def test_a_bag_without_pictures_or_with_two_of_a_kind_is_refused():
    assert not picture_replay.holds_pictures(["/observation", "/human/head"], {})
    with pytest.raises(PictureReplayError, match="holds no pictures: none of cell/camera"):
        picture_replay.inputs_of(["/task/state"], {})
    with pytest.raises(PictureReplayError, match="head/camera/image_raw is there twice: /b/head"):
        picture_replay.inputs_of(["/a/head/camera/image_raw", "/b/head/camera/image_raw"], {})


@pytest.mark.parametrize(
    "text", ["head/camera/image_raw", "human/head=/x", "cell/camera/depth/image="]
)
def test_names_that_are_none_are_refused(text):
    with pytest.raises(PictureReplayError, match="is no own=recorded"):
        picture_replay.parse_names(text)


def beat(node: str, handled=(), sent=()) -> Heartbeat:
    message = Heartbeat(node=node)
    message.handled = [Progress(topic, count, 0) for topic, count in handled]
    message.sent = [Progress(topic, count, links) for topic, count, links in sent]
    return message


def test_a_picture_is_done_when_everything_it_caused_is():
    books = Books(["head", "observation"])
    books.heard(beat("head", [("picture", 0)], [("human/head", 0, 2)]))
    books.heard(beat("observation", [("human/head", 0)]))
    books.sent("picture")
    assert books.behind() == ["head: picture 0 of 1"]
    books.heard(beat("head", [("picture", 1)], [("human/head", 1, 2)]))
    assert books.behind() == ["observation: human/head 0 of 1"]
    books.heard(beat("observation", [("human/head", 1)]))
    assert books.behind() == []
    assert books.published("human/head") == 1


def test_nothing_begins_before_all_nodes_are_there_and_connected():
    books = Books(["head", "observation"])
    assert books.missing() == ["head", "observation"]
    books.heard(beat("head", [("picture", 0)], [("human/head", 0, 1)]))
    books.heard(beat("somebody else"))
    assert books.missing() == ["observation"]
    books.heard(beat("observation", [("human/head", 0)]))
    assert books.missing() == ["head: human/head"]  # its reader is there, the replay is not
    books.heard(beat("head", [("picture", 0)], [("human/head", 0, 2)]))
    assert books.missing() == []


def heads(states, start=0.0) -> Percepts:
    found = Percepts()
    for number, state in enumerate(states):
        message = HeadState(visible=state is not None, looking_around=bool(state))
        message.header.stamp = genpy.Time.from_sec(start + 0.1 * number)
        found.take("human/head", message)
    return found


def test_looks_and_visibility_are_counted():
    told = heads([False, True, True, None, True, False, True, None]).summary()
    assert told["head_visible"] == 6 / 8
    assert told["looks"] == 2  # a loss inside a look does not make it two


def test_gestures_and_hands_are_counted():
    found = Percepts()
    for posterior in ([0.7, 0.1, 0.1, 0.1], [0.1, 0.1, 0.7, 0.1]):
        stamp = genpy.Time.from_sec(len(found.gestures))
        message = HumanActivity(posterior=posterior)
        message.header.stamp = stamp
        found.take("human/activity", message)
        hand = SimpleNamespace(header=message.header, visible=posterior[2] > 0.5)
        found.take("human/hand", hand)
    told = found.summary()
    assert told["gestures"] == {"idle": 0.5, "grasp": 0.0, "warn": 0.5, "other": 0.0}
    assert told["hand_visible"] == 0.5


def test_percepts_are_compared_with_the_recorded_ones_of_the_same_moment():
    recorded = heads([False, False, True, True])
    replayed = heads([False, True, True, None, True], start=0.01)
    assert agreement(replayed, recorded) == {"looking_around": 2 / 3}
    assert agreement(heads([True], start=50.0), recorded) == {}


def test_the_report_names_both_sides():
    summary = {
        "pictures": 3,
        "duration_s": 0.2,
        "wall_s": 1.0,
        "agreement": {"looking_around": 0.5},
    }
    summary |= {"replayed": heads([True]).summary(), "recorded": heads([False, None]).summary()}
    text = picture_replay.report(summary)
    assert "3 pictures of 0.2 s" in text
    assert any(line.split() == ["looks", "around", "1", "0"] for line in text.splitlines())
    assert "looking around agrees with the recording in 50.0 %" in text
