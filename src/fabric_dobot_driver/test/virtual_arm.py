# SPDX-License-Identifier: BSD-3-Clause
"""The emulated firmware in virtual time, spoken to in frames."""

import math
import struct

from fabric_dobot_driver.emulator import commands
from fabric_dobot_driver.emulator.controller import Controller
from fabric_dobot_driver.emulator.frames import Frame, Parser, encode
from fabric_dobot_driver.emulator.settings import Settings

READ, WRITE, QUEUED = 0, 1, 3
QUICK = Settings(home_time=5.0)


class VirtualArm:
    """A controller with a clock of its own that only `run` moves on."""

    def __init__(self, settings: Settings = QUICK) -> None:
        self.events: list[tuple[str, dict]] = []
        self.now = 0.0
        self.controller = Controller(
            settings, lambda event, **more: self.events.append((event, more))
        )
        self._parser = Parser()

    def run(self, seconds: float) -> None:
        """Time passes, and nobody says anything."""
        self.now += seconds
        self.controller.advance(self.now)

    def ask(self, command: int, control: int, params: bytes = b"") -> bytes | None:
        """Parameters of the answer to a frame; None when there is none."""
        (frame,) = self._parser.feed(encode(Frame(command, control, params)))
        answer = self.controller.handle(frame, self.now)
        if answer is None:
            return None
        assert (answer.id, answer.control) == (command, control)
        return answer.params

    def put(self, command: int, *values: float, control: int = QUEUED) -> int | None:
        """Writes; the queue index, or None when written at once."""
        answer = self.ask(command, control, commands.TABLE[command].pack(values))
        return struct.unpack("<Q", answer)[0] if answer else None

    def ptp(self, mode: int, *values: float) -> int:
        """Queues a PTP command; its index."""
        return self.put(commands.PTP, mode, *values)

    @property
    def pose(self) -> tuple[float, ...]:
        """x, y, z in mm and r in deg, as read."""
        return struct.unpack("<8f", self.ask(commands.POSE, READ))[:4]

    @property
    def joints(self) -> tuple[float, ...]:
        """Joint angles in deg, as read."""
        return struct.unpack("<8f", self.ask(commands.POSE, READ))[4:]

    @property
    def alarms(self) -> set[int]:
        """Codes of the alarms that are set."""
        bits = int.from_bytes(self.ask(commands.ALARMS, READ), "little")
        return {code for code in range(128) if bits >> code & 1}

    @property
    def index(self) -> int:
        """Of the last finished command."""
        return struct.unpack("<Q", self.ask(commands.INDEX, READ))[0]

    @property
    def space(self) -> int:
        """Of the queue."""
        return struct.unpack("<I", self.ask(commands.SPACE, READ))[0]

    def control(self, command: int) -> None:
        """START, STOP, FORCE_STOP, CLEAR or ALARMS, which clears them."""
        assert self.ask(command, WRITE) == b""

    def is_at(self, *goal: float) -> bool:
        """True within what a float of the wire can say."""
        return math.dist(self.pose[: len(goal)], goal) < 1e-3
