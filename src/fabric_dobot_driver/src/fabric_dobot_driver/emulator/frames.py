# SPDX-License-Identifier: BSD-3-Clause
"""Frames of the wire: AA AA, length, id, control, parameters, checksum.

The length counts id, control and parameters; these and the checksum add up to 0 modulo 256.
"""

from typing import NamedTuple

HEADER = b"\xaa\xaa"
WRITE = 0b01  # bit of the control byte: set, not get
QUEUED = 0b10  # bit of the control byte: into the queue, not at once
SHORTEST, LONGEST = 2, 250  # what the length byte may say
AROUND = 4  # bytes of a frame besides those counted


class Frame(NamedTuple):
    """One request, or its answer."""

    id: int
    control: int
    params: bytes = b""

    @property
    def queued(self) -> bool:
        """Bit isQueued of the control byte."""
        return bool(self.control & QUEUED)


def encode(frame: Frame) -> bytes:
    """Bytes of the frame.

    Raises ValueError when there are more parameters than a frame can carry.
    """
    counted = bytes((frame.id, frame.control)) + frame.params
    if len(counted) > LONGEST:
        raise ValueError(f"a frame carries {LONGEST - 2} bytes, not {len(frame.params)}")
    return HEADER + bytes((len(counted),)) + counted + bytes((-sum(counted) & 0xFF,))


class Parser:
    """Finds frames in a stream of bytes, whatever else is in it.

    Damaged frames are dropped without a word, as the arm does; the search goes on at the byte
    behind their first one, so that a whole frame within a damaged one is found.
    """

    def __init__(self) -> None:
        self._buffer = bytearray()
        self.dropped = 0  # headers that no whole frame followed

    @property
    def waiting(self) -> bool:
        """True in the middle of a frame."""
        return bool(self._buffer)

    def feed(self, data: bytes) -> list[Frame]:
        """The frames that are complete with these bytes."""
        self._buffer += data
        return self._scan()

    def give_up(self) -> list[Frame]:
        """The line fell silent within a frame: it is dropped; frames found behind its header."""
        frames = []
        while self._buffer:
            del self._buffer[0]
            self.dropped += 1
            frames += self._scan()
        return frames

    def _scan(self) -> list[Frame]:
        frames = []
        buffer, at = self._buffer, 0
        while True:
            behind, at = at, buffer.find(HEADER, at)
            if at < 0:
                at = len(buffer) - (len(buffer) > behind and buffer.endswith(HEADER[:1]))
                break
            if len(buffer) <= at + 2:
                break
            length = buffer[at + 2]
            end = at + AROUND + length
            if not SHORTEST <= length <= LONGEST:
                at += 1
                self.dropped += 1
            elif len(buffer) < end:
                break
            elif sum(buffer[at + 3 : end]) & 0xFF:
                at += 1
                self.dropped += 1
            else:
                frames.append(
                    Frame(buffer[at + 3], buffer[at + 4], bytes(buffer[at + 5 : end - 1]))
                )
                at = end
        del buffer[:at]
        return frames
