# SPDX-License-Identifier: BSD-3-Clause
"""Which bags go through perception first."""

import pytest
import rosbag
from std_msgs.msg import Header

from fabric_bringup import arguments, picture_bag


@pytest.fixture
def bag(tmp_path):
    def write(*topics: str) -> str:
        path = tmp_path / "some.bag"
        with rosbag.Bag(str(path), "w") as made:
            for topic in topics:
                made.write(topic, Header())
        return str(path)

    return write


def test_a_bag_with_a_picture_topic_goes_through_perception(bag):
    assert picture_bag.main(["pictures", bag("/head/camera/image_raw", "/observation")]) == 0
    assert picture_bag.main(["pictures", bag("/observation", "/human/head")]) == 1


def test_a_drivers_topic_counts_when_it_is_named(bag):
    path = bag("/camera/image_color")
    assert picture_bag.main(["pictures", path]) == 1
    words = ["policy:=reactive", "names:=cell/camera/rgb/image_raw=/camera/image_color"]
    assert picture_bag.main(["pictures", path, *words]) == 0


def test_observations_make_a_replay_of_decisions_possible(bag):
    assert picture_bag.main(["observations", bag("observation")]) == 0
    assert picture_bag.main(["observations", bag("/human/head")]) == 1


def test_what_is_no_bag_is_named(tmp_path, capsys):
    path = tmp_path / "broken.bag"
    path.write_text("no bag")
    assert picture_bag.main(["pictures", str(path)]) == 2
    assert "broken.bag" in capsys.readouterr().err


def test_words_of_a_replay_of_pictures_are_checked(bag, tmp_path):
    pose = tmp_path / "camera.yaml"
    pose.write_text("{}")
    words = [f"file:={bag('/x')}", f"out_dir:={tmp_path / 'out'}", f"camera_files:={pose}:{pose}"]
    assert arguments.parse("perceive", words)["camera_files"] == f"{pose}:{pose}"
    with pytest.raises(arguments.ArgumentError, match="camera_files:=.* is refused"):
        arguments.parse("perceive", [*words[:2], f"camera_files:={pose}:/nowhere.yaml"])


def test_names_that_are_none_are_told(bag, capsys):
    assert picture_bag.main(["pictures", bag("/x"), "names:=head/camera/image_raw"]) == 2
    assert "is no own=recorded" in capsys.readouterr().err
