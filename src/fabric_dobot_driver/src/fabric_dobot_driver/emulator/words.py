# SPDX-License-Identifier: BSD-3-Clause
"""The words that make things happen to the arm: typed at run time, or planned in a script."""

import json
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from fabric_dobot_driver.emulator.alarms import BITS
from fabric_dobot_driver.emulator.extension import COLOURS

if TYPE_CHECKING:
    from fabric_dobot_driver.emulator.emulator import Emulator

Convert = Callable[[str], object]
LONGEST = 3600.0  # s that any fault lasts
MOST_GARBAGE = 1_000_000


def _number(low: float, high: float) -> Convert:
    def convert(text: str) -> float:
        value = float(text)
        if not low <= value <= high:
            raise ValueError(f"{text}, want {low:g} to {high:g}")
        return value

    return convert


def _whole(low: int, high: int) -> Convert:
    def convert(text: str) -> int:
        value = int(text, 0)
        if not low <= value <= high:
            raise ValueError(f"{text}, want {low} to {high}")
        return value

    return convert


def _one_of(choices: dict[str, object]) -> Convert:
    def convert(text: str) -> object:
        if text not in choices:
            raise ValueError(f"{text!r}, want {', '.join(choices)}")
        return choices[text]

    return convert


SECONDS = _number(0.0, LONGEST)
SHARE = _number(0.0, 1.0)
ADDRESS = _whole(1, 20)
MILLIMETRES = _number(-1e6, 1e6)
COLOUR = _one_of({name: name for name in COLOURS})
SEEN = _one_of({"on": True, "off": False, "auto": None})


class Word(NamedTuple):
    """What a word wants, and what it does with it."""

    usage: str
    help: str
    do: Callable[..., object]
    takes: tuple[Convert, ...] = ()
    least: int | None = None  # arguments that are enough; all of them unless given


def _set(part: str, name: str) -> Callable[..., None]:
    return lambda arm, value: setattr(getattr(arm, part), name, value)


def _alarm(arm: "Emulator", code: int) -> None:
    arm.controller.raise_alarm(code)


def _cube(arm: "Emulator", distance: float = 0.0, colour: str = "red") -> None:
    arm.controller.extension.put(distance, colour)


def _infrared(arm: "Emulator", seen: bool | None) -> None:
    arm.controller.extension.forced = seen


def _digital(arm: "Emulator", address: int, level: int) -> None:
    arm.controller.extension.levels[address] = level


def _analogue(arm: "Emulator", address: int, value: int) -> None:
    arm.controller.extension.voltages[address] = value


WORDS = {
    "silence": Word(
        "S", "hear and answer nothing for S seconds", lambda arm, s: arm.silence(s), (SECONDS,)
    ),
    "garbage": Word(
        "N", "send N random bytes", lambda arm, n: arm.send_garbage(n), (_whole(0, MOST_GARBAGE),)
    ),
    "delay": Word("S", "answer S seconds late from now on", _set("faults", "delay"), (SECONDS,)),
    "drop": Word("P", "lose this share of the answers", _set("faults", "drop"), (SHARE,)),
    "corrupt": Word("P", "damage this share of the answers", _set("faults", "corrupt"), (SHARE,)),
    "calm": Word("", "end silence, delay, drop and corrupt", lambda arm: arm.faults.calm()),
    "unplug": Word(
        "S",
        "pull the USB plug for S seconds; the arm goes on",
        lambda arm, s: arm.unplug(s),
        (SECONDS,),
    ),
    "power": Word(
        "S",
        "no power for S seconds, then everything as switched on",
        lambda arm, s: arm.power_off(s),
        (SECONDS,),
    ),
    "alarm": Word("CODE", "raise an alarm, such as 0x11", _alarm, (_whole(0, BITS - 1),)),
    "cube": Word(
        "[MM [COLOUR]]",
        "lay a cube on the belt, MM before the sensor",
        _cube,
        (MILLIMETRES, COLOUR),
        least=0,
    ),
    "take": Word(
        "", "take the cube at the sensor away", lambda arm: arm.controller.extension.take()
    ),
    "infrared": Word(
        "on|off|auto", "what the infrared sensor sees; auto: the cubes", _infrared, (SEEN,)
    ),
    "di": Word("ADDRESS 0|1", "set a digital input", _digital, (ADDRESS, _whole(0, 1))),
    "adc": Word(
        "ADDRESS VALUE", "set an analogue input, 0 to 4095", _analogue, (ADDRESS, _whole(0, 4095))
    ),
    "state": Word("", "where everything is, as JSON", lambda arm: arm.state()),
}


def parse(line: str) -> Callable[["Emulator"], str]:
    """What the line says to do; called, it answers "ok" or JSON.

    Raises ValueError for words that there are not, and for too few, too many or wrong arguments.
    """
    name, *arguments = line.split() or [""]
    word = WORDS.get(name)
    if word is None:
        raise ValueError(f"no word {name!r}; there are: {', '.join(WORDS)}")
    least = len(word.takes) if word.least is None else word.least
    if not least <= len(arguments) <= len(word.takes):
        raise ValueError(f"want: {name} {word.usage}")
    values = [convert(text) for convert, text in zip(word.takes, arguments, strict=False)]

    def act(arm: "Emulator") -> str:
        answer = word.do(arm, *values)
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
