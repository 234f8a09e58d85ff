# SPDX-License-Identifier: BSD-3-Clause
"""The queue of commands and its 64-bit index."""

from collections import deque
from typing import NamedTuple


class Entry(NamedTuple):
    """A queued write."""

    index: int
    id: int
    params: bytes


class Queue:
    """Commands that wait for their turn. The index never runs backwards, not even on clear."""

    def __init__(self, length: int) -> None:
        self._length = length
        self._waiting: deque[Entry] = deque()
        self.executing: Entry | None = None
        self.running = True
        self.issued = 0
        self.finished = 0

    @property
    def space(self) -> int:
        """How many more it takes."""
        return self._length - len(self._waiting) - (self.executing is not None)

    def push(self, command_id: int, params: bytes) -> int | None:
        """Index of the new entry; None when the queue is full."""
        if self.space <= 0:
            return None
        self.issued += 1
        self._waiting.append(Entry(self.issued, command_id, params))
        return self.issued

    def head(self) -> Entry | None:
        """The next in turn."""
        return self._waiting[0] if self._waiting else None

    def begin(self) -> Entry:
        """Takes the next one for execution."""
        self.executing = self._waiting.popleft()
        return self.executing

    def finish(self) -> None:
        """What was in execution is done, or given up."""
        if self.executing is not None:
            self.finished = self.executing.index
            self.executing = None

    def clear(self) -> None:
        """Drops what waits; what is in execution goes on."""
        self._waiting.clear()
