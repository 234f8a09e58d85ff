# SPDX-License-Identifier: BSD-3-Clause
"""Load cells behind a serial line: lines `<channel> <raw>` in, rows of raw counts out.

A small controller beside the trays reads an HX711 for each tray and writes a line for each reading,
for example `1 83121`. Taring, scaling and the detection of steps are perception's
(fabric_perception.load_cells); here counts stay as the converters send them.
"""

import random
from collections.abc import Sequence
from dataclasses import dataclass

from fabric_msgs.msg import LoadCellReadings

HIGH, LOW = LoadCellReadings.SATURATED_HIGH, LoadCellReadings.SATURATED_LOW
LONGEST = 64  # bytes of a line


class LineParser:
    """Cuts a stream of bytes into readings. damaged: lines that were none, so far."""

    def __init__(self) -> None:
        self._begun = b""
        self.damaged = 0

    def feed(self, data: bytes) -> list[tuple[int, int]]:
        """Return the readings that came to their end with these bytes: channel and raw count."""
        *lines, self._begun = (self._begun + data).split(b"\n")
        if len(self._begun) > LONGEST:
            self._begun = b""
            self.damaged += 1
        readings = (self._parse(line) for line in lines)
        return [reading for reading in readings if reading is not None]

    def _parse(self, line: bytes) -> tuple[int, int] | None:
        words = line.split()
        try:
            channel, raw = (int(word) for word in words)
            if LOW <= raw <= HIGH:
                return channel, raw
        except ValueError:  # another number of words, or no numbers
            pass
        self.damaged += bool(words)
        return None


class Rows:
    """Joins readings of single channels into rows; one that is missing counts as saturated."""

    def __init__(self, channels: Sequence[int]) -> None:
        """channels: in the order of a row. Raises ValueError unless they are different ones."""
        if not channels or len(set(channels)) != len(channels):
            raise ValueError(f"channels are {list(channels)}, want different ones, at least one")
        self._channels = tuple(channels)
        self._begun: dict[int, int] = {}

    def add(self, channel: int, raw: int) -> list[int] | None:
        """Take a reading; return a row when this completes it or begins the next one."""
        if channel not in self._channels:
            return None
        row = None
        if channel in self._begun:
            row, self._begun = self._row(), {}
        self._begun[channel] = raw
        if row is None and len(self._begun) == len(self._channels):
            row, self._begun = self._row(), {}
        return row

    def _row(self) -> list[int]:
        return [self._begun.get(channel, HIGH) for channel in self._channels]


@dataclass(frozen=True)
class Source:
    """What the simulated converters are like: counts and grams."""

    counts_per_gram: float = 420.0
    noise: float = 0.12  # g, standard deviation
    cube: float = 18.0  # g
    every: float = 5.0  # s from one cube to the next; they go into the trays in turn


class SimulatedLine:
    """Writes what the controller beside the trays would, to try things without trays."""

    def __init__(
        self, channels: Sequence[int], rate: float, seed: int, source: Source | None = None
    ) -> None:
        """rate: readings a second of each channel."""
        self._channels, self._rate = tuple(channels), rate
        self._source = source or Source()
        self._random = random.Random(seed)
        self._offsets = {channel: self._random.randint(-200000, 200000) for channel in channels}
        self._count = 0

    def read(self, now: float) -> bytes:
        """Everything that was written up to `now`, s after the start."""
        lines = []
        while self._count < now * self._rate:
            lines += [self._line(channel) for channel in self._channels]
            self._count += 1
        return b"".join(lines)

    def _line(self, channel: int) -> bytes:
        s, place = self._source, self._channels.index(channel)
        cubes = int(self._count / self._rate / s.every)
        mine = (cubes + len(self._channels) - 1 - place) // len(self._channels)
        grams = mine * s.cube + self._random.gauss(0.0, s.noise)
        return b"%d %d\n" % (channel, self._offsets[channel] + round(grams * s.counts_per_gram))
