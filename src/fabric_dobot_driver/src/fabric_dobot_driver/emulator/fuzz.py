# SPDX-License-Identifier: BSD-3-Clause
"""Damaged frames for the emulator, as many as wanted: no exception, no hang, and it recovers."""

import random
import struct
import time
from collections.abc import Callable, Iterator
from typing import NamedTuple

from fabric_dobot_driver.emulator import commands
from fabric_dobot_driver.emulator.controller import Controller
from fabric_dobot_driver.emulator.frames import HEADER, WRITE, Frame, Parser, encode

ODD_FLOATS = (0.0, -1.0, 1e-40, 3.4e38, -3.4e38, float("nan"), float("inf"), float("-inf"))
GOOD = (  # request, bytes of its answer's parameters
    (Frame(commands.POSE, 0), 32),
    (Frame(commands.ALARMS, WRITE), 0),
    (Frame(commands.START, WRITE), 0),
)
BATCH = 20  # damaged frames between good ones


class Report(NamedTuple):
    """What came of it. Times in s of the real clock."""

    damaged: int  # frames sent
    taken: int  # frames the parser took for whole, by chance or because damage left them so
    answered: int
    asked: int  # undamaged requests in between, every one of which was answered
    seconds: float
    slowest: float  # longest that any one frame took, whatever else the machine did


class Lost(Exception):
    """The emulator did not answer an undamaged request as it should."""


def fuzz(count: int, seed: int) -> Report:
    """Sends so many damaged frames to a controller in virtual time.

    Raises Lost when it stops answering, and lets every other exception through.
    """
    rng = random.Random(seed)
    controller, parser = Controller(), Parser()
    now, taken, answered, asked, slowest = 0.0, 0, 0, 0, 0.0
    start = time.perf_counter()
    for sent in range(1, count + 1):
        data = _damage(rng, _random_frame(rng))
        for piece in _pieces(rng, data):
            before = time.perf_counter()
            for frame in parser.feed(piece):
                taken += 1
                answered += _handled(controller, frame, now)
            slowest = max(slowest, time.perf_counter() - before)
        now += rng.expovariate(20.0)
        if sent % BATCH == 0 or sent == count:
            for frame in parser.give_up():
                taken += 1
                answered += _handled(controller, frame, now)
            _ask(controller, parser, now)
            asked += len(GOOD)
    return Report(count, taken, answered, asked, time.perf_counter() - start, slowest)


def _handled(controller: Controller, frame: Frame, now: float) -> bool:
    """Whether the frame was answered; the answer has to fit into a frame."""
    answer = controller.handle(frame, now)
    if answer is not None:
        encode(answer)
    return answer is not None


def _ask(controller: Controller, parser: Parser, now: float) -> None:
    """Undamaged requests: the pose; no alarms and a running queue, so that commands are tried."""
    for request, length in GOOD:
        frames = parser.feed(encode(request))
        answers = [controller.handle(frame, now) for frame in frames]
        if len(answers) != 1 or answers[0] is None or len(answers[0].params) != length:
            raise Lost(f"sent {request} at {now} s, heard {answers}")


def _random_frame(rng: random.Random) -> bytes:
    """A frame that may make sense: a command of the table with parameters of its layout."""
    if rng.random() < 0.1:
        command_id, params = rng.randrange(256), rng.randbytes(rng.randrange(40))
    else:
        command_id = rng.choice(list(commands.TABLE))
        params = _random_params(rng, commands.TABLE[command_id])
    return encode(Frame(command_id, rng.choice((0, 1, 2, 3, rng.randrange(256))), params))


def _random_params(rng: random.Random, command: commands.Command) -> bytes:
    layout = "".join(kind * int(digits or 1) for digits, kind in _kinds(command.layout))
    values = [_random_value(rng, kind) for kind in layout]
    return struct.pack("<" + layout, *values)


def _kinds(layout: str) -> Iterator[tuple[str, str]]:
    digits = ""
    for character in layout:
        if character.isdigit():
            digits += character
        else:
            yield digits, character
            digits = ""


def _random_value(rng: random.Random, kind: str) -> float:
    if kind == "f":
        return rng.choice(ODD_FLOATS) if rng.random() < 0.05 else rng.uniform(-400.0, 400.0)
    if kind == "i":
        return (
            rng.randrange(-(2**31), 2**31) if rng.random() < 0.5 else rng.randrange(-20000, 20000)
        )
    highest = {"B": 2**8, "H": 2**16, "I": 2**32}[kind]
    return rng.randrange(highest) if rng.random() < 0.3 else rng.randrange(10)


def _flip(rng: random.Random, data: bytearray) -> None:
    data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)


def _lose(rng: random.Random, data: bytearray) -> None:
    at = rng.randrange(len(data))
    del data[at : at + rng.randrange(1, 4)]


def _insert(rng: random.Random, data: bytearray) -> None:
    at = rng.randrange(len(data) + 1)
    data[at:at] = rng.choice((rng.randbytes(rng.randrange(1, 8)), HEADER, HEADER[:1]))


def _truncate(rng: random.Random, data: bytearray) -> None:
    del data[rng.randrange(len(data)) :]


def _wrong_length(rng: random.Random, data: bytearray) -> None:
    data[2] = rng.randrange(256)


def _wrong_byte_right_sum(rng: random.Random, data: bytearray) -> None:
    """Damage that the checksum does not show."""
    at = rng.randrange(3, len(data) - 1)
    data[at] = rng.randrange(256)
    data[-1] = -sum(data[3:-1]) & 0xFF


DAMAGES: tuple[Callable[[random.Random, bytearray], None], ...] = (
    _flip,
    _lose,
    _insert,
    _truncate,
    _wrong_length,
    _wrong_byte_right_sum,
)


def _damage(rng: random.Random, frame: bytes) -> bytes:
    data = bytearray(frame)
    rng.choice(DAMAGES)(rng, data)
    if rng.random() < 0.2 and data:
        rng.choice((_flip, _lose, _insert))(rng, data)
    return bytes(data)


def _pieces(rng: random.Random, data: bytes) -> Iterator[bytes]:
    """The bytes as they may come in: all at once, or in two reads."""
    cut = rng.randrange(len(data) + 1) if rng.random() < 0.3 else len(data)
    yield data[:cut]
    yield data[cut:]
