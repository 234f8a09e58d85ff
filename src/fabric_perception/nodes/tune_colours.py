#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Finds the limits of the colours in live or stored pictures and saves them.

    rosrun fabric_perception tune_colours.py colours.yaml --topic cell/camera/rgb/image_raw
    rosrun fabric_perception tune_colours.py colours.yaml picture.png folder/
    tune_colours.py colours.yaml picture.png --sample red:120,200 --sample glove:300,180,40,30

With a display a window opens: r, g, b or y chooses red, green, blue or the glove; a click or a
dragged box samples it; the sliders set its limits by hand; f forgets its samples; n shows the next
picture; s saves; q ends. With --sample no window is needed: the samples are taken, the limits
printed and saved.
"""

import argparse
import os
import sys
import threading
from pathlib import Path

import cv2
import numpy as np

from fabric_perception.images import ImageError, colour_of
from fabric_perception.tracking.colours import GLOVE, HUES, Limits, Palette
from fabric_perception.tracking.settings import SettingsError
from fabric_perception.tracking.tuning import Tuner, TuningError, describe, paint

KEYS = {"r": "red", "g": "green", "b": "blue", "y": GLOVE}
SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".ppm")
WINDOW = "colours"
SLIDERS = {
    "hue from": ("hue", 0, HUES - 1),
    "hue to": ("hue", 1, HUES - 1),
    "saturation from": ("saturation", 0, 255),
    "value from": ("value", 0, 255),
}
FIRST_PICTURE = 10.0  # s to wait for it
REFRESH = 50  # ms


class Files:
    """Pictures of files and folders, shown one after the other."""

    def __init__(self, paths: list[Path]) -> None:
        self._files = [file for path in paths for file in _files_of(path)]
        if not self._files:
            raise TuningError(f"there is no picture in {', '.join(map(str, paths))}")
        self._at = 0
        self.picture = self._read()

    def next(self) -> None:
        """Go on to the next picture; after the last the first."""
        self._at = (self._at + 1) % len(self._files)
        self.picture = self._read()

    def _read(self) -> np.ndarray:
        file = self._files[self._at]
        picture = cv2.imread(str(file), cv2.IMREAD_COLOR)
        if picture is None:
            raise TuningError(f"{file} is no picture")
        return picture


class Topic:
    """Pictures of a topic, the newest."""

    def __init__(self, name: str) -> None:
        import rospy
        from sensor_msgs.msg import Image

        self._came = threading.Event()
        self._newest: np.ndarray | None = None
        rospy.init_node("tune_colours", anonymous=True, disable_signals=True)
        rospy.Subscriber(name, Image, self._take, queue_size=1, buff_size=2**24)
        if not self._came.wait(FIRST_PICTURE):
            raise TuningError(f"no picture on {rospy.resolve_name(name)} in {FIRST_PICTURE:g} s")

    @property
    def picture(self) -> np.ndarray:
        """The newest one."""
        assert self._newest is not None
        return self._newest

    def next(self) -> None:
        """They go on by themselves."""

    def _take(self, message: object) -> None:
        try:
            self._newest = colour_of(message)
        except ImageError as error:
            print(f"a picture is left out: {error}", file=sys.stderr)
            return
        self._came.set()


class Window:
    """Picture and masks side by side, sliders for the chosen colour."""

    def __init__(self, source: Files | Topic, tuner: Tuner, out: Path) -> None:
        self._source, self._tuner, self._out = source, tuner, out
        self._name, self._start = "red", None
        cv2.namedWindow(WINDOW, cv2.WINDOW_NORMAL)
        cv2.setMouseCallback(WINDOW, self._on_mouse)
        for slider, (_, _, top) in SLIDERS.items():
            cv2.createTrackbar(slider, WINDOW, 0, top, lambda _: None)
        self._show_limits()

    def run(self) -> None:
        """Until q, or the window is closed."""
        while cv2.getWindowProperty(WINDOW, cv2.WND_PROP_VISIBLE) >= 1:
            self._take_sliders()
            picture = self._source.picture
            both = np.hstack([picture, paint(picture, self._tuner.palette)])
            cv2.putText(both, self._name, (8, 24), cv2.FONT_HERSHEY_SIMPLEX, 0.8, (255, 0, 255), 2)
            cv2.imshow(WINDOW, both)
            key = chr(cv2.waitKey(REFRESH) & 0xFF)
            if key == "q":
                return
            self._on_key(key)

    def _on_key(self, key: str) -> None:
        if key in KEYS:
            self._name = KEYS[key]
            self._show_limits()
        elif key == "f":
            self._tuner.forget(self._name)
        elif key == "n":
            self._source.next()
        elif key == "s":
            self._tuner.palette.save(self._out)
            print(f"saved {self._out}\n{describe(self._tuner.palette)}")

    def _on_mouse(self, event: int, x: int, y: int, _flags: int, _data: object) -> None:
        if event == cv2.EVENT_LBUTTONDOWN:
            self._start = (x, y)
        elif event == cv2.EVENT_LBUTTONUP and self._start is not None:
            (a, b), self._start = self._start, None
            box = (min(a, x), min(b, y), abs(x - a), abs(y - b))
            try:
                self._tuner.add(
                    self._name, self._source.picture, box if min(box[2:]) > 3 else (x, y)
                )
            except (TuningError, SettingsError) as error:
                print(error, file=sys.stderr)
            self._show_limits()

    def _show_limits(self) -> None:
        limits = self._tuner.palette.limits[self._name]
        for slider, (span, end, _) in SLIDERS.items():
            cv2.setTrackbarPos(slider, WINDOW, getattr(limits, span)[end])

    def _take_sliders(self) -> None:
        spans = {k: list(v) for k, v in self._tuner.palette.limits[self._name]._asdict().items()}
        for slider, (span, end, _) in SLIDERS.items():
            spans[span][end] = cv2.getTrackbarPos(slider, WINDOW)
        limits = Limits(*(tuple(spans[name]) for name in Limits._fields))
        if limits != self._tuner.palette.limits[self._name]:
            try:
                self._tuner.set(self._name, limits)
            except SettingsError as error:
                print(error, file=sys.stderr)
                self._show_limits()


def _files_of(path: Path) -> list[Path]:
    if not path.exists():
        raise TuningError(f"{path} does not exist")
    if path.is_dir():
        return sorted(file for file in path.iterdir() if file.suffix.lower() in SUFFIXES)
    return [path]


def _sample(word: str) -> tuple[str, tuple[int, ...]]:
    """red:120,200 or red:120,200,30,20."""
    name, _, numbers = word.partition(":")
    try:
        return name, tuple(int(number) for number in numbers.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"{word!r} is not COLOUR:x,y or COLOUR:x,y,width,height"
        ) from None


def _arguments(words: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("colours", type=Path, help="YAML file with the limits to begin with")
    parser.add_argument("pictures", type=Path, nargs="*", help="files, or folders of pictures")
    parser.add_argument("--topic", help="take pictures from this topic")
    parser.add_argument("--out", type=Path, help="file to save to; default: the one read")
    parser.add_argument("--sample", type=_sample, action="append", default=[], metavar="COLOUR:BOX")
    parser.add_argument("--preview", type=Path, help="write the last picture with its masks here")
    arguments = parser.parse_args(words)
    if bool(arguments.topic) == bool(arguments.pictures):
        parser.error("want either pictures or --topic")
    return arguments


def tune(arguments: argparse.Namespace) -> None:
    """Do what was asked for. Raises ValueError naming what is wrong; then nothing is saved."""
    tuner = Tuner(Palette.load(arguments.colours))
    source = Topic(arguments.topic) if arguments.topic else Files(arguments.pictures)
    out = arguments.out or arguments.colours
    for name, box in arguments.sample:
        tuner.add(name, source.picture, box)
    if arguments.preview:
        shown = np.hstack([source.picture, paint(source.picture, tuner.palette)])
        if not cv2.imwrite(str(arguments.preview), shown):
            raise TuningError(f"{arguments.preview} cannot be written")
    if arguments.sample:
        tuner.palette.save(out)
        print(f"saved {out}\n{describe(tuner.palette)}")
    elif os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        Window(source, tuner, out).run()
    else:
        print(describe(tuner.palette))
        print("there is no display; name samples with --sample COLOUR:x,y", file=sys.stderr)


def main(words: list[str] | None = None) -> int:
    """Return 0, or 2 with a sentence for what cannot be used."""
    try:
        tune(_arguments(sys.argv[1:] if words is None else words))
    except (ValueError, OSError) as error:
        print(f"tune_colours: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
