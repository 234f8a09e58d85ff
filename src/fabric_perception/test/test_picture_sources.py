# SPDX-License-Identifier: BSD-3-Clause
"""Pictures from files; a camera of the computer stands behind a fake."""

import cv2
import numpy as np
import pytest

from fabric_perception import picture_sources
from fabric_perception.picture_sources import Device, SourceError, Wanted, open_source

PICTURES = [np.full((48, 64, 3), 40 * k + 20, np.uint8) for k in range(4)]


@pytest.fixture
def folder(tmp_path):
    for number, picture in enumerate(PICTURES):
        cv2.imwrite(str(tmp_path / f"frame_{number:03d}.png"), picture)
    (tmp_path / "notes.txt").write_text("no picture")
    return tmp_path


@pytest.fixture
def video(tmp_path):
    path = tmp_path / "film.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), 25.0, (64, 48))
    for picture in PICTURES:
        writer.write(picture)
    writer.release()
    return path


def greys(source, most: int = 20) -> list[int]:
    found = []
    while len(found) < most and (picture := source.read()) is not None:
        assert picture.shape == (48, 64, 3)
        found.append(round(float(picture.mean())))
    return found


def test_a_folder_gives_its_pictures_by_name_and_ends(folder):
    source = open_source(str(folder), Wanted(rate=10.0))
    assert source.period == pytest.approx(0.1)
    assert greys(source) == [20, 60, 100, 140]
    assert source.read() is None


def test_a_video_gives_its_pictures_at_its_own_rate_and_ends(video):
    source = open_source(str(video), Wanted())
    assert source.period == pytest.approx(1.0 / 25.0)
    assert greys(source) == pytest.approx([20, 60, 100, 140], abs=2)
    source.close()


@pytest.mark.parametrize("kind", ["folder", "video"])
def test_what_loops_begins_again(kind, request):
    source = open_source(str(request.getfixturevalue(kind)), Wanted(loop=True))
    assert greys(source, 6) == pytest.approx([20, 60, 100, 140, 20, 60], abs=2)


def test_what_is_no_source_is_refused_by_name(folder, tmp_path):
    with pytest.raises(SourceError, match="'nowhere.mp4' is no device"):
        open_source("nowhere.mp4", Wanted())
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(SourceError, match="empty holds no picture"):
        open_source(str(empty), Wanted())
    with pytest.raises(SourceError, match="notes.txt cannot be read as a video|holds no picture"):
        open_source(str(folder / "notes.txt"), Wanted()).read()


def test_a_damaged_picture_is_named(folder):
    (folder / "frame_001.png").write_bytes(b"\x89PNG nothing more")
    source = open_source(str(folder), Wanted())
    source.read()
    with pytest.raises(SourceError, match="frame_001.png cannot be read"):
        source.read()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"width": -1}, "size -1x0"),
        ({"rate": float("nan")}, "rate is nan"),
        ({"exposure": -2.0}, "exposure is -2.0"),
        ({"pixel_format": "MJPEG"}, "'MJPEG' has not four letters"),
    ],
)
def test_what_no_camera_can_do_is_refused(changes, words):
    with pytest.raises(ValueError, match=words):
        Wanted(**changes)


class FakeCapture:
    """A camera that is unplugged after two pictures."""

    present = True

    def __init__(self, index, backend):
        self.index, self.backend, self.asked, self.left = index, backend, {}, 2

    def isOpened(self):  # noqa: N802  (OpenCV's name)
        return self.present

    def set(self, setting, value):
        self.asked[setting] = value
        return True

    def read(self):
        self.left -= 1
        return (True, PICTURES[0][..., 0]) if self.left >= 0 else (False, None)

    def release(self):
        self.present = False


@pytest.mark.parametrize("name", ["2", "/dev/video2"])
def test_a_camera_is_asked_for_what_is_wanted_and_its_loss_is_told(monkeypatch, name):
    monkeypatch.setattr(picture_sources.cv2, "VideoCapture", FakeCapture)
    wanted = Wanted(640, 480, 30.0, "MJPG", 80.0)
    camera = open_source(name, wanted)
    assert isinstance(camera, Device)
    fake = camera._capture
    assert (fake.index, fake.backend) == (2, cv2.CAP_V4L2)
    assert fake.asked[cv2.CAP_PROP_FRAME_WIDTH] == 640
    assert fake.asked[cv2.CAP_PROP_FOURCC] == cv2.VideoWriter_fourcc(*"MJPG")
    assert list(fake.asked)[0] == cv2.CAP_PROP_FOURCC
    assert fake.asked[cv2.CAP_PROP_EXPOSURE] == 80.0
    assert camera.read().shape == (48, 64, 3)  # a grey camera's too
    camera.read()
    with pytest.raises(SourceError, match="/dev/video2 has stopped"):
        camera.read()


def test_a_camera_that_is_not_there_is_named(monkeypatch):
    monkeypatch.setattr(picture_sources.cv2, "VideoCapture", FakeCapture)
    monkeypatch.setattr(FakeCapture, "present", False)
    with pytest.raises(SourceError, match="/dev/video0 cannot be opened"):
        open_source("0", Wanted())
