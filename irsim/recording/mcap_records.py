"""Records of MCAP files (mcap.dev/spec): their layout, the records of a chunk, unpacking and CRCs."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass

from google.protobuf.message import DecodeError
from isal.isal_zlib import crc32
from mcap.exceptions import McapError
from mcap.opcode import Opcode

MAGIC = b"\x89MCAP0\r\n"

RECORD = struct.Struct("<BQ")
"""Opcode and length, which precede every record."""

MESSAGE = struct.Struct("<HIQQ")
"""Channel, sequence, log time and publish time, which precede a message's data."""

CHUNK_HEAD = struct.Struct("<QQQII")
"""Start time, end time, uncompressed size, CRC of the uncompressed records, length of the compression's name."""

CRC = struct.Struct("<I")
"""CRC-32, the last field of several records."""

BROKEN = (
    McapError,
    DecodeError,
    struct.error,
    ValueError,
    TypeError,
    KeyError,
    IndexError,
    OverflowError,
    MemoryError,
    RuntimeError,
)
"""Errors that mcap, protobuf, lz4, zstandard and struct raise on damaged bytes."""

_LARGEST_UNPACKED = (1 << 30) + (1 << 20)
"""Largest size of an unpacked chunk, bytes: two frames of 16384 x 16384 counts and their headers. Without a limit, a
forged chunk of a few kB could fill the memory."""


_LARGE = 1 << 27
"""Size from which an unpacked chunk must not be much larger than the packed one, bytes."""
_MOST_PACKED = 1000
"""Largest ratio of a large chunk's size to its packed size; pictures with noise reach 10."""


@dataclass(frozen=True, slots=True)
class Packet:
    """Message that was read: sequence number, log time in ns, bytes."""

    sequence: int
    log_time: int
    data: memoryview


def packets(data: memoryview, channel: int) -> Iterator[Packet]:
    """Yield the messages of a channel among the records of a chunk."""
    for opcode, body in records(data):
        if opcode == Opcode.MESSAGE:
            found, sequence, log_time, _ = MESSAGE.unpack_from(body)
            if found == channel:
                yield Packet(sequence, log_time, body[MESSAGE.size :])


def records(data: memoryview) -> Iterator[tuple[int, memoryview]]:
    """Yield the opcode and the body of each record in a chunk."""
    position = 0
    while position < len(data):
        opcode, length = RECORD.unpack_from(data, position)
        position += RECORD.size
        yield opcode, data[position : position + length]
        position += length


def unpack(packed: memoryview, compression: str, size: int) -> memoryview | None:
    """Return the `size` bytes of records in a compressed chunk; None where unpacking fails."""
    if compression == "":
        return packed
    if not 0 < size <= _LARGEST_UNPACKED or (size > _LARGE and size > _MOST_PACKED * len(packed)):
        return None
    import lz4.frame  # type: ignore[import-untyped]  # lz4 has no stubs
    import zstandard

    try:
        if compression == "lz4":
            data = lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=size + 1)
        elif compression == "zstd" and zstandard.frame_content_size(packed) in (-1, size):
            data = zstandard.decompress(packed, max_output_size=size)
        else:
            return None
    except (*BROKEN, zstandard.ZstdError):
        return None
    return memoryview(data) if len(data) == size else None


def matches_crc(data: bytes | memoryview, crc: int) -> bool:
    """Return True if the bytes match the CRC, or the file has no CRC for them."""
    return crc == 0 or crc32(data) == crc  # 0: no CRC (MCAP)
