# SPDX-License-Identifier: BSD-3-Clause
"""A virtual Dobot Magician: frames in, frames out, motion in time."""

from fabric_dobot_driver.emulator.controller import Controller
from fabric_dobot_driver.emulator.emulator import Emulator, tell
from fabric_dobot_driver.emulator.settings import Settings

__all__ = ["Controller", "Emulator", "Settings", "tell"]
