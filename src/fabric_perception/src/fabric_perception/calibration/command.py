# SPDX-License-Identifier: BSD-3-Clause
"""`./fabric calibrate board|helmet|lens|place`: sheets to print, lenses and places of cameras.

Exit code 0 with what was found on stdout; 2 with one line on stderr that says what is wrong.
Nothing is overwritten unless --overwrite is given.
"""

import argparse
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

import cv2
import numpy as np

from fabric_perception import camera_info, camera_poses
from fabric_perception.calibration import extrinsics, intrinsics, live, sheet
from fabric_perception.calibration.board import Board, View, view_of
from fabric_perception.camera import Camera
from fabric_perception.head.helmet import load_helmet, rotation

REFUSED = (ValueError, OSError, live.NoPictures)


class OneLineParser(argparse.ArgumentParser):
    """Tells a bad option in one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message}\n")


def parser() -> argparse.ArgumentParser:
    """All four commands."""
    result = OneLineParser(prog="fabric calibrate", description=(__doc__ or "").split("\n")[0])
    commands = result.add_subparsers(dest="command", required=True)
    for name, (add, run, words) in COMMANDS.items():
        command = commands.add_parser(name, help=words)
        command.set_defaults(run=run)
        add(command)
    return result


def main(arguments: Sequence[str]) -> int:
    """Run one command; its exit code."""
    options = parser().parse_args(arguments)
    try:
        print(
            {"board": _board, "helmet": _helmet, "lens": _lens, "place": _place}[options.command](
                options
            )
        )
    except REFUSED as error:
        print(f"fabric calibrate: {error}", file=sys.stderr)
        return 2
    return 0


# -- sheets ----------------------------------------------------------------------------------------


def _board(options: argparse.Namespace) -> str:
    _write(options, sheet.board_sheet(_board_of(options), options.paper))
    return f"{options.out}: print it at 100 % and measure the line: it must be 100 mm long"


def _helmet(options: argparse.Namespace) -> str:
    _write(options, sheet.helmet_sheet(load_helmet(options.helmet), options.paper))
    return f"{options.out}: print it at 100 % and measure the line: it must be 100 mm long"


# -- lens and place --------------------------------------------------------------------------------


def _lens(options: argparse.Namespace) -> str:
    _check_free(options)
    pictures, _ = _pictures(options)
    views, (width, height) = _views(options, pictures)
    found = intrinsics.calibrate_lens(views, width, height)
    info = camera_info.info_of(found.camera, "")
    camera_poses.save_entry(
        options.out, camera_info.entry_of(options.name, info), options.overwrite
    )
    return (
        f"{options.out}: focal length {found.camera.K[0, 0]:.1f} +- {found.focal_deviation:.1f} "
        f"pixels from {found.views} pictures, error {found.error:.2f} pixels"
    )


def _place(options: argparse.Namespace) -> str:
    _check_free(options)
    board_in_cell = np.eye(4)
    turn = [math.radians(angle) for angle in options.turn_deg]
    board_in_cell[:3, :3], board_in_cell[:3, 3] = rotation(*turn), options.at
    pictures, topics_frame = _pictures(options)
    frame = options.frame or topics_frame
    if not frame:
        raise ValueError("--frame is missing: the optical frame in which the camera's pictures are")
    camera = _camera(options, frame)
    views, size = _views(options, pictures)
    if size != (camera.width, camera.height):
        raise ValueError(
            f"pictures of {size[0]}x{size[1]} pixels are not of a camera of "
            f"{camera.width}x{camera.height}"
        )
    found = extrinsics.calibrate(camera, views, board_in_cell, options.largest_error)
    entry = {**camera_poses.entry_of(frame, found.pose_in_cell), **_quality(found)}
    camera_poses.save_entry(options.out, entry, options.overwrite)
    x, y, z = found.pose_in_cell[:3, 3]
    return (
        f"{options.out}: {frame} stands at ({x:.4f}, {y:.4f}, {z:.4f}) m of the cell, "
        f"+- {1000 * found.position_deviation:.1f} mm and "
        f"{math.degrees(found.angle_deviation):.2f} deg; {found.corners} corners in {found.views} "
        f"pictures, error {found.error:.2f} pixels"
    )


def _quality(found: extrinsics.Extrinsics) -> dict[str, Any]:
    return {
        "error_pixels": round(found.error, 4),
        "corners": found.corners,
        "pictures": found.views,
        "position_deviation": round(found.position_deviation, 6),
        "angle_deviation": round(found.angle_deviation, 6),
    }


def _camera(options: argparse.Namespace, frame: str) -> Camera:
    if options.info:
        info = camera_info.load_camera_info(options.info, frame)
    elif options.topic:
        info = live.camera_info_of(_info_topic(options.topic), options.patience)
    else:
        raise ValueError("--info is missing: the camera's calibration, a camera_info YAML")
    return Camera.from_camera_info(info, np.eye(4))


def _info_topic(topic: str) -> str:
    return topic.rpartition("/")[0] + "/camera_info" if "/" in topic else "camera_info"


def _pictures(options: argparse.Namespace) -> tuple[list[np.ndarray], str]:
    if bool(options.pictures) == bool(options.topic):
        raise ValueError("pictures are wanted either as files or from a --topic")
    if options.topic:
        return live.pictures_of(options.topic, options.count, options.every, options.patience)
    return [_read(path) for path in options.pictures], ""


def _read(path: Path) -> np.ndarray:
    grey = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) if path.is_file() else None
    if grey is None:
        raise ValueError(f"{path}: cannot be read as a picture")
    return grey


def _views(
    options: argparse.Namespace, pictures: Sequence[np.ndarray]
) -> tuple[list[View], tuple[int, int]]:
    sizes = {(grey.shape[1], grey.shape[0]) for grey in pictures}
    if len(sizes) != 1:
        raise ValueError(f"the pictures are of different sizes: {sorted(sizes)}")
    board = _board_of(options).scaled(options.bar / sheet.BAR)
    finder = board.finder()
    return [view_of(board, finder, grey) for grey in pictures], sizes.pop()


def _board_of(options: argparse.Namespace) -> Board:
    return Board(
        options.dictionary,
        options.first_id,
        options.columns,
        options.rows,
        options.marker,
        options.gap,
    )


def _check_free(options: argparse.Namespace) -> None:
    """Before anybody stands in front of a camera in vain."""
    if options.out.exists() and not options.overwrite:
        raise FileExistsError(f"{options.out} is there already; --overwrite replaces it")


def _write(options: argparse.Namespace, text: str) -> None:
    _check_free(options)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.write_text(text, encoding="utf-8")


# -- options ---------------------------------------------------------------------------------------


def _number(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"'{text}' is no finite number")
    return value


def _positive(text: str) -> float:
    value = _number(text)
    if value <= 0.0:
        raise argparse.ArgumentTypeError(f"'{text}' is not above 0")
    return value


def _count(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is less than 1")
    return value


def _add_out(group: Any, meaning: str) -> None:
    group.add_argument("--out", type=Path, required=True, metavar="FILE", help=meaning)
    group.add_argument("--overwrite", action="store_true", help="replace FILE when it is there")


def _add_board(group: Any) -> None:
    _add_out(group, "the sheet, .svg")
    group.add_argument("--paper", default="a4", choices=sheet.PAPER, help="default a4")
    _add_board_options(group)


def _add_helmet(group: Any) -> None:
    group.add_argument("helmet", type=Path, help="such as config/helmet.yaml")
    group.add_argument("--paper", default="a4", choices=sheet.PAPER, help="default a4")
    _add_out(group, "the sheet, .svg")


def _add_board_options(group: Any) -> None:
    board = Board()
    group.add_argument("--dictionary", default=board.dictionary, help="default DICT_4X4_50")
    group.add_argument(
        "--first-id", type=int, default=board.first_id, help="of the top left marker"
    )
    group.add_argument("--columns", type=int, default=board.columns)
    group.add_argument("--rows", type=int, default=board.rows)
    group.add_argument("--marker", type=_positive, default=board.size, help="edge, m")
    group.add_argument("--gap", type=_positive, default=board.gap, help="between markers, m")


def _add_pictures(group: Any, count: int, every: float) -> None:
    group.add_argument("pictures", type=Path, nargs="*", help="picture files")
    group.add_argument("--topic", help="take pictures from this image topic instead")
    group.add_argument("--count", type=_count, default=count, help=f"of a topic; default {count}")
    group.add_argument("--every", type=_positive, default=every, help=f"s; default {every:g}")
    group.add_argument("--patience", type=_positive, default=10.0, help="s; default 10")
    group.add_argument(
        "--bar", type=_positive, default=sheet.BAR, help="measured length of the 100 mm line, mm"
    )
    _add_board_options(group)


def _add_lens(group: Any) -> None:
    _add_pictures(group, 20, 1.5)
    group.add_argument("--name", default="camera", help="of the camera, kept in FILE")
    _add_out(group, "the calibration, camera_info YAML")


def _add_place(group: Any) -> None:
    _add_pictures(group, 10, 0.1)
    group.add_argument(
        "--info", type=Path, help="camera_info YAML; default: the topic beside --topic"
    )
    group.add_argument("--frame", default="", help="optical frame; default: that of the topic")
    group.add_argument(
        "--at", type=_number, nargs=3, required=True, metavar=("X", "Y", "Z"),
        help="the board's origin in the cell, m",
    )  # fmt: skip
    group.add_argument(
        "--turn-deg", type=_number, nargs=3, default=(0.0, 0.0, 0.0),
        metavar=("YAW", "PITCH", "ROLL"),
        help="of the board in the cell; default: flat on the table, its x along x",
    )  # fmt: skip
    group.add_argument(
        "--largest-error",
        type=_positive,
        default=extrinsics.LARGEST_ERROR,
        help="pixels; default 1",
    )
    _add_out(group, "the camera's place, YAML")


COMMANDS = {
    "board": (_add_board, _board, "the calibration board as SVG in true size"),
    "helmet": (_add_helmet, _helmet, "the markers of a helmet as SVG in true size"),
    "lens": (_add_lens, _lens, "how a camera projects, as camera_info YAML"),
    "place": (_add_place, _place, "where a camera is in the cell, as YAML"),
}

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
