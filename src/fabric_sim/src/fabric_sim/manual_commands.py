# SPDX-License-Identifier: BSD-3-Clause
"""What somebody at the keys can let the simulated person do: names, keys, words."""

from __future__ import annotations

from typing import NamedTuple


class Command(NamedTuple):
    """One button: its word, its key, what stands on it."""

    name: str
    key: str
    label: str


#: In the order of the constants of fabric_msgs/HumanCommand; a test compares them.
COMMANDS = (
    Command("idle", "i", "stand and watch"),
    Command("grasp", "g", "grasp"),
    Command("look_around", "l", "look around"),
    Command("walk_away", "a", "walk away"),
    Command("warn", "w", "warn the robot"),
    Command("come_back", "c", "come back"),
    Command("place", "p", "place"),
    Command("drop", "d", "drop, or fail to lift"),
    Command("begin", " ", "begin"),
)
NAMES = tuple(command.name for command in COMMANDS)

#: Keys of the trays when sorting: place the cube of the hand there.
TRAY_KEYS = ("1", "2", "3", "4", "5", "6", "7", "8", "9")


def command_of_key(key: str, trays: list[str]) -> tuple[str, str] | None:
    """Return (name, tray) of a key, or None; `trays` are the labels of the running task."""
    if key in TRAY_KEYS:
        place = TRAY_KEYS.index(key)
        return ("place", trays[place]) if place < len(trays) else None
    for command in COMMANDS:
        if command.key == key.lower():
            return command.name, ""
    return None
