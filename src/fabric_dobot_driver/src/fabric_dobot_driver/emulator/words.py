# SPDX-License-Identifier: BSD-3-Clause
"""The words that make things happen to the arm: typed at run time, or planned in a script."""

import json
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from fabric_dobot_driver.emulator.alarms import check

if TYPE_CHECKING:
    from fabric_dobot_driver.emulator.emulator import Emulator

SEEN = {"on": True, "off": False, "auto": None}


class Word(NamedTuple):
    """What a word wants, and what it does."""

    usage: str
    help: str
    least: int
    most: int
    do: Callable[..., object]


def _alarm(arm: "Emulator", code: str) -> None:
    arm.controller.raise_alarm(check(int(code, 0)))


def _cube(arm: "Emulator", distance: str = "0", colour: str = "red") -> None:
    arm.controller.extension.put(float(distance), colour)


def _infrared(arm: "Emulator", seen: str) -> None:
    if seen not in SEEN:
        raise ValueError(f"{seen!r}, want {', '.join(SEEN)}")
    arm.controller.extension.forced = SEEN[seen]


def _input(most: int, kind: str) -> Callable[["Emulator", str, str], None]:
    def put(arm: "Emulator", address: str, value: str) -> None:
        number, level = _within(address, 1, 20), _within(value, 0, most)
        getattr(arm.controller.extension, kind)[int(number)] = int(level)

    return put


def _within(text: str, low: float, high: float) -> float:
    value = float(text)
    if not low <= value <= high:
        raise ValueError(f"{text}, want {low:g} to {high:g}")
    return value


def _share(name: str) -> Callable[["Emulator", str], None]:
    return lambda arm, share: setattr(arm.faults, name, _within(share, 0.0, 1.0))


HOUR = 3600.0
WORDS = {
    "silence": Word(
        "S",
        "hear and answer nothing for S seconds",
        1,
        1,
        lambda arm, s: arm.silence(_within(s, 0.0, HOUR)),
    ),
    "garbage": Word(
        "N", "send N random bytes", 1, 1, lambda arm, n: arm.send_garbage(int(_within(n, 0, 1e6)))
    ),
    "delay": Word(
        "S",
        "answer S seconds late from now on",
        1,
        1,
        lambda arm, s: setattr(arm.faults, "delay", _within(s, 0.0, HOUR)),
    ),
    "drop": Word("P", "lose this share of the answers", 1, 1, _share("drop")),
    "corrupt": Word("P", "damage this share of the answers", 1, 1, _share("corrupt")),
    "calm": Word("", "end silence, delay, drop and corrupt", 0, 0, lambda arm: arm.faults.calm()),
    "unplug": Word(
        "S",
        "pull the USB plug for S seconds; the arm goes on",
        1,
        1,
        lambda arm, s: arm.unplug(_within(s, 0.0, HOUR)),
    ),
    "power": Word(
        "S",
        "no power for S seconds, then everything as switched on",
        1,
        1,
        lambda arm, s: arm.power_off(_within(s, 0.0, HOUR)),
    ),
    "alarm": Word("CODE", "raise an alarm, such as 0x11", 1, 1, _alarm),
    "cube": Word("[MM [COLOUR]]", "lay a cube on the belt, MM before the sensor", 0, 2, _cube),
    "take": Word(
        "", "take the cube at the sensor away", 0, 0, lambda arm: arm.controller.extension.take()
    ),
    "infrared": Word(
        "on|off|auto", "what the infrared sensor sees; auto: the cubes", 1, 1, _infrared
    ),
    "di": Word("ADDRESS 0|1", "set a digital input", 2, 2, _input(1, "levels")),
    "adc": Word(
        "ADDRESS VALUE", "set an analogue input, 0 to 4095", 2, 2, _input(4095, "voltages")
    ),
    "state": Word("", "where everything is, as JSON", 0, 0, lambda arm: arm.state()),
}


def parse(line: str) -> Callable[["Emulator"], str]:
    """What the line says to do; called, it answers "ok" or JSON.

    Raises ValueError for words that there are not, or too few or many of them.
    """
    name, *arguments = line.split() or [""]
    word = WORDS.get(name)
    if word is None:
        raise ValueError(f"no word {name!r}; there are: {', '.join(WORDS)}")
    if not word.least <= len(arguments) <= word.most:
        raise ValueError(f"want: {name} {word.usage}")

    def act(arm: "Emulator") -> str:
        answer = word.do(arm, *arguments)
        return "ok" if answer is None else json.dumps(answer)

    return act


class Planned(NamedTuple):
    """Words for a time, in s after the start."""

    at: float
    line: str


def parse_script(text: str, name: str) -> list[Planned]:
    """Entries such as "5: silence 2", one a line or parted by ";"; without a time: at the start.

    Raises ValueError naming the script, the entry and what is wrong with it.
    """
    planned = []
    for number, entry in enumerate(text.replace(";", "\n").splitlines(), 1):
        entry = entry.partition("#")[0].strip()
        if not entry:
            continue
        time, colon, line = entry.rpartition(":")
        try:
            at = float(time) if colon else 0.0
            if not (math.isfinite(at) and at >= 0.0):
                raise ValueError(f"time {time}, want seconds after the start")
            parse(line)
        except ValueError as error:
            raise ValueError(f"{name}: entry {number}, {entry!r}: {error}") from None
        planned.append(Planned(at, line.strip()))
    return sorted(planned, key=lambda plan: plan.at)
