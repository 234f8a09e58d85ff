# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of the cell node: typed, checked, refused by their full name."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

DIRECT, CAMERA = "direct", "camera"
SENSING = (DIRECT, CAMERA)
MANUAL = "manual"  # human: somebody at the keys


class ParameterError(ValueError):
    """A parameter is missing or wrong; the message gives its full name and what is wanted."""


@dataclass(frozen=True)
class CellParameters:
    """What the node is started with; files by path."""

    human: str  # name of a type, "e,s,a,c", random, mixed, drifting, a worker's file or manual
    seed: int  # root seed of the run
    sensing: str  # one of SENSING
    expected: tuple[str, ...]  # nodes to wait for, as they call themselves in heartbeats
    cell_file: str  # cell.yaml
    limits_file: str  # magician.yaml
    arm_file: str
    sensing_file: str
    sensors_file: str = ""  # sensors.yaml, needed with sensing camera
    speed: float = 1.0  # times real time, 0 as fast as possible
    guard: float = 20.0  # s, wall time for others to do their work
    startup_guard: float = 60.0  # s, wall time for others to be there
    emulator: str = ""  # the link of the emulated arm that moves the cubes, in place of our own
    arm_frames: bool = False  # publish the fixed frames and arm_tcp, for want of a URDF

    @classmethod
    def load(cls, values: Mapping[str, Any], node: str) -> "CellParameters":
        """Check the values given to the node of this full name. Raises ParameterError."""
        reader = Reader(values, node)
        parameters = cls(
            human=reader.word("human"),
            seed=reader.whole("seed"),
            sensing=reader.word("sensing", SENSING),
            expected=reader.words("expected"),
            cell_file=reader.word("cell_file"),
            limits_file=reader.word("limits_file"),
            arm_file=reader.word("arm_file"),
            sensing_file=reader.word("sensing_file"),
            sensors_file=reader.word("sensors_file") if "sensors_file" in values else "",
            speed=reader.number("speed", 0.0, cls.speed),
            guard=reader.number("guard", 0.1, cls.guard),
            startup_guard=reader.number("startup_guard", 0.1, cls.startup_guard),
            emulator=reader.word("emulator") if "emulator" in values else "",
            arm_frames=reader.flag("arm_frames", cls.arm_frames),
        )
        reader.refuse_unknown(set(cls.__dataclass_fields__))
        if parameters.sensing == CAMERA and not parameters.sensors_file:
            raise ParameterError(f"parameter {node}/sensors_file is missing")
        if parameters.emulator and parameters.speed == 0.0:
            raise ParameterError(
                f"parameter {node}/speed is 0, want more than 0 with an emulated arm: it moves in "
                "real time"
            )
        if parameters.human == MANUAL and parameters.speed == 0.0:
            raise ParameterError(
                f"parameter {node}/speed is 0, want more than 0 with human manual: nobody presses "
                "keys as fast as the computer"
            )
        return parameters


class Reader:
    """Reads the parameters of a node; what is missing or wrong is refused by its full name."""

    def __init__(self, values: Mapping[str, Any], node: str) -> None:
        self._values = values
        self._node = node

    def word(self, key: str, allowed: tuple[str, ...] = ()) -> str:
        """A word, one of the allowed ones when these are given."""
        value = self._get(key)
        if not isinstance(value, str) or not value:
            raise self._error(key, "a word")
        if allowed and value not in allowed:
            raise self._error(key, f"one of {', '.join(allowed)}")
        return value

    def words(self, key: str) -> tuple[str, ...]:
        """A list, or words with blanks between them."""
        value = self._get(key)
        value = value.split() if isinstance(value, str) else value
        if not isinstance(value, list) or not all(isinstance(word, str) for word in value):
            raise self._error(key, "a list of words")
        return tuple(value)

    def whole(self, key: str) -> int:
        """A whole number, 0 or more."""
        value = self._get(key)
        if isinstance(value, bool) or not isinstance(value, int) or value < 0:
            raise self._error(key, "a whole number, 0 or more")
        return value

    def number(self, key: str, least: float, default: float) -> float:
        """A finite number, `least` or more."""
        value = self._values.get(key, default)
        good = isinstance(value, int | float) and not isinstance(value, bool)
        if not good or not math.isfinite(value) or value < least:
            raise self._error(key, f"a finite number, {least:g} or more")
        return float(value)

    def flag(self, key: str, default: bool) -> bool:
        """True or false."""
        if not isinstance(self._values.get(key, default), bool):
            raise self._error(key, "true or false")
        return self._values.get(key, default)

    def refuse_unknown(self, known: set[str]) -> None:
        """Raise ParameterError for a parameter that nobody asked for."""
        for key in self._values:
            if key not in known:
                raise ParameterError(f"parameter {self._node}/{key} is not known")

    def _get(self, key: str) -> Any:
        if key not in self._values:
            raise ParameterError(f"parameter {self._node}/{key} is missing")
        return self._values[key]

    def _error(self, key: str, wanted: str) -> ParameterError:
        value = self._values.get(key)
        return ParameterError(f"parameter {self._node}/{key} is {value!r}, want {wanted}")
