# SPDX-License-Identifier: BSD-3-Clause
"""What the scripts of all clients share. It runs in their environments: standard library only."""

import argparse
import contextlib
import json
import math
import socket
import sys
import time
from collections.abc import Callable, Iterator, Sequence

STEPS = (
    "connect",
    "home",
    "20 moves",
    "suction",
    "belt",
    "infrared edge",
    "alarm",
    "force stop",
)
HOME = (259.1041, 0.0, -8.4853, 0.0)  # mm and deg
MOVES = tuple(
    (200.0 + 12.0 * (i % 5), -80.0 + 50.0 * (i % 4), 10.0 + 20.0 * (i % 3), 0.0) for i in range(20)
)
BEYOND_REACH = (500.0, 0.0, 0.0, 0.0)
ALARM_BEYOND_REACH = 0x11
AFTER_ALARM = (220.0, 30.0, 40.0, 0.0)
LEFT, RIGHT = (200.0, 120.0, 30.0, 0.0), (200.0, -120.0, 30.0, 0.0)  # ends of the stopped move
PULSES_PER_MM = 282.94  # of the emulated belt
SLOW_BELT = 5.0  # mm/s: a cube is seen for seconds
CUBE_AHEAD = 20.0  # mm before the sensor
INFRARED_PORT = 2
CLOSE = 0.05  # mm
PATIENCE = 20.0  # s for anything to come about


class Session:
    """One run of a client against an emulator."""

    def __init__(self) -> None:
        parser = argparse.ArgumentParser()
        parser.add_argument("link", help="port of the emulator")
        parser.add_argument("results", help="file for one JSON line a step")
        arguments = parser.parse_args()
        self.link = arguments.link
        self._results = arguments.results

    @contextlib.contextmanager
    def step(self, name: str) -> Iterator[None]:
        """Writes down how long a step took, or what went wrong."""
        if name not in STEPS:
            raise ValueError(f"no step {name!r}")
        start = time.monotonic()
        fault = None
        try:
            yield
        except Exception as error:
            fault = f"{type(error).__name__}: {error}"
        with open(self._results, "a", encoding="utf-8") as results:
            entry = {"step": name, "seconds": time.monotonic() - start, "fault": fault}
            print(json.dumps(entry), file=results)
        if fault is not None:
            sys.exit(1)

    def tell(self, words: str) -> str:
        """Says words to the emulator; its answer."""
        with socket.socket(socket.AF_UNIX) as connection:
            connection.connect(self.link + ".control")
            connection.sendall(words.encode() + b"\n")
            return connection.makefile().readline().strip()

    def state(self) -> dict:
        """The emulator's own account of where everything is."""
        return json.loads(self.tell("state"))

    def check_at(self, reported: Sequence[float], goal: Sequence[float]) -> None:
        """The client reports this place, and there the arm is."""
        for name, place in (("client", reported), ("emulator", self.state()["pose"])):
            check(math.dist(place[:3], goal[:3]) < CLOSE, f"{name} says {place}, want {goal}")

    def check_between(self, start: Sequence[float], end: Sequence[float]) -> None:
        """The arm stands still on the way from start to end, at neither of them."""
        state = self.state()
        check(not state["moving"], "still moving")
        for place in (start, end):
            check(math.dist(state["pose"][:3], place[:3]) > 1.0, f"stands at {place}")

    def on_its_way(self) -> bool:
        """True when the arm has left the beginning of the move that is to be stopped."""
        return self.state()["pose"][1] < LEFT[1] - 10.0


def check(true: bool, otherwise: str) -> None:
    """Raises AssertionError with these words unless it is true."""
    if not true:
        raise AssertionError(otherwise)


def until(condition: Callable[[], bool], what: str) -> None:
    """Asks again and again; AssertionError when it does not come about."""
    end = time.monotonic() + PATIENCE
    while not condition():
        check(time.monotonic() < end, f"{what} did not come about within {PATIENCE} s")
        time.sleep(0.005)
