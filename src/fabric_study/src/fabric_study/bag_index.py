# SPDX-License-Identifier: BSD-3-Clause
"""Whether a bag was closed and its index can be read (bag format 2.0), without ROS."""

import struct
from pathlib import Path
from typing import BinaryIO

MAGIC = b"#ROSBAG V2.0\n"
BAG_HEADER, CHUNK, CHUNK_INFO, CONNECTION = 0x03, 0x05, 0x06, 0x07  # field `op` of a record
Fields = dict[str, bytes]


class BagError(ValueError):
    """A bag that was not closed, or is damaged; the text says where."""


def check_bag(path: Path) -> int:
    """Return how many messages the index of a bag tells of.

    Raises BagError naming the file and the byte at which something else should stand.
    """
    try:
        size = path.stat().st_size
        with path.open("rb") as file:
            return _messages(file, size)
    except OSError as error:
        raise BagError(f"{path}: cannot be read: {error}") from error
    except BagError as error:
        raise BagError(f"{path}: {error}") from error


def _messages(file: BinaryIO, size: int) -> int:
    if file.read(len(MAGIC)) != MAGIC:
        raise BagError("does not begin as a bag does")
    header = _record(file, size, BAG_HEADER)
    index = _number(header, "index_pos", "<Q")
    if index == 0:
        raise BagError("was not closed: it has no index")
    if index > size:
        raise BagError(f"its index would begin at byte {index} of {size}")
    file.seek(index)
    for _ in range(_number(header, "conn_count", "<I")):
        _record(file, size, CONNECTION)
    messages, chunks = 0, []
    for _ in range(_number(header, "chunk_count", "<I")):
        info, counts = _record(file, size, CHUNK_INFO), file.tell()
        messages += _count(file, counts, _number(info, "count", "<I"))
        chunks.append(_number(info, "chunk_pos", "<Q"))
    if file.tell() != size:
        raise BagError(f"its index ends at byte {file.tell()} of {size}")
    for chunk in chunks:
        file.seek(chunk)
        _record(file, index, CHUNK)
    return messages


def _count(file: BinaryIO, after: int, connections: int) -> int:
    """Return the sum over the (connection, count) pairs that end at byte `after`."""
    file.seek(after - 8 * connections)
    pairs = struct.unpack(f"<{2 * connections}I", file.read(8 * connections))
    return sum(pairs[1::2])


def _record(file: BinaryIO, limit: int, op: int) -> Fields:
    """Return the header of the record at the file's position, and go behind its data."""
    begin = file.tell()
    fields = _fields(_block(file, limit, begin), begin)
    if fields.get("op") != bytes([op]):
        raise BagError(f"at byte {begin} stands another record than it should")
    _block(file, limit, begin, skip=True)
    return fields


def _block(file: BinaryIO, limit: int, begin: int, skip: bool = False) -> bytes:
    raw = file.read(4)
    length = struct.unpack("<I", raw)[0] if len(raw) == 4 else limit
    if file.tell() + length > limit:
        raise BagError(f"the record at byte {begin} is cut off")
    if skip:
        file.seek(length, 1)
        return b""
    return file.read(length)


def _fields(header: bytes, begin: int) -> Fields:
    fields: Fields = {}
    while header:
        length = struct.unpack("<I", header[:4])[0] if len(header) >= 4 else len(header)
        name, equals, value = header[4 : 4 + length].partition(b"=")
        if not equals or 4 + length > len(header):
            raise BagError(f"the header of the record at byte {begin} is damaged")
        fields[name.decode("ascii", "replace")] = value
        header = header[4 + length :]
    return fields


def _number(fields: Fields, name: str, layout: str) -> int:
    value = fields.get(name, b"")
    if len(value) != struct.calcsize(layout):
        raise BagError(f"a record of its index has no {name}")
    return struct.unpack(layout, value)[0]
