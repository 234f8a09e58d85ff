# SPDX-License-Identifier: BSD-3-Clause
"""From the printed sheet to the camera's place, on pictures of the sheet itself."""

import dataclasses
import math
import re

import cv2
import numpy as np
import pytest
import yaml
from board_scene import BOARD, DOTS, K, above, board_pose, photograph, raster, rectangles
from head_scene import CONFIG, HELMET

from fabric_perception import camera_info, camera_poses
from fabric_perception.calibration import command, extrinsics, intrinsics, sheet
from fabric_perception.calibration.board import Board, View, view_of
from fabric_perception.calibration.extrinsics import CalibrationError, calibrate
from fabric_perception.camera import Camera
from fabric_perception.head.aruco import MarkerFinder
from fabric_perception.head.pose import angle_between

SHEET = sheet.board_sheet(BOARD)
AT = board_pose((0.20, -0.12, 0.001), 0.3)
CAMERA = above((0.25, -0.05, 0.62), (0.30, 0.02, 0.0))
PICTURE = photograph(SHEET, CAMERA, AT)


def view(picture=PICTURE, board=BOARD) -> View:
    return view_of(board, board.finder(), picture)


# -- sheets ----------------------------------------------------------------------------------------


def test_every_marker_of_the_printed_board_is_where_the_board_says():
    found = MarkerFinder(wanted=BOARD.ids).find(raster(SHEET))
    assert [marker.id for marker in found] == list(BOARD.ids)
    x, y, _, h = np.array(rectangles(SHEET)).T
    origin = np.array((x.min(), (y + h).max()))
    for marker in found:
        printed = (marker.corners + 0.5) / DOTS - origin
        expected = 1000.0 * BOARD.corners(marker.id)[:, :2] * (1.0, -1.0)
        assert np.abs(printed - expected).max() < 0.1  # mm


def test_the_sheet_is_of_true_size_and_says_how_to_check_it():
    assert 'width="210.0mm" height="297.0mm" viewBox="0 0 210.0 297.0"' in SHEET
    lines = re.findall(r'<line x1="([\d.]+)" y1="([\d.]+)" x2="([\d.]+)" y2="([\d.]+)"', SHEET)
    assert any(float(c) - float(a) == 100.0 for a, _, c, _ in lines)
    assert "must be 100 mm long" in SHEET
    assert "ids 10..44" in SHEET


def test_everything_stays_where_a_printer_can_reach():
    for page in (SHEET, sheet.helmet_sheet(HELMET)):
        x, y, w, h = np.array(rectangles(page)).T
        assert x.min() >= sheet.BORDER and (x + w).max() <= 210.0 - sheet.BORDER
        assert y.min() >= sheet.BORDER and (y + h).max() <= 297.0 - sheet.BORDER - 6.0


def test_the_helmets_markers_are_printed_upright_in_their_size():
    page = raster(sheet.helmet_sheet(HELMET))
    found = MarkerFinder(HELMET.dictionary).find(page)
    assert [marker.id for marker in found] == list(HELMET.markers)
    for marker in found:
        (left, top), _, (right, bottom), _ = marker.corners
        assert right - left == pytest.approx(1000 * HELMET.markers[marker.id].size * DOTS, abs=2)
        assert bottom > top


def test_what_does_not_fit_on_the_paper_is_refused():
    with pytest.raises(sheet.SheetError, match="363x178 mm does not fit on a4"):
        sheet.board_sheet(dataclasses.replace(BOARD, columns=10, rows=5, first_id=0))
    assert "420.0mm" in sheet.board_sheet(dataclasses.replace(BOARD, columns=6, first_id=4), "a3")
    large = [dataclasses.replace(m, size=0.2) for m in HELMET.markers.values()]
    with pytest.raises(sheet.SheetError, match="helmet do not fit on a4"):
        sheet.helmet_sheet(dataclasses.replace(HELMET, markers={m.id: m for m in large}))
    with pytest.raises(sheet.SheetError, match="no paper 'a5'; there are a4, a3"):
        sheet.board_sheet(BOARD, "a5")


@pytest.mark.parametrize(
    "changes", [{"rows": 1}, {"size": 0.0}, {"gap": math.nan}, {"first_id": -1}]
)
def test_a_board_that_cannot_be_is_refused(changes):
    with pytest.raises(ValueError, match="too small|must be|must lie"):
        Board(**changes)


def test_the_boards_markers_are_not_the_helmets():
    assert not set(BOARD.ids) & set(HELMET.markers)


# -- place -----------------------------------------------------------------------------------------


def test_the_cameras_place_is_found_to_a_millimetre_and_a_tenth_of_a_degree():
    found = calibrate(CAMERA, [view()], AT)
    assert np.linalg.norm(found.pose_in_cell[:3, 3] - CAMERA.position) < 0.001
    turned = angle_between(found.pose_in_cell[:3, :3], CAMERA.pose_in_cell[:3, :3])
    assert math.degrees(turned) < 0.1
    assert found.error < 0.3
    assert found.corners == 4 * len(BOARD.ids)


def test_the_stated_deviation_is_what_repeated_calibrations_show():
    rng = np.random.default_rng(7)
    one = view()
    exact = CAMERA.project(one.points @ AT[:3, :3].T + AT[:3, 3])
    found = []
    for _ in range(60):
        noisy = dataclasses.replace(one, pixels=exact + rng.normal(0.0, 0.3, exact.shape))
        found.append(calibrate(CAMERA, [noisy], AT))
    places = np.array([f.pose_in_cell[:3, 3] for f in found])
    spread = math.sqrt(((places - CAMERA.position) ** 2).sum(axis=1).mean())
    assert np.mean([f.position_deviation for f in found]) == pytest.approx(spread, rel=0.3)


def test_a_board_that_stands_upright_serves_as_well():
    """As before the head camera: its face against the robot."""
    stands = board_pose((0.55, 0.12, 0.35), math.radians(-90), 0.0, math.radians(90))
    assert np.allclose(stands[:3, 2], (-1.0, 0.0, 0.0))
    assert np.allclose(stands[:3, 1], (0.0, 0.0, 1.0))
    camera = above((0.05, 0.00, 0.70), (0.55, 0.03, 0.48))
    found = calibrate(camera, [view(photograph(SHEET, camera, stands))], stands)
    assert np.linalg.norm(found.pose_in_cell[:3, 3] - camera.position) < 0.002


def test_a_sheet_the_printer_scaled_is_measured_by_its_line():
    small = photograph(sheet.board_sheet(BOARD.scaled(0.97)), CAMERA, AT)
    wrong = calibrate(CAMERA, [view(small)], AT)
    right = calibrate(CAMERA, [view(small, BOARD.scaled(0.97))], AT)
    assert np.linalg.norm(wrong.pose_in_cell[:3, 3] - CAMERA.position) > 0.01
    assert np.linalg.norm(right.pose_in_cell[:3, 3] - CAMERA.position) < 0.002


def test_too_few_corners_are_refused_by_picture():
    hidden = PICTURE.copy()
    hidden[:, :330] = 90
    hidden[200:] = 90
    with pytest.raises(CalibrationError, match=r"picture 2 shows \d+ corners of the board; 24 are"):
        calibrate(CAMERA, [view(), view(hidden)], AT)
    with pytest.raises(CalibrationError, match="picture 1 shows 0 corners"):
        calibrate(CAMERA, [view(np.zeros_like(PICTURE))], AT)
    with pytest.raises(CalibrationError, match="there is no picture"):
        calibrate(CAMERA, [], AT)


def test_a_board_too_far_away_is_refused():
    one = view()
    far = dataclasses.replace(one, pixels=320.0 + 0.1 * (one.pixels - 320.0))
    with pytest.raises(CalibrationError, match="covers 0.. % of picture 1; 3 % are needed"):
        calibrate(CAMERA, [far], AT)


def test_corners_that_do_not_fit_are_refused():
    one = view()
    rng = np.random.default_rng(3)
    bad = dataclasses.replace(one, pixels=one.pixels + rng.normal(0.0, 2.0, one.pixels.shape))
    with pytest.raises(CalibrationError, match=r"miss the board by [23]\.\d\d pixels"):
        calibrate(CAMERA, [bad], AT)
    other_lens = Camera(CAMERA.K, 640, 480, np.eye(4), (2.0, 0.0, 0.0, 0.0))
    with pytest.raises(CalibrationError, match="miss the board"):
        calibrate(other_lens, [view()], AT)


# -- lens ------------------------------------------------------------------------------------------


def lens_views(count: int, spread: float = 1.0) -> list[View]:
    """Exact corners with noise, of a board held here and there; no need of pictures."""
    rng = np.random.default_rng(11)
    points = np.concatenate([BOARD.corners(marker) for marker in BOARD.ids])
    camera = Camera(K, 640, 480, np.eye(4), CAMERA.distortion)
    views = []
    for number in range(count):
        turn = (*rng.uniform(-0.7, 0.7, 2) * spread, rng.uniform(-0.3, 0.3))
        pose = board_pose((0, 0, 0), turn[2], turn[0], math.pi + turn[1])
        at = np.array(((number % 3 - 1) * 0.11, (number // 3 % 3 - 1) * 0.07, 0.42)) * spread
        pose[:3, 3] = at + (0, 0, 0.42 * (1 - spread)) - pose[:3, :3] @ points.mean(axis=0)
        pixels = camera.project(points @ pose[:3, :3].T + pose[:3, 3])
        inside = ((pixels > 2) & (pixels < (638, 478))).all(axis=1)
        noisy = pixels + rng.normal(0.0, 0.15, pixels.shape)
        views.append(View(points[inside], noisy[inside], ()))
    return views


def test_a_lens_is_found_from_boards_held_here_and_there():
    found = intrinsics.calibrate_lens(lens_views(14), 640, 480)
    assert np.allclose(found.camera.K, K, atol=6.0)
    assert found.error < 0.3
    spot = [[100.0, 80.0], [500.0, 400.0]]
    truth = Camera(K, 640, 480, np.eye(4), CAMERA.distortion)
    assert np.allclose(found.camera.rays(spot), truth.rays(spot), atol=0.004)


@pytest.mark.parametrize(
    ("views", "words"),
    [
        (lens_views(5), "5 pictures are not enough; 8 are needed"),
        (lens_views(9, 0.05), "hold it into the corners"),
    ],
)
def test_pictures_that_leave_the_lens_open_are_refused(views, words):
    with pytest.raises(CalibrationError, match=words):
        intrinsics.calibrate_lens(views, 640, 480)


def test_boards_that_are_all_alike_leave_the_focal_length_open():
    rng = np.random.default_rng(4)
    one = next(v for v in lens_views(9, 0.0) if v.count >= 100)
    wide = dataclasses.replace(one, pixels=(one.pixels - (320, 240)) * 1.35 + (320, 240))
    alike = [
        dataclasses.replace(wide, pixels=wide.pixels + rng.normal(0, 0.3, wide.pixels.shape))
        for _ in range(8)
    ]
    with pytest.raises(CalibrationError, match="focal length stays open: the board is tilted in 0"):
        intrinsics.calibrate_lens(alike, 640, 480)


# -- the command -----------------------------------------------------------------------------------


@pytest.fixture
def files(tmp_path):
    cv2.imwrite(str(tmp_path / "board.png"), PICTURE)
    info = camera_info.info_of(CAMERA, "cell_camera_color_optical_frame")
    entry = camera_info.entry_of("cell", info)
    (tmp_path / "info.yaml").write_text(yaml.safe_dump(entry))
    return tmp_path


def place(folder, *more: str) -> int:
    fixed = ["place", "--at", "0.20", "-0.12", "0.001", "--turn-deg", str(math.degrees(0.3)), "0"]
    fixed += ["0", "--out", str(folder / "camera.yaml"), *more]
    return command.main([str(word) for word in fixed])


def usual(folder) -> list[str]:
    return ["--info", str(folder / "info.yaml"), "--frame", "a_frame", str(folder / "board.png")]


def test_one_command_writes_the_cameras_place(files, capsys):
    assert place(files, *usual(files)) == 0
    pose = camera_poses.load_pose(files / "camera.yaml", "a_frame")
    assert np.linalg.norm(pose[:3, 3] - CAMERA.position) < 0.001
    assert "a_frame stands at (0." in capsys.readouterr().out
    held = yaml.safe_load((files / "camera.yaml").read_text())
    assert held["corners"] == 140
    assert held["error_pixels"] < 0.3


def test_nothing_is_overwritten_without_being_asked(files, capsys):
    (files / "camera.yaml").write_text("precious")
    assert place(files, *usual(files)) == 2
    assert "is there already; --overwrite" in capsys.readouterr().err
    assert (files / "camera.yaml").read_text() == "precious"
    assert place(files, *usual(files), "--overwrite") == 0


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--info", "{}/info.yaml", "--frame", "f"], "either as files or from a --topic"),
        (["{}/board.png", "--frame", "f"], "--info is missing"),
        (["{}/board.png", "--info", "{}/info.yaml"], "--frame is missing"),
        (["{}/none.png", "--info", "{}/info.yaml", "--frame", "f"], "none.png: cannot be read"),
        (["{}/info.yaml", "--info", "{}/info.yaml", "--frame", "f"], "info.yaml: cannot be read"),
        (["{}/board.png", "--info", "{}/zero.yaml", "--frame", "f"], "'f' is not calibrated"),
        (["{}/half.png", "--info", "{}/info.yaml", "--frame", "f"], "320x240 pixels are not"),
        (["{}/board.png", "{}/half.png", "--info", "{}/info.yaml", "--frame", "f"], "different"),
        (["{}/black.png", "--info", "{}/info.yaml", "--frame", "f"], "picture 1 shows 0 corners"),
        (["{}/board.png", "--info", "{}/info.yaml", "--frame", "f", "--columns", "1"], "too small"),
    ],
)
def test_what_cannot_be_used_is_said_in_a_line_and_nothing_written(files, capsys, more, words):
    entry = yaml.safe_load((files / "info.yaml").read_text())
    entry["camera_matrix"]["data"] = [0.0] * 9
    (files / "zero.yaml").write_text(yaml.safe_dump(entry))
    cv2.imwrite(str(files / "half.png"), PICTURE[::2, ::2])
    cv2.imwrite(str(files / "black.png"), np.zeros_like(PICTURE))
    assert place(files, *(word.format(files) for word in more)) == 2
    told = capsys.readouterr()
    assert words in told.err
    assert len(told.err.splitlines()) == 1
    assert not (files / "camera.yaml").exists()


def test_bad_options_are_refused_in_a_line(files, capsys):
    for words in (["place"], ["dance"], ["board", "--out", "x", "--gap", "-1"]):
        with pytest.raises(SystemExit) as error:
            command.main(words)
        assert error.value.code == 2
        assert len(capsys.readouterr().err.splitlines()) == 1


def test_sheets_are_written_by_command(tmp_path, capsys):
    assert command.main(["board", "--out", str(tmp_path / "board.svg")]) == 0
    assert (tmp_path / "board.svg").read_text() == SHEET
    helmet = str(CONFIG / "helmet.yaml")
    assert command.main(["helmet", helmet, "--out", str(tmp_path / "helmet.svg")]) == 0
    assert "must be 100 mm" in capsys.readouterr().out
    assert command.main(["board", "--first-id", "40", "--out", str(tmp_path / "b.svg")]) == 2
    assert "no marker 50" in capsys.readouterr().err


def test_a_lens_is_calibrated_by_command(tmp_path, capsys):
    """From eight photographs; the file is one that the camera node takes."""
    spots = [(x, y) for x in (-0.16, 0.0, 0.16) for y in (-0.11, 0.11)] + [(0.0, 0.0)] * 3
    for number, (x, y) in enumerate(spots):
        look = (0.09 + 0.6 * x, 0.13 + 0.6 * y, 0.0)
        camera = above((0.09 - 1.3 * x + 0.05 * number, 0.13 - 1.2 * y, 0.34), look)
        cv2.imwrite(str(tmp_path / f"{number}.png"), photograph(SHEET, camera, np.eye(4), number))
    pictures = sorted(str(path) for path in tmp_path.glob("*.png"))
    out = tmp_path / "info.yaml"
    assert command.main(["lens", *pictures, "--out", str(out)]) == 0, capsys.readouterr().err
    info = camera_info.load_camera_info(out, "f")
    assert info.K[0] == pytest.approx(K[0, 0], abs=8.0)
    assert extrinsics.calibrate(
        Camera.from_camera_info(info, np.eye(4)), [view()], AT
    ).pose_in_cell[:3, 3] == pytest.approx(CAMERA.position, abs=0.01)
