# SPDX-License-Identifier: BSD-3-Clause
"""What may go wrong on the line, on demand."""

import random


class Faults:
    """Times in s of the real clock; everything random comes from the seed."""

    def __init__(self, seed: int = 0) -> None:
        self._random = random.Random(seed)
        self.silent_until = 0.0  # before, the arm neither hears nor answers
        self.delay = 0.0  # of every answer
        self.drop = 0.0  # share of answers that get lost
        self.corrupt = 0.0  # share of answers with one wrong byte

    def calm(self) -> None:
        """Nothing goes wrong any more."""
        self.silent_until = self.delay = self.drop = self.corrupt = 0.0

    def garbage(self, count: int) -> bytes:
        """Noise."""
        return self._random.randbytes(count)

    def answer(self, data: bytes) -> bytes:
        """What gets through of an answer."""
        if self._random.random() < self.drop:
            return b""
        if self._random.random() >= self.corrupt:
            return data
        damaged = bytearray(data)
        damaged[self._random.randrange(len(data))] ^= self._random.randrange(1, 256)
        return bytes(damaged)
