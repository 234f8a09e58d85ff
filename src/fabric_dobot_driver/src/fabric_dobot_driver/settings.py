# SPDX-License-Identifier: BSD-3-Clause
"""Settings of the driver: one place for default, unit, range and meaning of each."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from fabric_dobot_driver.kinematics import ToolPose


def setting(default: Any, unit: str, low: float, high: float, text: str) -> Any:
    """A field that has to lie in low..high."""
    return field(default=default, metadata={"unit": unit, "range": (low, high), "text": text})


@dataclass(frozen=True)
class DriverSettings:
    """How the driver talks to the arm and the belt. Raises ValueError naming a bad value."""

    reply_timeout: float = setting(0.1, "s", 0.02, 1.0, "an answer that takes longer is lost")
    tries: int = setting(3, "", 1, 10, "answers lost in a row after which the arm counts as gone")
    reconnect: float = setting(1.0, "s", 0.1, 60.0, "between attempts to find the port again")
    pose_rate: float = setting(30.0, "Hz", 1.0, 100.0, "of looks at the pose")
    index_rate: float = setting(30.0, "Hz", 1.0, 100.0, "of looks at the queue while moving")
    alarm_rate: float = setting(10.0, "Hz", 1.0, 50.0, "of looks at the alarms")
    lease: float = setting(0.3, "s", 0.1, 5.0, "the arm holds when motion is silent for longer")
    acceleration: float = setting(0.8, "m/s^2", 0.01, 5.0, "of the tool")
    yaw_speed: float = setting(3.0, "rad/s", 0.01, 6.0, "of the tool servo")
    yaw_acceleration: float = setting(10.0, "rad/s^2", 0.01, 50.0, "of the tool servo")
    arrival: float = setting(0.003, "m", 1e-4, 0.05, "a goal farther away is not reached")
    overtime: float = setting(5.0, "s", 0.5, 60.0, "a move may take longer than it should")
    homing_time: float = setting(90.0, "s", 5.0, 600.0, "that homing may take")
    home_x: float = setting(0.197, "m", 0.1, 0.35, "where homing ends, in arm_base_link")
    home_y: float = setting(-0.001, "m", -0.35, 0.35, "where homing ends")
    home_z: float = setting(0.035, "m", -0.1, 0.25, "where homing ends")
    stepper: int = setting(0, "", 0, 1, "connector of the belt's motor: 0 is Stepper1")
    pulses_per_mm: float = setting(282.9, "1/mm", 1.0, 2000.0, "of belt travel; calibrate it")
    belt_speed: float = setting(0.12, "m/s", 0.001, 0.5, "the belt's fastest")
    infrared_port: int = setting(2, "", 0, 3, "of the sensor: GP1, GP2, GP4, GP5 are 0 to 3")
    infrared_version: int = setting(1, "", 0, 1, "of the sensor")
    infrared_rate: float = setting(25.0, "Hz", 1.0, 100.0, "of looks at the sensor")
    infrared_clear: float = setting(0.1, "s", 0.0, 2.0, "of a free beam before the belt goes on")

    def __post_init__(self) -> None:
        for item in fields(self):
            _check(item.name, getattr(self, item.name), item.metadata["range"], type(item.default))

    @property
    def home(self) -> ToolPose:
        """Where homing ends."""
        return ToolPose(self.home_x, self.home_y, self.home_z, 0.0)

    @classmethod
    def load(cls, values: Mapping[str, Any]) -> "DriverSettings":
        """Settings with these values; the others keep their defaults.

        Raises ValueError naming an unknown name or a bad value.
        """
        known = [item.name for item in fields(cls)]
        for name in values:
            if name not in known:
                raise ValueError(f"unknown parameter {name!r}; known are {', '.join(known)}")
        return cls(**values)


def settings_table() -> str:
    """The Markdown table of the settings for the README."""
    lines = ["| parameter | default | unit | range | meaning |", "| --- | --- | --- | --- | --- |"]
    for item in fields(DriverSettings):
        low, high = item.metadata["range"]
        lines.append(
            f"| `{item.name}` | {item.default:g} | {item.metadata['unit']} | {low:g}..{high:g} "
            f"| {item.metadata['text']} |"
        )
    return "\n".join(lines)


def _check(name: str, value: Any, bounds: tuple[float, float], kind: type) -> None:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not number or (kind is int and not isinstance(value, int)):
        raise ValueError(f"{name} is {value!r}; it must be a {kind.__name__}")
    if not math.isfinite(value):
        raise ValueError(f"{name} is {value}; it must be finite")
    if not bounds[0] <= value <= bounds[1]:
        raise ValueError(f"{name} is {value}; it must lie in {bounds[0]:g}..{bounds[1]:g}")
