# SPDX-License-Identifier: BSD-3-Clause
"""What the emulated arm is like, where the protocol leaves it open."""

from dataclasses import dataclass
from pathlib import Path

LIMITS_FILE = Path(__file__).resolve().parents[3] / "config" / "magician.yaml"

Four = tuple[float, float, float, float]


@dataclass(frozen=True)
class Settings:
    """Millimetres, degrees and seconds: the emulator stands at the far side of the wire."""

    limits_file: str | Path = LIMITS_FILE  # joint limits and links of this arm
    power_up: Four = (0.0, 45.0, 45.0, 0.0)  # joint angles when switched on
    home_time: float = 20.0  # homing takes as long wherever it begins
    queue_length: int = 32
    fastest_joint: Four = (320.0, 320.0, 320.0, 480.0)  # deg/s; beyond is overspeed
    fastest_line: float = 500.0  # mm/s; higher settings are cut
    strongest_joint: float = 2000.0  # deg/s^2
    strongest_line: float = 2000.0  # mm/s^2
    pulses_per_mm: float = 282.94  # 200 x 16 x 10 pulses a turn, rollers of 36 mm
    infrared_port: int = 2  # GP4
    colour_port: int = 1  # GP2
    cube_width: float = 25.0
    serial_number: str = "FABRIC-EMULATOR"
    version: tuple[int, int, int] = (3, 7, 0)
