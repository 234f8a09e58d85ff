# SPDX-License-Identifier: BSD-3-Clause
"""Pictures from a camera of the computer, a video file or a folder, through OpenCV.

    source = open_source("0", Wanted(width=640, height=480, rate=30.0))
    picture = source.read()     # (H, W, 3) uint8, blue green red; None when there are no more

A camera delivers at its own pace; files at `rate` pictures a second, which the reader keeps.
"""

import math
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import cv2
import numpy as np

SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
DEVICE = re.compile(r"(?:/dev/video)?(\d+)")
DEFAULT_RATE = 30.0  # Hz, of a video that does not say


class SourceError(RuntimeError):
    """A source that cannot be opened or has broken off; the message names it."""


@dataclass(frozen=True)
class Wanted:
    """What a camera is asked for; 0 leaves it to the camera. Raises ValueError."""

    width: int = 0  # pixels
    height: int = 0
    rate: float = 0.0  # Hz; of files, pictures a second in place of their own
    pixel_format: str = ""  # four letters, such as MJPG or YUYV
    exposure: float = 0.0  # in the driver's units; 0 is automatic
    loop: bool = False  # files begin again when they end

    def __post_init__(self) -> None:
        if self.width < 0 or self.height < 0:
            raise ValueError(f"size {self.width}x{self.height} must not be negative")
        for name in ("rate", "exposure"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise ValueError(f"{name} is {getattr(self, name)}; it must be 0 or more")
        if self.pixel_format and len(self.pixel_format) != 4:
            raise ValueError(f"pixel_format '{self.pixel_format}' has not four letters")


class Source(Protocol):
    """Where pictures come from. period: s from one to the next, 0 when the source waits itself."""

    period: float

    def read(self) -> np.ndarray | None:
        """Return the next picture (H, W, 3) uint8, or None at the end; raises SourceError."""

    def close(self) -> None:
        """Give the device back."""


def open_source(name: str, wanted: Wanted) -> Source:
    """Open a device (0, /dev/video0), a video file or a folder of pictures; raises SourceError."""
    device = DEVICE.fullmatch(name)
    if device:
        return Device(int(device.group(1)), wanted)
    if os.path.isdir(name):
        return Folder(Path(name), wanted)
    if os.path.isfile(name):
        return Video(Path(name), wanted)
    raise SourceError(f"'{name}' is no device (0, /dev/video0), video file or folder of pictures")


class Device:
    """A V4L2 camera."""

    period = 0.0

    def __init__(self, index: int, wanted: Wanted) -> None:
        self._name = f"/dev/video{index}"
        self._capture = cv2.VideoCapture(index, cv2.CAP_V4L2)
        if not self._capture.isOpened():
            raise SourceError(f"{self._name} cannot be opened: is it there, and free?")
        self._ask(wanted)

    def read(self) -> np.ndarray:
        """The newest picture; waits for it."""
        got, picture = self._capture.read()
        if not got or picture is None:
            raise SourceError(f"{self._name} has stopped to send pictures")
        return _colour(picture)

    def close(self) -> None:
        """Give the device back."""
        self._capture.release()

    def _ask(self, wanted: Wanted) -> None:
        """Format first: which sizes and rates there are depends on it."""
        settings = [
            (cv2.CAP_PROP_FRAME_WIDTH, wanted.width),
            (cv2.CAP_PROP_FRAME_HEIGHT, wanted.height),
            (cv2.CAP_PROP_FPS, wanted.rate),
        ]
        if wanted.pixel_format:
            code = cv2.VideoWriter_fourcc(*wanted.pixel_format)
            settings.insert(0, (cv2.CAP_PROP_FOURCC, code))
        if wanted.exposure:
            settings += [(cv2.CAP_PROP_AUTO_EXPOSURE, 1), (cv2.CAP_PROP_EXPOSURE, wanted.exposure)]
        settings.append((cv2.CAP_PROP_BUFFERSIZE, 1))  # an old picture is worse than none
        for setting, value in settings:
            if value:
                self._capture.set(setting, value)


class Video:
    """A video file."""

    def __init__(self, path: Path, wanted: Wanted) -> None:
        self._path, self._loop = path, wanted.loop
        self._capture = cv2.VideoCapture(str(path))
        if not self._capture.isOpened():
            raise SourceError(f"{path} cannot be read as a video")
        own = self._capture.get(cv2.CAP_PROP_FPS)
        own = own if math.isfinite(own) and own > 0.0 else DEFAULT_RATE
        self.period = 1.0 / (wanted.rate or own)
        self._read_any = False

    def read(self) -> np.ndarray | None:
        """The next picture."""
        got, picture = self._capture.read()
        if not got and self._loop and self._read_any:
            self._capture.set(cv2.CAP_PROP_POS_FRAMES, 0)
            got, picture = self._capture.read()
        if not got and not self._read_any:
            raise SourceError(f"{self._path} holds no picture")
        self._read_any = True
        return _colour(picture) if got else None

    def close(self) -> None:
        """Close the file."""
        self._capture.release()


class Folder:
    """The pictures of a folder in the order of their names."""

    def __init__(self, path: Path, wanted: Wanted) -> None:
        self._paths = sorted(p for p in path.iterdir() if p.suffix.lower() in SUFFIXES)
        if not self._paths:
            raise SourceError(f"{path} holds no picture ({', '.join(SUFFIXES)})")
        self.period = 1.0 / (wanted.rate or DEFAULT_RATE)
        self._loop = wanted.loop
        self._next = 0

    def read(self) -> np.ndarray | None:
        """The next picture."""
        if self._next == len(self._paths) and self._loop:
            self._next = 0
        if self._next == len(self._paths):
            return None
        path = self._paths[self._next]
        picture = cv2.imread(str(path), cv2.IMREAD_COLOR)
        if picture is None:
            raise SourceError(f"{path} cannot be read as a picture")
        self._next += 1
        return picture

    def close(self) -> None:
        """Nothing is held."""


def _colour(picture: np.ndarray) -> np.ndarray:
    return cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR) if picture.ndim == 2 else picture
